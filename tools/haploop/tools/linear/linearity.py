"""Linearity of a scene's loop in contact, what a linear map leaves out, and the controller as a linear system.

The controller's matrices are found by running the program's own controller on unit vectors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from haploop.controller.active_elements import keeps_attributes, make_element
from haploop.controller.controller import make_params
from haploop.controller.dissipation import Element, registry
from haploop.controller.tick import ControllerParams, StateTuple, initial_state, tick
from haploop.launch.plan.effect import as_written
from haploop.launch.plan.effects import all_effects
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import ElementTable, Scene, Wall, accelerometer_is_used
from haploop.protocol.trees import tree_leaves, tree_unflatten
from haploop.protocol.walls.registry import make_wall

Kinds = Mapping[str, "type[Element]"]
# A wall without stiffness that is never left: the elements act, and its own force is added where it is known.
_ALWAYS_INSIDE = Wall(position=1e300, stiffness=0.0)


@cache
def installed_kinds() -> dict[str, type[Element]]:
    return registry()


def is_linear(scene: Scene, kinds: Kinds | None = None) -> bool:
    """Tells whether ``OneTickMap.from_scene`` gives the map of a resolved scene."""
    return not why_not_linear(scene, kinds)


def why_not_linear(scene: Scene, kinds: Kinds | None = None) -> list[str]:
    """Returns why a scene's loop in contact is no linear map, a few words each; empty if it is one.

    ``kinds`` are the element kinds at hand, here and below: the installed ones when None.
    """
    kinds = installed_kinds() if kinds is None else kinds
    curved = [effect.written for effect in all_effects() if not effect.linear and effect.is_named(scene)]
    wall = make_wall(scene.wall)
    curved += [f"a wall of the kind {wall.kind}"] * (wall.stiffness_and_damping() is None)
    elements = {table.name: make_element(table, kinds)[0] for table in scene.dissipation}
    return curved + [f"the element {kind}" for kind, one in elements.items() if not _is_linear(one)]


def with_spring(scene: Scene) -> Scene:
    """Returns a scene whose wall is a spring, with an element that has its damping: in lasting contact the same loop.

    That a damped spring never pulls is left out; for small swings around a depth that do not come to that, nothing is.
    A wall that is not a spring and damper is kept.
    """
    known = make_wall(scene.wall).stiffness_and_damping()
    if scene.wall is None or known is None or not scene.wall.kind:
        return scene
    damper = ElementTable(name="damping", parameters={"damping": known[1]})
    wall = replace(scene.wall, kind=None, others={})
    return replace(scene, wall=wall, dissipation=(*[damper] * bool(known[1]), *scene.dissipation))


def _is_linear(element: Element) -> bool:
    """Tells whether the force is linear in the motion alone; the wall's force, which some use, is added only later."""
    return element.linear and not element.asks and not keeps_attributes(element)


def left_out(scene: Scene) -> list[str]:
    """Returns the effects of a resolved scene that a map of small, smooth swings in lasting contact leaves out."""
    keys = [key for effect in all_effects() for key in effect.left_out if value_at(scene, key)]
    return [as_written(key) for key in keys] + (["[[event]]"] if scene.event else [])


class LinearController(NamedTuple):
    """c[k+1] = A c[k] + B y[k], force[k] = C c[k] + D y[k] for samples y = (x,) or (x, acceleration).

    c is all that estimators and elements remember, and the force that of the elements, without the wall's spring.

    Attributes:
        moved: (A B), shape (memory, memory + inputs).
        force: (C D), shape (memory + inputs,).
    """

    moved: np.ndarray
    force: np.ndarray

    @classmethod
    def from_scene(cls, scene: Scene, kinds: Kinds) -> LinearController:
        """Finds the system of a resolved scene for which ``why_not_linear`` returns nothing.

        By superposition: a batch is ticked whose member i has a state, or a sample, of 1 in place i and 0 elsewhere.
        Its next state is A and B, row by row. Whole numbers in the state count ticks; they are run until they stay.
        """
        period_s, inputs = 1.0 / scene.clock.control_rate, 1 + accelerometer_is_used(scene)
        params = make_params(replace(scene, wall=_ALWAYS_INSIDE), period_s, dict(kinds))
        state = _settled(params, (0.0,) * inputs)
        leaves = tree_leaves(state)
        numbers = [place for place, leaf in enumerate(leaves) if isinstance(leaf, float)]
        units = np.eye(len(numbers) + inputs)
        for row, place in zip(units, numbers, strict=False):
            leaves[place] = row
        after, row = tick(params, tree_unflatten(state, leaves), tuple(units[len(numbers) :]))
        found = tree_leaves(after)
        moved = np.array([np.broadcast_to(found[place], len(units)) for place in numbers]).reshape(-1, len(units))
        return cls(moved, np.broadcast_to(row[-2], len(units)))._without_what_is_not_used()

    def _without_what_is_not_used(self) -> LinearController:
        """The system without what neither the force nor any other memory depends on, until none of that is left."""
        moved, force = self
        memory = len(moved)
        used = (np.vstack([moved, force]) != 0.0).any(axis=0)[:memory]
        if used.all():
            return self
        columns = np.append(used, np.ones(len(force) - memory, bool))
        return LinearController(moved[used][:, columns], force[columns])._without_what_is_not_used()


def _settled(params: ControllerParams, at_rest: tuple[float, ...]) -> StateTuple:
    """The state at rest once no whole number in it changes any more."""
    state: StateTuple = initial_state(params, at_rest)
    while True:
        after, _ = tick(params, state, at_rest)
        if tree_leaves(after) == tree_leaves(state):
            return state
        state = after
