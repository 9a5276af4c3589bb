"""A resolved sweep and its cells: one run each, numbered, made when they are needed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from haploop.launch.batch.stacking import is_batchable
from haploop.launch.scene.check import resolve
from haploop.launch.scene.events import elements_of, try_out
from haploop.launch.scene.layers import Layers
from haploop.launch.scene.mistakes import Mistake, SceneError
from haploop.launch.scene.overrides import key_path, lay_value
from haploop.launch.scene.toml_writer import Lines, inline, lines_of, to_toml
from haploop.protocol.scene.paths import value_at
from haploop.tools.executor.parts import Group
from haploop.tools.executor.work import Sources, load_kinds
from haploop.tools.sweep.table import CELL, ENDED, NUMBER, SCENE, SEED, TEXT, WHOLE, WHY, Column

# Scenes that differ in these tables are run in different arrays.
_APART = ("clock", "duration", "event")


@dataclass(frozen=True)
class Axis:
    """An axis of a sweep: a key of the scene and its values.

    Attributes:
        key: dotted key of the scene.
        values: SI numbers; or names, tables, whatever a scene may hold there.
        unit: of the numbers, None where they are none.
        whole: whether they are whole numbers.
    """

    key: str
    values: tuple[Any, ...]
    unit: str | None = None
    whole: bool = False

    @property
    def apart(self) -> bool:
        """Tells whether scenes of two values are of two structures, which are run in different arrays."""
        return self.unit is None or (self.whole and self.key != "seed") or key_path(self.key)[0] in _APART

    def entry(self, value: Any) -> Any:
        """Returns a value as the table holds it: a number, a name, or TOML."""
        return value if self.unit is not None or isinstance(value, str) else inline(value)


@dataclass(frozen=True)
class Bisect:
    """The search for a boundary: its axis, its tolerance, and the verdict on its near side."""

    axis: str
    holds: str
    tolerance: float = 0.0
    relative: float = 0.0


@dataclass(frozen=True)
class Extra:
    """A cell between the values of the axis that is bisected: its number, a cell beside it, its own value there."""

    cell: int
    beside: int
    value: float


Item = int | Extra


@dataclass(frozen=True)
class Sweep:
    """A sweep, resolved. Its cells are numbered with the axes that keep scenes apart outermost and seeds innermost.

    Attributes:
        title: of the sweep.
        base: the resolved scene that the axes vary.
        axes: one to three, in the order of the file.
        repeat: seeds of every combination: that of the scene, and those after it.
        record: columns of what is recorded, by dotted keys of a summary.
        bisect: None for a grid.
        sources: plugin files, by name and text.
    """

    title: str
    base: dict[str, Any]
    axes: tuple[Axis, ...]
    repeat: int = 1
    record: tuple[Column, ...] = ()
    bisect: Bisect | None = None
    sources: Sources = field(default=(), repr=False)

    @cached_property
    def order(self) -> tuple[Axis, ...]:
        """The axes from the outermost to the innermost."""
        return tuple(sorted(self.axes, key=lambda axis: not axis.apart))

    @cached_property
    def count(self) -> int:
        """Number of cells of the grid."""
        return math.prod(len(axis.values) for axis in self.axes) * self.repeat

    def groups(self) -> Iterator[Group]:
        """Yields the cells whose scenes go into one array, if they go into any."""
        length = self.count // math.prod(len(axis.values) for axis in self.axes if axis.apart)
        for first in range(0, self.count, length):
            yield Group(range(first, first + length), self.together(first))

    def together(self, item: Item) -> bool:
        """Tells whether the scene of a cell, and those like it, go into an array."""
        try:
            return is_batchable(self.scene(item))
        except Exception:  # it will be a row with its reason
            return False

    def number(self, places: dict[str, int], repeat: int) -> int:
        """Returns the cell at a place on each axis."""
        cell = 0
        for axis in self.order:
            cell = cell * len(axis.values) + places[axis.key]
        return cell * self.repeat + repeat

    def values(self, item: Item) -> tuple[dict[str, Any], int]:
        """Returns the value of each axis, by key, and the seed."""
        cell, repeat = divmod(item.beside if isinstance(item, Extra) else item, self.repeat)
        found = {}
        for axis in reversed(self.order):
            cell, place = divmod(cell, len(axis.values))
            found[axis.key] = axis.values[place]
        if isinstance(item, Extra) and self.bisect:
            found[self.bisect.axis] = item.value
        return {axis.key: found[axis.key] for axis in self.axes}, self.base["seed"] + repeat

    def scene(self, item: Item) -> dict[str, Any]:
        """Returns the resolved scene of a cell.

        Raises:
            ValueError: its values make no scene that can be run; the message says why.
            ElementError: an element's own code refuses its parameters.
        """
        values, seed = self.values(item)
        kinds = load_kinds(self.sources)
        scene = resolved({"seed": seed, **values}, self.base, kinds)
        try_out(elements_of(scene), kinds)
        return scene

    def row(self, item: Item, scene: dict[str, Any] | None, result: dict[str, Any]) -> dict[str, Any]:
        """Makes the row of a cell in the table."""
        values, seed = self.values(item)
        recorded = {column.name: _entry(result, column) for column in self.record}
        ended = result["ended"]
        return {
            CELL: item.cell if isinstance(item, Extra) else item,
            **{axis.key: axis.entry(values[axis.key]) for axis in self.axes},
            **recorded,
            SEED: values.get(SEED, seed),
            ENDED: ended,
            WHY: result.get("why", ""),
            SCENE: None if scene is None else to_toml(scene, self._lines),
        }

    @cached_property
    def _lines(self) -> Lines:
        """Lines of TOML that cells share with the base scene."""
        return lines_of(self.base)

    def columns(self) -> list[Column]:
        """Returns the columns of the table."""
        return [
            Column(CELL, WHOLE),
            *self.axis_columns(),
            *([] if SEED in {axis.key for axis in self.axes} else [Column(SEED, WHOLE)]),
            *self.record,
            *(Column(name, TEXT) for name in (ENDED, WHY, SCENE)),
        ]

    def axis_columns(self) -> list[Column]:
        """Returns a column for each axis; the seed, where it is one, is a whole number."""
        kinds = {True: TEXT, False: NUMBER}
        return [
            Column(axis.key, WHOLE if axis.key == SEED else kinds[axis.unit is None], axis.unit or "")
            for axis in self.axes
        ]

    def toml(self) -> str:
        """Returns the sweep as a file that runs by itself."""
        table: dict[str, Any] = {"title": self.title, "repeat": self.repeat}
        table["record"] = [column.name for column in self.record]
        table["axes"] = {axis.key: list(axis.values) for axis in self.axes}
        if bisect := self.bisect:
            tolerances = {"tolerance": bisect.tolerance, "relative": bisect.relative}
            given = {name: value for name, value in tolerances.items() if value}
            table["bisect"] = {"axis": bisect.axis, **given, "holds": bisect.holds}
        return to_toml({**table, "base": self.base})


def resolved(values: dict[str, Any], base: dict[str, Any], kinds: dict[str, Any]) -> dict[str, Any]:
    """Resolves a scene with other values at some dotted keys; it shares with the base what they leave alone.

    Raises:
        SceneError: there is no such scene; its mistakes name no file.
    """
    others = {path[0] for path in map(key_path, values)}
    layers = Layers(Path(), base | {key: deepcopy(base[key]) for key in others & base.keys()})
    for key, value in values.items():
        if complaint := lay_value(layers, key_path(key), deepcopy(value)):
            layers.mistakes.append(Mistake("", key, "cannot be set", complaint))
    try:
        scene = resolve(layers, kinds)
    except SceneError as error:
        raise Refused(error.mistakes) from error
    scene.get("event", []).sort(key=lambda event: event["at"])
    left = {key: base[key] for key in scene.keys() - others & base.keys()}
    return {key: left[key] if left.get(key) == entry else entry for key, entry in scene.items()}


class Refused(SceneError):
    """Values that make no scene; the message names no file, since none is at fault."""

    def __str__(self) -> str:
        return " ".join(str(mistake).partition(": ")[2] for mistake in self.mistakes)


def _entry(result: dict[str, Any], column: Column) -> Any:
    """Returns the value of a result at a dotted key; None where there is none."""
    value = value_at(result, column.name)
    return value if value is None or column.kind != NUMBER else float(value)
