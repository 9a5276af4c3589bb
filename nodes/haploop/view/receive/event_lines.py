"""What changed a run, in words."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from haploop.view.receive.at_work import NO_ELEMENT

KINDS = ("swap", "set", "pause", "resume", "step", "stop", "pace", "refused")
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
            lines.append({"tick": tick, "t_s": tick / rate, "kind": kind, "text": _text(kind, event, units)})
    return lines[-_MOST:]


def _units(options: dict[str, Any]) -> dict[str, str]:
    """Unit by parameter of a kind (``damping.damping``) and by settable key."""
    kinds = options.get("kinds", {})
    units = {f"{kind}.{name}": p["unit"] for kind, about in kinds.items() for name, p in about["parameters"].items()}
    return units | {key: about["unit"] for key, about in options.get("settable", {}).items()}


def _text(kind: str, event: dict[str, Any], units: dict[str, str]) -> str:
    match kind:
        case "swap":
            return _swap(event.get("element") or 0, dict(event["swap"]), units)
        case "set":
            return ", ".join(f"{key} = {_amount(value, units.get(key, ''))}" for key, value in event["set"].items())
        case "step":
            return f"{event['step']} tick{'s' * (event['step'] != 1)} on"
        case "pace":
            return f"pace {event['pace']:g}×" if isinstance(event["pace"], int | float) else f"pace {event['pace']}"
        case "refused":
            return str(event["refused"])
    return {"pause": "paused", "resume": "resumed", "stop": "stopped"}[kind]


def _swap(place: int, table: dict[str, Any], units: dict[str, str]) -> str:
    kind, acts = table.pop("kind"), table.pop("acts", "in-contact")
    if kind == NO_ELEMENT:
        return f"element {place} removed"
    amounts = {name: _amount(value, units.get(f"{kind}.{name}", "")) for name, value in table.items()}
    words = [*amounts.values()] if len(amounts) == 1 else [f"{name} {amount}" for name, amount in amounts.items()]
    words += ["acts always"] if acts == "always" else []
    return f"element {place} becomes {kind}" + (f" ({', '.join(words)})" if words else "")


def _amount(value: Any, unit: str) -> str:
    return f"{value:g} {unit}".rstrip() if isinstance(value, int | float) else str(value)
