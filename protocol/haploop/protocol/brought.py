"""Names in a scene that belong to classes which plugin files have brought into this process."""

from __future__ import annotations

from haploop.protocol.installed import brought
from haploop.protocol.scene.hand_force import HandForce
from haploop.protocol.scene.scene import Scene
from haploop.protocol.walls.wall import Wall


def is_of_file(group: str, name: str | None) -> bool:
    """Tells whether a plugin file has brought a class of this name in this group of entry points."""
    return name is not None and name in brought(group)


def names_of_files(scene: Scene) -> bool:
    """Tells whether a scene names a wall or a hand force of a plugin file, which the plant or the logger needs."""
    force = scene.hand and scene.hand.force
    return is_of_file(Wall.group, scene.wall and scene.wall.kind) or is_of_file(HandForce.group, force and force.kind)
