"""Units of the numbers of a scene, by dotted key, and of the parameters of elements, installed or of plugin files."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from typing import TYPE_CHECKING, get_type_hints

from haploop.controller.dissipation.registry import PluginError, registry
from haploop.protocol.quantity import Quantity
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import ElementTable, Scene
from haploop.protocol.scene.table import Table

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element


@cache
def element_units() -> dict[str, str]:
    """Returns units by kind and parameter (``damping.damping``); none where an installed element does not load."""
    try:
        return units_of(registry())
    except PluginError:
        return {}


def units_of(kinds: Mapping[str, type[Element]]) -> dict[str, str]:
    """Returns the units of the parameters of these elements, by kind and parameter."""
    return {f"{kind}.{name}": of.unit for kind, it in kinds.items() for name, (of, _) in it.parameters().items()}


def declared_units(source: str) -> dict[str, str]:
    """Returns the units that the text of a plugin file declares, as ``element_units`` does; it is parsed, never run."""
    units: dict[str, str] = {}
    with suppress(SyntaxError, ValueError, RecursionError, MemoryError):
        for made in [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ClassDef)]:
            kinds = [
                line.value
                for line in made.body
                if isinstance(line, ast.Assign) and ast.unparse(line.targets[0]) == "kind"
            ]
            for line in [line for line in made.body if isinstance(line, ast.AnnAssign)]:
                calls = [node for node in ast.walk(line.annotation) if isinstance(node, ast.Call)]
                match kinds, calls:
                    case [ast.Constant(str(kind))], [ast.Call(args=[ast.Constant(str(unit)), *_])]:
                        units[f"{kind}.{ast.unparse(line.target)}"] = unit
    return units


def unit_at(scene: Scene, key: str, units: Mapping[str, str]) -> str:
    """Returns the unit of the number at a dotted key, "" for none; ``units`` has those of elements."""
    around, _, name = key.rpartition(".")
    inside = value_at(scene, around) if around else scene
    if isinstance(inside, ElementTable):
        return units.get(f"{inside.name}.{name}", "")
    hint = get_type_hints(type(inside), include_extras=True).get(name) if isinstance(inside, Table) else None
    return next((part.unit for part in getattr(hint, "__metadata__", ()) if isinstance(part, Quantity)), "")
