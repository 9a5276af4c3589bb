"""Changes that took effect in a run: a window that spans one shows two loops, neither of them for long enough."""

from __future__ import annotations

from haploop.protocol.changes import Change, Event, is_change, refused_change


class ChangesMade:
    """Keeps the swaps and sets of a run, less those that were refused."""

    def __init__(self) -> None:
        self._made: list[Change] = []

    def note(self, tick: int, event: Event) -> None:
        """Takes an event of the run, in the order of ticks; one that changes nothing is ignored."""
        if is_change(event):
            self._made.append(Change.from_dict(tick, event))
        elif (change := refused_change(event)) and "refused" in event:
            self._made = [made for made in self._made if not made.is_as(change)]
        elif change and "restored" in event:
            self._made.append(change)

    def last_within(self, first: float, end: int) -> int | None:
        """Returns the tick of the last change after tick ``first`` and before tick ``end``; None without one."""
        return max((made.tick for made in self._made if first < made.tick < end), default=None)
