"""What changed a run, in a few words: of an event as the clock sends it and the log keeps it."""

from __future__ import annotations

from typing import Any

from haploop.tools.render.amounts import parameters


def event_words(event: dict[str, Any]) -> str:
    """Such as ``"element 0 becomes damping (damping 0.8)"``."""
    if "swap" in event:
        table = event["swap"]
        kind, values = table["kind"], parameters({name: value for name, value in table.items() if name != "kind"})
        if kind == "none":
            return f"element {event.get('element') or 0} is removed"
        return f"element {event.get('element') or 0} becomes {kind}" + (f" ({values})" if values else "")
    if "set" in event:
        return "set " + ", ".join(f"{key} = {value:g}" for key, value in event["set"].items())
    if "pace" in event:
        pace = event["pace"]
        return "as fast as it goes" if pace == "free" else f"pace {pace:g}"
    verbs = ("pause", "resume", "step", "stop")
    return event.get("refused") or next((verb for verb in verbs if verb in event), "changed")
