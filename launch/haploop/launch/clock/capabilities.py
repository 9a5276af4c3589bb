"""Choices that a running loop offers: keys that can be set, kinds that can be swapped in."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from haploop.launch.scene.events import settable_keys
from haploop.launch.scene.number import Number
from haploop.protocol.quantity import Quantity
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Scene
from haploop.protocol.transport.wire import Message
from haploop.protocol.walls.registry import class_of

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element


def settable_at(scene: Scene, kinds: Mapping[str, type[Element]]) -> dict[str, Number]:
    """Returns every key that can be set while this scene runs, with the number that reads its value."""
    return settable_keys([element.name for element in scene.dissipation], scene.wall and class_of(scene.wall), kinds)


def units_at(scene: Scene, kinds: Mapping[str, type[Element]]) -> dict[str, str]:
    """Returns the units of a scene's settable keys, and of every parameter of a kind (``damping.damping``)."""
    declared = {kind: element.parameters().items() for kind, element in kinds.items()}
    of_kinds = {f"{kind}.{name}": quantity.unit for kind, each in declared.items() for name, (quantity, _) in each}
    return of_kinds | {key: number.quantity.unit for key, number in settable_at(scene, kinds).items()}


def as_typed(value: object) -> str:
    """Returns a value as it is written in a scene and in a command."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def in_words(scene: Scene, kinds: Mapping[str, type[Element]], values: Mapping[str, Any]) -> dict[str, str]:
    """Returns values of settable keys in SI units, with their unit and all digits, so that they can be set again."""
    numbers = settable_at(scene, kinds)
    return {
        key: f"{as_typed(value).removesuffix('.0')} {numbers[key].quantity.unit}".strip()
        for key, value in values.items()
    }


def capabilities(scene: Scene, kinds: Mapping[str, type[Element]]) -> Message:
    """Returns the keys that can be set and the kinds that can be swapped in, as plain values.

    Returns:
        ``settable``: key -> unit, bounds and present value; ``kinds``: kind -> what it does and its parameters with
        unit, bounds and default; ``elements``: those in use. A missing bound or default is None.
    """
    keys = settable_at(scene, kinds)
    return {
        "settable": {key: {**number.quantity.as_dict(), "value": value_at(scene, key)} for key, number in keys.items()},
        "kinds": {
            kind: {"about": (element.__doc__ or "").strip().partition("\n")[0], "parameters": _parameters(element)}
            for kind, element in kinds.items()
        },
        "elements": [element.as_dict() for element in scene.dissipation],
    }


def _parameters(element: type[Element]) -> dict[str, Message]:
    declared: dict[str, tuple[Quantity, Any]] = element.parameters()
    return {
        name: {**quantity.as_dict(), "default": None if default is dataclasses.MISSING else default}
        for name, (quantity, default) in declared.items()
    }
