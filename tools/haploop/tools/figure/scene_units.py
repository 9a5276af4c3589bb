"""Units of the numbers of a scene, by dotted key, and of the parameters of installed elements."""

from __future__ import annotations

from functools import cache
from typing import get_type_hints

from haploop.controller.dissipation.registry import PluginError, registry
from haploop.protocol.quantity import Quantity
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import ElementTable, Scene
from haploop.protocol.scene.table import Table


@cache
def element_units() -> dict[str, str]:
    """Returns units by kind and parameter (``damping.damping``); none where an installed element does not load."""
    try:
        kinds = registry()
    except PluginError:
        return {}
    return {f"{kind}.{name}": of.unit for kind, it in kinds.items() for name, (of, _) in it.parameters().items()}


def unit_at(scene: Scene, key: str) -> str:
    """Returns the unit of the number at a dotted key; "" where it has none, or a plugin file alone knows it."""
    around, _, name = key.rpartition(".")
    inside = value_at(scene, around) if around else scene
    if isinstance(inside, ElementTable):
        return element_units().get(f"{inside.name}.{name}", "")
    hint = get_type_hints(type(inside), include_extras=True).get(name) if isinstance(inside, Table) else None
    return next((part.unit for part in getattr(hint, "__metadata__", ()) if isinstance(part, Quantity)), "")
