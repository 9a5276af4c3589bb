"""The history of the wall and of every element, from the scene and the events of a run."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from haploop.protocol.changes import changes_of, spans


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
        self.walls: list[WallSpan] = []
        self.into_wall = 1.0 if scene.get("wall", {}).get("occupies") == "above" else -1.0
        self.elements: list[ElementSpan] = []
        changes = changes_of((int(event.get("tick", 0)), event) for event in events)
        before: list[tuple[dict[str, Any], ElementSpan]] = []
        for span in spans(scene, (single for change in changes for single in change.singly())):
            if wall := span.scene.get("wall"):
                self._note_wall(WallSpan(span.from_tick, wall["position"], wall["stiffness"]))
            before = self._note_elements(span.scene.get("dissipation", []), before, span.from_tick)
        # What was replaced in the tick of its coming has no book.
        self.elements = [span for span in self.elements if span.to_tick > span.from_tick]
        for number, span in enumerate(self.elements):
            same = sum(before.kind == span.kind for before in self.elements[:number])
            span.name = f"{span.kind}-{same + 1}" if same else span.kind

    def _note_wall(self, wall: WallSpan) -> None:
        if not self.walls or replace(self.walls[-1], from_tick=wall.from_tick) != wall:
            self.walls.append(wall)

    def _note_elements(
        self, tables: list[dict[str, Any]], before: list[tuple[dict[str, Any], ElementSpan]], tick: int
    ) -> list[tuple[dict[str, Any], ElementSpan]]:
        """Ends the spans of elements that are gone, begins those of new ones, and follows all that change places."""
        known = {id(table): span for table, span in before}
        for table, span in before:
            if not any(table is other for other in tables):
                span.to_tick = tick
        for place, (_, span) in enumerate(before):
            if place >= len(tables) or known.get(id(tables[place])) is not span:
                span.slots[-1] = (*span.slots[-1][:2], tick)
        now = []
        for place, table in enumerate(tables):
            span = known.get(id(table))
            if span is None:
                parameters = {name: value for name, value in table.items() if name != "kind"}
                span = ElementSpan(table["kind"], table["kind"], parameters, [], tick)
                self.elements.append(span)
            if place >= len(before) or before[place][1] is not span:
                span.slots.append((place, tick, math.inf))
            now.append((table, span))
        return now
