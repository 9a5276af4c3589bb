"""The keys of ``[wall]``, compared with those that its kind declares, and with what elements assume about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, replace
from typing import TYPE_CHECKING

from haploop.launch.scene.events import elements_of
from haploop.launch.scene.models import number_of
from haploop.launch.scene.reading.layers import Layers
from haploop.protocol.scene.scene import Scene, Wall
from haploop.protocol.walls.registry import all_walls, class_of
from haploop.protocol.walls.wall import Spring

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element


def check_wall(layers: Layers) -> None:
    """Adds to the mistakes the keys that a wall lacks or does not take; skips values wrong in themselves."""
    table = layers.data.get("wall")
    if not isinstance(table, dict) or table.keys() <= {"position", "stiffness", "occupies"}:
        return
    walls, name = all_walls(), table.get("kind", "spring")
    if not isinstance(name, str) or name not in walls:
        return
    for key, (_, default) in walls[name].parameters().items():
        if default is MISSING and key not in table:
            expected = f"A wall of the kind {name} needs {number_of(Wall, key).form}."
            layers.complain(("wall", key), expected, "is missing")
    for key in table:
        takers = [other for other, kind in walls.items() if key in kind.keys]
        if takers and name not in takers:
            layers.complain(("wall", key), f"It is used only with a wall of the kind {' or '.join(takers)}.")


def with_defaults(scene: Scene) -> Scene:
    """Returns a scene whose wall has all parameters of its kind."""
    own = {key: default for key, (_, default) in class_of(scene.wall).parameters().items()}
    if scene.wall is None or not own:
        return scene
    return replace(scene, wall=replace(scene.wall, others=own | scene.wall.others))


def check_spring(layers: Layers, scene: Scene, kinds: Mapping[str, type[Element]]) -> None:
    """Adds to the mistakes a wall that is not a spring, if an element takes it for one."""
    if class_of(scene.wall) is Spring:
        return
    for element in elements_of(scene):
        if "wall_stiffness" in kinds[element.name].asks:
            expected = f'It must be "spring" with the element {element.name}, which is given only a stiffness.'
            layers.complain(("wall", "kind"), expected)
