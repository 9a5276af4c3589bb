"""The scene of a cell: a base scene with other values at some dotted keys."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from haploop.launch.scene.check import validated, with_rules
from haploop.launch.scene.mistakes import Mistake, SceneError
from haploop.launch.scene.reading.layers import Layers, key_path, lay_value
from haploop.launch.scene.toml_writer import lines, to_toml
from haploop.protocol.scene.paths import value_at, with_values
from haploop.protocol.scene.scene import Scene
from haploop.protocol.scene.table import Table, Tables, as_plain

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

# By dotted key of a scene, the values that it may have: numbers in SI units, names, tables.
Values = Mapping[str, Any]
# Without these tables there is no scene.
_NEEDED = {"title", "duration", "device"}


class Refused(SceneError):
    """Values that make no scene; the message names no file, since none is at fault."""

    def __str__(self) -> str:
        return " ".join(str(mistake).partition(": ")[2] for mistake in self.mistakes)


@dataclass(frozen=True)
class Base:
    """A resolved scene that cells vary; tables that a cell does not change are shared with it."""

    scene: Scene

    @cached_property
    def tables(self) -> Tables:
        """The scene as its file would hold it; not to be changed."""
        return self.scene.as_dict()

    @cached_property
    def _lines(self) -> dict[str, list[str]]:
        return {name: made for name, made in lines(self.tables).items() if name not in self.scene.others}

    def has_number(self, key: str) -> bool:
        """Tells whether a dotted key holds a number that has no rules except its bounds and those between keys.

        The numbers of a list have further rules: the times of a recorded force rise.
        """
        around, _, _ = key.rpartition(".")
        inside = value_at(self.scene, around) if around else self.scene
        plain = ".".join(key_path(key)) == key and isinstance(inside, Table)
        return plain and isinstance(value_at(self.scene, key), int | float)

    def with_numbers(self, numbers: Values, kinds: Mapping[str, type[Element]]) -> Scene:
        """Returns the scene with other numbers, each valid alone, in place of numbers that it already has.

        Raises SceneError, with no file named, where they are not valid together.
        """
        scene = with_values(self.scene, numbers)
        return _with_rules(Layers(Path(), self.as_dict(scene)), scene, kinds)

    def with_values(self, values: Values, kinds: Mapping[str, type[Element]]) -> Scene:
        """Returns the scene with other values of any kind; SceneError, with no file named, where they make no scene."""
        changed = _first_parts(values)
        if not changed <= vars(self.scene).keys():
            return resolved(values, self.tables, kinds)
        layers = _laid(values, self.tables)
        read = {name: layers.data[name] for name in changed | _NEEDED if name in layers.data}
        found = validated(layers, read, kinds)
        scene = found and replace(self.scene, **{name: getattr(found, name) for name in changed})
        return _with_rules(layers, scene, kinds)

    def as_dict(self, cell: Scene) -> Tables:
        """Returns a cell's scene as nested dicts; those of shared tables are not to be changed."""
        own = vars(self.scene)
        given = {name: value for name, value in vars(cell).items() if value is not None and value != ()}
        others = given.pop("others")
        return {
            name: self.tables[name] if value is own[name] else as_plain(value) for name, value in given.items()
        } | others

    def text(self, cell: Scene) -> str:
        """Returns a cell's scene as TOML."""
        own, given = vars(self.scene), vars(cell)
        shared = {name: made for name, made in self._lines.items() if given[name] is own[name]}
        return to_toml(self.as_dict(cell), shared)


def resolved(values: Values, base: Tables, kinds: Mapping[str, type[Element]]) -> Scene:
    """Resolves a scene with other values at some dotted keys; SceneError, with no file named, if they make none."""
    layers = _laid(values, base)
    return _with_rules(layers, validated(layers, layers.data, kinds), kinds)


def _first_parts(values: Values) -> set[str]:
    return {key_path(key)[0] for key in values}


def _laid(values: Values, base: Tables) -> Layers:
    """Lays values over the tables of a scene; tables that they do not change are shared."""
    changed = _first_parts(values)
    layers = Layers(Path(), {name: deepcopy(table) if name in changed else table for name, table in base.items()})
    for key, value in values.items():
        if complaint := lay_value(layers, key_path(key), deepcopy(value)):
            layers.mistakes.append(Mistake("", key, "cannot be set", complaint))
    return layers


def _with_rules(layers: Layers, scene: Scene | None, kinds: Mapping[str, type[Element]]) -> Scene:
    try:
        return with_rules(layers, scene, kinds).in_order()
    except SceneError as error:
        raise Refused(error.mistakes) from error
