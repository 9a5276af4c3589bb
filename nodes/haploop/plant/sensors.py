"""What the controller gets to see of the plant at a tick."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from haploop.protocol.arrays import floor, rint

ROUNDINGS = {"nearest": rint, "floor": floor}


def encoder(table: dict[str, Any] | None) -> Callable[[Any], Any]:
    """From true to measured position: q rint(x / q) or q floor(x / q); x itself in a scene without ``[encoder]``."""
    if table is None:
        return lambda x: x
    resolution, whole = table["resolution"], ROUNDINGS[table["rounding"]]
    return lambda x: resolution * whole(x / resolution)


def accelerometer_is_used(scene: dict[str, Any]) -> bool:
    """Whether samples carry the plant's acceleration beside the position."""
    return scene.get("acceleration", {}).get("source") == "accelerometer"
