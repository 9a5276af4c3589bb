"""A resolved sweep and its cells: one run each, numbered, and made when needed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from haploop.launch.batch.stacking import is_batchable
from haploop.launch.scene.events import elements_of, try_out
from haploop.launch.scene.models import number_of
from haploop.launch.scene.reading.layers import key_path
from haploop.launch.scene.toml_writer import inline, to_toml
from haploop.logger.summary import Summary
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Scene
from haploop.tools.executor.pool import Group
from haploop.tools.executor.work import Sources, load_kinds
from haploop.tools.search.bisect import Tolerance
from haploop.tools.sweep.cell_scene import Base, Values
from haploop.tools.sweep.table import CELL, ENDED, JOINS, NUMBER, SCENE, SEED, TEXT, WHOLE, WHY, Column, Row

# Scenes that differ in these tables are run in different arrays.
_APART = ("clock", "duration", "event")


@dataclass(frozen=True)
class Axis:
    """An axis of a sweep: a dotted key of the scene and its values.

    Attributes:
        values: numbers in an SI unit; if the unit is None, names, tables, or whatever a scene may hold there.
    """

    key: str
    values: tuple[Any, ...]
    unit: str | None = None
    whole: bool = False

    @property
    def apart(self) -> bool:
        """Tells whether the scenes of two values have different structures, which are run in different arrays."""
        return self.unit is None or (self.whole and self.key != "seed") or key_path(self.key)[0] in _APART

    def entry(self, value: Any) -> Any:
        """Returns a value as the table holds it: a number, a name, or TOML."""
        return value if self.unit is not None or isinstance(value, str) else inline(value)


@dataclass(frozen=True)
class Bisect:
    """The search for a boundary: its axis, the verdict on its near side, and its tolerance."""

    axis: str
    holds: str
    tolerance: Tolerance


@dataclass(frozen=True)
class Extra:
    """A cell between the values of the bisected axis: its number, a cell beside it, and its own value on that axis."""

    cell: int
    beside: int
    value: float


Item = int | Extra


@dataclass(frozen=True)
class Sweep:
    """A resolved sweep. Its cells are numbered with the axes that keep scenes apart outermost and seeds innermost.

    Attributes:
        base: the resolved scene that the axes vary, one to three in the order of the file.
        repeat: seeds of every combination: that of the scene, and those after it.
        record: the columns that are recorded, by dotted keys of a summary.
    """

    title: str
    base: Scene
    axes: tuple[Axis, ...]
    repeat: int = 1
    record: tuple[Column, ...] = ()
    bisect: Bisect | None = None
    sources: Sources = field(default=(), repr=False)

    @cached_property
    def order(self) -> tuple[Axis, ...]:
        """The axes from the outermost to the innermost."""
        return tuple(sorted(self.axes, key=lambda axis: not axis.apart))

    @property
    def _shape(self) -> tuple[int, ...]:
        return *(len(axis.values) for axis in self.order), self.repeat

    @cached_property
    def count(self) -> int:
        return math.prod(self._shape)

    def groups(self) -> Iterator[Group]:
        """Yields groups of cells whose scenes go into one array, if they go into any."""
        length = self.count // math.prod(len(axis.values) for axis in self.axes if axis.apart)
        for first in range(0, self.count, length):
            yield Group(range(first, first + length), self.together(first))

    def together(self, item: Item) -> bool:
        """Tells whether the scene of a cell, and scenes like it, go into an array."""
        with suppress(Exception):  # the cell will be a row that says why
            return is_batchable(self.scene(item))
        return False

    def number(self, places: dict[str, int], repeat: int) -> int:
        """Returns the cell at a place on each axis."""
        return int(np.ravel_multi_index((*(places[axis.key] for axis in self.order), repeat), self._shape))

    def values(self, item: Item) -> tuple[Values, int]:
        """Returns the value of each axis, by key, and the seed."""
        cell = item.beside if isinstance(item, Extra) else item
        *places, repeat = np.unravel_index(cell, self._shape)
        found = {axis.key: axis.values[place] for axis, place in zip(self.order, places, strict=True)}
        if isinstance(item, Extra) and self.bisect:
            found[self.bisect.axis] = item.value
        return {axis.key: found[axis.key] for axis in self.axes}, self.base.seed + int(repeat)

    def scene(self, item: Item) -> Scene:
        """Returns the resolved scene of a cell; tables that its values do not change are those of the base.

        Raises:
            ValueError: its values make no scene that can be run; the message says why.
            ElementError: an element's own code refuses its parameters.
        """
        values, seed = self.values(item)
        kinds = load_kinds(self.sources)
        make = self._base.with_numbers if self._in_numbers else self._base.with_values
        scene = make({SEED: seed, **values}, kinds)
        try_out(elements_of(scene), kinds)
        return scene

    @cached_property
    def _in_numbers(self) -> bool:
        """Tells whether cells differ from the base only in numbers, each of which is known to be valid alone."""
        seeds = number_of(Scene, SEED).quantity.complaint(self.base.seed + self.repeat - 1) is None
        return seeds and all(axis.unit is not None and self._base.has_number(axis.key) for axis in self.axes)

    def row(self, item: Item, scene: Scene | None, result: Summary) -> Row:
        """Makes the row of a cell in the table."""
        values, seed = self.values(item)
        return {
            CELL: item.cell if isinstance(item, Extra) else item,
            **{axis.key: axis.entry(values[axis.key]) for axis in self.axes},
            **{column.name: _entry(result, column) for column in self.record},
            SEED: values.get(SEED, seed),
            ENDED: result["ended"],
            WHY: result.get("why", ""),
            SCENE: None if scene is None else self._base.text(scene),
        }

    @cached_property
    def _base(self) -> Base:
        return Base(self.base)

    def bisected(self, bisect: Bisect) -> tuple[Axis, list[Axis]]:
        """Returns the axis of a search and the other axes."""
        others = [axis for axis in self.axes if axis.key != bisect.axis]
        return next(axis for axis in self.axes if axis not in others), others

    def columns(self) -> list[Column]:
        texts = [Column(name, TEXT) for name in (ENDED, WHY, SCENE)]
        return [Column(CELL, WHOLE), *self.key_columns(self.axes), *self.record, *texts]

    def key_columns(self, axes: Sequence[Axis]) -> list[Column]:
        """Returns a column for each of some axes, and one for the seed where it is not an axis."""
        columns = {axis.key: Column(axis.key, TEXT if axis.unit is None else NUMBER, axis.unit or "") for axis in axes}
        return list((columns | {SEED: Column(SEED, WHOLE)}).values())

    def toml(self) -> str:
        """Returns the sweep as a file that runs by itself."""
        bisect = {}
        if self.bisect:
            tolerances = {"tolerance": self.bisect.tolerance.absolute, "relative": self.bisect.tolerance.relative}
            given = {name: value for name, value in tolerances.items() if value}
            bisect = {"bisect": {"axis": self.bisect.axis, **given, "holds": self.bisect.holds}}
        axes = {axis.key: list(axis.values) for axis in self.axes}
        about = {"title": self.title, "repeat": self.repeat, "record": [column.name for column in self.record]}
        return to_toml({**about, "axes": axes, **bisect, "base": self.base.as_dict()})


def _entry(result: Summary, column: Column) -> Any:
    value = value_at(result, column.name)
    if isinstance(value, list):
        return JOINS.join(value)
    return value if value is None or column.kind != NUMBER else float(value)
