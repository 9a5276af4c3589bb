"""The register of walls, and the making of the one that a scene names."""

from __future__ import annotations

from dataclasses import MISSING, fields
from functools import cache
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from haploop.protocol.installed import entry_points_of
from haploop.protocol.scene.scene import Wall as WallTable
from haploop.protocol.walls.wall import Spring, Wall

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

# Every wall by the name that a scene gives it: the class, or "module:class", which is imported where it is used.
WALLS: dict[str, str | type[Wall]] = {
    "spring": Spring,
    "kelvin-voigt": "haploop.protocol.walls.kelvin_voigt:KelvinVoigt",
    "hunt-crossley": "haploop.protocol.walls.hunt_crossley:HuntCrossley",
    "texture": "haploop.protocol.walls.texture:Texture",
}
# Other packages name theirs in this group of entry points.
_GROUP = "haploop.walls"


def _from_outside() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points_of(_GROUP)}


def wall_names() -> tuple[str, ...]:
    """Returns the names of all walls, those of other packages last."""
    return tuple({**WALLS, **_from_outside()})


def wall_class(name: str) -> type[Wall]:
    """Returns the wall of a name, KeyError for none; its module is imported here."""
    if name not in WALLS:
        return _from_outside()[name].load()
    found = WALLS[name]
    return resolve_name(found) if isinstance(found, str) else found


@cache
def all_walls() -> dict[str, type[Wall]]:
    """Returns every wall by its name; all are imported."""
    return {name: wall_class(name) for name in wall_names()}


def class_of(table: WallTable | None) -> type[Wall]:
    """Returns the wall that a scene's table names: a spring where it names none."""
    return Spring if table is None or table.kind is None else wall_class(table.kind)


def make_wall(table: WallTable | None) -> Wall:
    """Returns the wall of a resolved scene, or of a batch in a stacked one; one that is nowhere without a table."""
    if table is None:
        return Spring(0.0, 0.0, 0.0)
    return class_of(table)(table.position, table.stiffness, -1.0 if table.occupies == "below" else 1.0, **table.others)


def parameters_of(kind: type[Wall]) -> tuple[str, ...]:
    """Returns the names of all numbers of a wall but its direction."""
    return "position", "stiffness", *kind.keys


def own_parameters(kind: type[Wall]) -> dict[str, Any]:
    """Returns the parameters that a wall has beside position and stiffness, with their defaults or ``MISSING``."""
    defaults = {field.name: field.default for field in fields(kind)}
    return {name: defaults.get(name, MISSING) for name in kind.keys}
