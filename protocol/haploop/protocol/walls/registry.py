"""The register of walls, and the function that makes the wall which a scene names."""

from __future__ import annotations

from haploop.protocol.register import Register
from haploop.protocol.scene.scene import Wall as WallTable
from haploop.protocol.walls.wall import Spring, Wall

# Every wall by the name that a scene gives it: the class, or "module:class", which is imported where it is used.
WALLS: dict[str, str | type[Wall]] = {
    "spring": Spring,
    "kelvin-voigt": "haploop.protocol.walls.kelvin_voigt:KelvinVoigt",
    "hunt-crossley": "haploop.protocol.walls.hunt_crossley:HuntCrossley",
    "texture": "haploop.protocol.walls.texture:Texture",
}
_REGISTER: Register[Wall] = Register("wall of the kind", Wall.group, WALLS)


def wall_class(name: str) -> type[Wall]:
    """Returns the wall class of a name; raises UnknownKind if there is none."""
    return _REGISTER.find(name)


def all_walls() -> dict[str, type[Wall]]:
    """Returns every wall class by its name; all are imported."""
    return _REGISTER.all()


def class_of(table: WallTable | None) -> type[Wall]:
    """Returns the wall class that a scene's table names; the spring if it names none."""
    return Spring if table is None or table.kind is None else wall_class(table.kind)


def make_wall(table: WallTable | None) -> Wall:
    """Returns the wall of a resolved scene, or of a batch in a stacked one; without a table, one that is nowhere."""
    if table is None:
        return Spring(0.0, 0.0, 0.0)
    return class_of(table)(table.position, table.stiffness, -1.0 if table.occupies == "below" else 1.0, **table.others)


def parameters_of(kind: type[Wall]) -> tuple[str, ...]:
    """Returns the names of all numbers of a wall except its direction."""
    return "position", "stiffness", *kind.keys
