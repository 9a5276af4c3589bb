"""What a running loop lets people choose: the keys that can be set and the kinds of element that can be swapped in."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from haploop.launch.scene.events import settable_keys
from haploop.protocol.quantity import Quantity

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element


def capabilities(scene: dict[str, Any], kinds: Mapping[str, type[Element]]) -> dict[str, Any]:
    """Everything a form needs, as plain values.

    Args:
        scene: the resolved scene as it stands now.
        kinds: element kinds at hand.

    Returns:
        ``settable``: key -> unit, bounds and present value; ``kinds``: kind -> what it does and its parameters with
        unit, bounds and default; ``elements``: those at work. A bound or default that is not there is None.
    """
    elements = scene.get("dissipation", [])
    keys = settable_keys([element["kind"] for element in elements], "wall" in scene, kinds)
    return {
        "settable": {
            key: {**number.quantity.as_dict(), "value": _value(scene, key.split("."))} for key, number in keys.items()
        },
        "kinds": {
            kind: {"about": _about(element), "parameters": _parameters(element)} for kind, element in kinds.items()
        },
        "elements": elements,
    }


def _value(scene: dict[str, Any], path: list[str]) -> float:
    place: Any = scene
    for part in path:
        place = place[int(part)] if isinstance(place, list) else place[part]
    return place


def _about(element: type[Element]) -> str:
    return (element.__doc__ or "").strip().partition("\n")[0]


def _parameters(element: type[Element]) -> dict[str, dict[str, Any]]:
    declared: dict[str, tuple[Quantity, Any]] = element.parameters()
    return {
        name: {**quantity.as_dict(), "default": None if default is dataclasses.MISSING else default}
        for name, (quantity, default) in declared.items()
    }
