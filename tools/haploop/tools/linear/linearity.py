"""Linearity of a scene's loop in contact, and the effects that a linear map leaves out."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING

from haploop.controller.active_elements import keeps_attributes, make_element
from haploop.controller.dissipation import registry
from haploop.launch.plan.effect import as_written
from haploop.launch.plan.effects import all_effects
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Scene

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

Kinds = Mapping[str, "type[Element]"]


@cache
def installed_kinds() -> dict[str, type[Element]]:
    """Every installed kind of element."""
    return registry()


def is_linear(scene: Scene, kinds: Kinds | None = None) -> bool:
    """Tells whether ``OneTickMap.from_scene`` gives the map of a resolved scene."""
    return not why_not_linear(scene, kinds)


def why_not_linear(scene: Scene, kinds: Kinds | None = None) -> list[str]:
    """Returns the reasons why a scene's loop in contact is no linear map, a few words each; empty if it is one.

    Args:
        kinds: element kinds at hand; the installed ones when None.
    """
    kinds = installed_kinds() if kinds is None else kinds
    curved = [effect.written for effect in all_effects() if not effect.linear and effect.is_named(scene)]
    elements = {table.name: make_element(table, kinds)[0] for table in scene.dissipation}
    return curved + [f"the element {kind}" for kind, one in elements.items() if not one.linear or keeps_attributes(one)]


def left_out(scene: Scene) -> list[str]:
    """Returns the effects of a resolved scene that a map of small, smooth swings in lasting contact leaves out."""
    keys = [key for effect in all_effects() for key in effect.left_out if value_at(scene, key)]
    return [as_written(key) for key in keys] + (["[[event]]"] if scene.event else [])
