"""Events of a run in words, each with the time at which it took effect."""

from __future__ import annotations

from haploop.protocol.changes import Change, describe, is_change
from haploop.tools.figure.data import RunData
from haploop.tools.render.scene_units import unit_at


def event_words(run: RunData) -> list[str]:
    """Returns a run's events in order, the scene's and those made live: ``at 1 s: set wall.stiffness = 90 N/m``."""
    words, scene = [], run.scene
    for event in run.events:
        units = {key: unit_at(scene, key, run.units) for key in event.get("set", ())}
        scene = Change.from_dict(0, event).apply(scene) if is_change(event) else scene
        words.append(f"at {event['timestamp']:g} s: {describe(event, {**run.units, **units})}")
    return words
