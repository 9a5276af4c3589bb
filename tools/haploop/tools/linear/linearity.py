"""Whether a scene's loop in contact is a linear map, and what else it has that such a map leaves out."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from haploop.controller.dissipation import registry
from haploop.plant.choose import integrator_of

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

Kinds = Mapping[str, "type[Element]"]
# DOP853 keeps its error near the last bits: its steps are those of the exact flow for all that is asked here.
_EXACT = ("exact", "dop853")


@cache
def installed_kinds() -> dict[str, type[Element]]:
    """Every installed kind of element."""
    return registry()


def is_linear(scene: dict[str, Any], kinds: Kinds | None = None) -> bool:
    """Whether ``OneTickMap.of`` gives the map of a resolved scene."""
    return not why_not_linear(scene, kinds)


def why_not_linear(scene: dict[str, Any], kinds: Kinds | None = None) -> list[str]:
    """What makes the loop of a resolved scene in contact no linear map, each in a few words; empty if nothing does.

    Args:
        kinds: element kinds at hand; the installed ones when None.
    """
    kinds = installed_kinds() if kinds is None else kinds
    curved = [f"[{table}]" for table in ("friction", "jitter", "loss") if scene.get(table)]
    for table in ("velocity", "acceleration"):
        if scene.get(table, {}).get("estimator") == "foaw":
            curved.append(f'{table}.estimator = "foaw"')
    if (integrator := integrator_of(scene)) not in _EXACT:
        curved.append(f'clock.integrator = "{integrator}"')
    elements = dict.fromkeys(table["kind"] for table in scene.get("dissipation", []))
    return curved + [f"the element {kind}" for kind in elements if not kinds[kind].linear]


def left_out(scene: dict[str, Any]) -> list[str]:
    """What a resolved scene has, and the map of small and smooth swings in a contact that is never left has not."""
    tables = [f"[{table}]" for table in ("encoder", "noise") if scene.get(table)]
    found = [("accelerometer", key) for key in ("bias", "noise_density", "range", "resolution")]
    found += [("actuator", key) for key in ("resolution", "saturation")]
    keys = [f"{table}.{key}" for table, key in found if scene.get(table, {}).get(key)]
    return tables + keys + (["[[event]]"] if scene.get("event") else [])
