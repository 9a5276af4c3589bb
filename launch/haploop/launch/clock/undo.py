"""Changes that commands have made to a run, with what takes each of them back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from haploop.launch.clock.reloads import Code
from haploop.protocol.changes import Event, refused_change


class Made(NamedTuple):
    """A change that a command made, the one that takes it back (None if none can), and the code before a reload."""

    tick: int
    event: Event
    back: Event | None
    code: Code | None = None


class MadeChanges:
    """The changes that can still be taken back, the last one first."""

    def __init__(self) -> None:
        self._made: list[Made] = []
        self._heard: list[Event] = []

    def __bool__(self) -> bool:
        return bool(self._made)

    @property
    def last(self) -> Made:
        return self._made[-1]

    def add(self, made: Made) -> None:
        self._made.append(made)

    def forget(self, *events: Event) -> None:
        """Forgets changes, given by their events: nothing is left of them to take back."""
        self._made = [each for each in self._made if not any(each.event is event for event in events)]

    def forget_taken_back(self, events: Sequence[tuple[int, Event]]) -> None:
        """Forgets swaps without a new file that were taken back, by the events of the run, since this was last asked.

        What is on record names the element that has returned, which the last swap in its place had replaced.
        """
        for _, event in events:
            if "restored" not in event or any(event is one for one in self._heard):
                continue
            self._heard.append(event)
            back = refused_change(event)
            if back and "code" not in event:
                swaps = [each for each in self._made if "swap" in each.event and each.tick < back.tick]
                self.forget(*[each.event for each in swaps if each.event["element"] == back.element][-1:])
