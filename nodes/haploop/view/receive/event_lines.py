"""What changed a run, in words."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from haploop.protocol.changes import KINDS, describe

# A page lists no more of them than these, the newest.
_MOST = 1000


def event_lines(
    events: Iterable[tuple[int, dict[str, Any]]], rate: int, options: dict[str, Any] | None
) -> list[dict[str, Any]]:
    """Tick, time in s, kind and text of each event.

    Args:
        events: (tick, event) in order.
        rate: ticks per second, Hz.
        options: what the run lets people choose, for units; None before it is known.
    """
    units = _units(options or {})
    lines = []
    for tick, event in events:
        kind = next((kind for kind in KINDS if kind in event), None)
        if kind:
            lines.append({"tick": tick, "t_s": tick / rate, "kind": kind, "text": describe(event, units)})
    return lines[-_MOST:]


def _units(options: dict[str, Any]) -> dict[str, str]:
    """Unit by parameter of a kind (``damping.damping``) and by settable key."""
    kinds = options.get("kinds", {})
    units = {f"{kind}.{name}": p["unit"] for kind, about in kinds.items() for name, p in about["parameters"].items()}
    return units | {key: about["unit"] for key, about in options.get("settable", {}).items()}
