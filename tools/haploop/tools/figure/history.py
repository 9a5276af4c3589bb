"""What was at work when: the wall and every element, from the scene and the events of a run."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from haploop.controller.changes import describe


@dataclass
class ElementSpan:
    """An element with one set of parameters and the ticks it covers; it has one book of energy.

    Attributes:
        name: as its book is called in the log: the kind, numbered from the second of a kind on.
        kind, parameters: as in the scene, ``acts`` among the parameters.
        slots: (place in the list of elements, from_tick, to_tick): where its force is in the log.
        from_tick, to_tick: ticks covered, half-open; the end is infinite while it is at work.
    """

    name: str
    kind: str
    parameters: dict[str, Any]
    slots: list[tuple[int, float, float]]
    from_tick: int
    to_tick: float = math.inf


@dataclass(frozen=True)
class WallSpan:
    """The wall as it stood from a tick on."""

    from_tick: int
    position_m: float
    stiffness_N_m: float


class History:
    """Follows a scene through the events that took effect.

    Attributes:
        elements: every element that was ever at work, in the order of their books.
        walls: the wall and what became of it; empty without one.
        into_wall: direction that leads into the wall, +1.0 or -1.0.
    """

    def __init__(self, scene: dict[str, Any], events: list[dict[str, Any]]) -> None:
        wall = scene.get("wall")
        self.walls = [WallSpan(0, wall["position"], wall["stiffness"])] if wall else []
        self.into_wall = 1.0 if wall and wall.get("occupies") == "above" else -1.0
        self.elements: list[ElementSpan] = []
        self._at_work: list[ElementSpan] = []
        for table in scene.get("dissipation", []):
            self._place(len(self._at_work), table, 0)
        refused = [event["refused"] for event in events if "refused" in event]
        for event in events:
            tick = int(event.get("tick", 0))
            if not any(text.startswith(f"{describe(event)} at tick {tick} ") for text in refused):
                self._follow(event, tick)
        # What was replaced in the tick of its coming has no book.
        self.elements = [span for span in self.elements if span.to_tick > span.from_tick]
        for number, span in enumerate(self.elements):
            same = sum(before.kind == span.kind for before in self.elements[:number])
            span.name = f"{span.kind}-{same + 1}" if same else span.kind

    def _follow(self, event: dict[str, Any], tick: int) -> None:
        if "swap" in event:
            self._place(event.get("element") or 0, event["swap"], tick)
        for key, value in event.get("set", {}).items():
            match key.split("."):
                case ["wall", name]:
                    self.walls.append(replace(self.walls[-1], from_tick=tick, **{_WALL_FIELDS[name]: value}))
                case ["dissipation", index, name]:
                    span = self._at_work[int(index)]
                    self._place(int(index), {"kind": span.kind, **span.parameters, name: value}, tick)

    def _place(self, index: int, table: dict[str, Any], tick: int) -> None:
        """Put an element into place ``index``; those after it may move, and with them the columns of their forces."""
        kind = table["kind"]
        for span in self._at_work[index:]:
            span.slots[-1] = (*span.slots[-1][:2], tick)
        for span in self._at_work[index : index + 1]:
            span.to_tick = tick
        parameters = {name: value for name, value in table.items() if name != "kind"}
        new = [] if kind == "none" else [ElementSpan(kind, kind, parameters, [], tick)]
        self._at_work[index : index + 1] = new
        self.elements += new
        for place, span in enumerate(self._at_work[index:], start=index):
            span.slots.append((place, tick, math.inf))


_WALL_FIELDS = {"position": "position_m", "stiffness": "stiffness_N_m"}
