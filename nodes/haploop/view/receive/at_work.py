"""Which elements and which wall were at work when, from a scene and what changed it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from haploop.controller.changes import describe

Event = dict[str, Any]
NO_ELEMENT = "none"


@dataclass(frozen=True)
class AtWork:
    """Elements and wall from a tick on, as the controller tells of them in telemetry."""

    from_tick: int
    elements: list[dict[str, Any]]
    wall: dict[str, float]


def at_work(scene: dict[str, Any], events: Sequence[tuple[int, Event]]) -> list[AtWork]:
    """What was at work from the start on and from each change on, in order.

    Args:
        scene: the resolved scene.
        events: (tick, event) in order, those that were refused at their tick included.
    """
    refused = [event["refused"] for _, event in events if "refused" in event]
    elements = [_element(table) for table in scene.get("dissipation", [])]
    spans = [AtWork(0, elements, _wall(scene))]
    for tick, event in events:
        if any(text.startswith(f"{describe(event)} at tick {tick} ") for text in refused):
            continue
        if "swap" in event:
            spans.append(_swapped(spans[-1], tick, event.get("element") or 0, event["swap"]))
        elif "set" in event:
            spans.append(_set(spans[-1], tick, event["set"].items()))
    return spans


def _element(table: dict[str, Any]) -> dict[str, Any]:
    return {"kind": table["kind"], "parameters": {name: value for name, value in table.items() if name != "kind"}}


def _wall(scene: dict[str, Any]) -> dict[str, float]:
    if "wall" not in scene:
        return {"position": 0.0, "stiffness": 0.0, "into_wall": 0.0}
    wall = scene["wall"]
    into_wall = 1.0 if wall.get("occupies") == "above" else -1.0
    return {"position": wall["position"], "stiffness": wall["stiffness"], "into_wall": into_wall}


def _swapped(before: AtWork, tick: int, place: int, table: dict[str, Any]) -> AtWork:
    elements = list(before.elements)
    elements[place : place + 1] = [] if table["kind"] == NO_ELEMENT else [_element(table)]
    return AtWork(tick, elements, before.wall)


def _set(before: AtWork, tick: int, settings: Iterable[tuple[str, Any]]) -> AtWork:
    elements, wall = list(before.elements), dict(before.wall)
    for key, value in settings:
        match key.split("."):
            case ["wall", name]:
                wall[name] = value
            case ["dissipation", place, name]:
                element = elements[int(place)]
                elements[int(place)] = {**element, "parameters": {**element["parameters"], name: value}}
    return AtWork(tick, elements, wall)
