"""Changes that a controller of somebody else's was told of, held against what its blocks show."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby
from typing import Any

from haploop.protocol.changes import Change, Event, at_work, is_change, refused_change
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Scene
from haploop.protocol.transport.wire import Message


class CarriedOut:
    """Finds the swaps and sets that a controller did not carry out.

    A change begins a block, and the block shows it: the wall as it is from then on, the elements with their parameters.

    Attributes:
        tick: blocks before this one have been looked at.
        awaited: ticks of changes found refused, whose event has not come back from the clock.
    """

    def __init__(self, scene: Scene) -> None:
        self.tick = 0
        self.awaited: set[int] = set()
        self._scene = scene
        self._waiting: list[Change] = []
        self._blocks: list[Message] = []

    def add(self, block: Message) -> None:
        """Takes a block, to be looked at when all changes up to its end are known."""
        self._blocks.append({key: block[key] for key in ("from_tick", "ticks", "elements", "wall")})

    def note(self, tick: int, event: Event) -> None:
        """Takes an event of the clock; a change that the controller refused itself is waited for no more."""
        if is_change(event):
            self._waiting.append(Change.from_dict(tick, event))
        elif change := refused_change(event):
            self._waiting = [other for other in self._waiting if not other.is_as(change)]
            self.awaited.discard(change.tick)

    def judge(self, until: int) -> list[Change]:
        """Looks at the blocks before ``until``, up to where events are known; returns the changes not carried out."""
        refused: list[Change] = []
        while self._blocks and (end := self._blocks[0]["from_tick"] + self._blocks[0]["ticks"]) <= until:
            block, self.tick = self._blocks.pop(0), end
            due = [change for change in self._waiting if change.tick < end]
            self._waiting = self._waiting[len(due) :]
            for tick, group in groupby(due, key=lambda change: change.tick):
                refused += self._judge_tick(tick, list(group), block)
        self.awaited |= {change.tick for change in refused}
        return refused

    def _judge_tick(self, tick: int, changes: list[Change], block: Message) -> list[Change]:
        after = at_work(self._scene, changes)
        # The delay is the plant's: no block of the controller shows it.
        changes_nothing = (after.wall, after.dissipation) == (self._scene.wall, self._scene.dissipation)
        is_begun = block["from_tick"] == tick or changes_nothing
        made = [change for change in changes if is_begun and _shows(block, change, after)]
        self._scene = at_work(self._scene, made)
        return [replace(change, refused=_why(change)) for change in changes if change not in made]


def _why(change: Change) -> str:
    return (
        f"The change at tick {change.tick}, {change.describe()}, was refused: "
        "the controller's telemetry does not begin a block with it at that tick."
    )


def _shows(block: Message, change: Change, after: Scene) -> bool:
    """Tells whether a block shows what a change touches as it is in the scene after it."""
    elements, wall = block["elements"], block["wall"]
    if [element["kind"] for element in elements] != [element.name for element in after.dissipation]:
        return False
    touched: set[int] = set()
    for key in change.set:
        table, _, name = key.partition(".")
        if table == "wall" and (after.wall is None or wall.get(name) != value_at(after.wall, name)):
            return False
        if table == "dissipation":
            touched.add(int(name.partition(".")[0]))
    if change.swap is not None and change.element < len(elements):
        touched.add(change.element)
    return all(_is(elements[index]["parameters"], after.dissipation[index].parameters) for index in touched)


def _is(shown: dict[str, Any], wanted: dict[str, Any]) -> bool:
    return all(shown.get(name) == value for name, value in wanted.items())
