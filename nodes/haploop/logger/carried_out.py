"""Changes that a foreign plant or controller was told of, compared with what its blocks show."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace
from itertools import groupby
from typing import Any

import numpy as np

from haploop.logger.books.buffers import as_float64
from haploop.logger.log.table import Floats
from haploop.protocol.changes import Change, Event, at_work, is_change, refused_change
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import DELAY, Timebase
from haploop.protocol.transport.node import NodeError
from haploop.protocol.transport.wire import Message

_NO_DELAY = (
    "The change at tick {}, {}, was refused: in the plant's telemetry, the command of that tick does not take effect "
    "at the step that follows from this delay."
)


class CarriedOut:
    """Finds the swaps and sets that a controller did not carry out, and the delays that a plant did not.

    A change begins a new block of the controller, which shows it: the wall from then on, and the elements with their
    parameters. A delay shows in the plant's column ``command``: the command of the change's tick acts that much later.

    Args:
        foreign: the roles taken by foreign programs.

    Attributes:
        awaited: ticks of changes found refused, whose event has not yet come back from the clock.
    """

    def __init__(self, scene: Scene, time: Timebase, foreign: Collection[str] = ("plant", "controller")) -> None:
        self.awaited: set[int] = set()
        self._scene, self._of_controller = scene, "controller" in foreign
        self._waiting: list[Change] = []
        self._blocks: list[Message] = []
        self._looked = 0
        # With jitter or loss, commands act at other steps than the delay gives.
        is_told = "plant" in foreign and not (scene.jitter or scene.loss)
        self._delays = Delays(time, time.window_ticks(scene.run) // 2) if is_told else None

    @property
    def tick(self) -> int | float:
        """The tick up to which blocks have been looked at; infinite where there is nothing to look at."""
        of_plant = self._delays.tick if self._delays else math.inf
        return min(self._looked if self._of_controller else math.inf, of_plant)

    def add(self, block: Message) -> None:
        """Takes a controller's block, to be looked at when all changes up to its end are known."""
        if self._of_controller:
            self._blocks.append({key: block[key] for key in ("from_tick", "ticks", "elements", "wall")})

    def add_motion(self, block: Message) -> None:
        """Takes a plant's block, likewise."""
        if self._delays:
            self._delays.blocks.append((block["from_tick"], as_float64(block["columns"]["command"])[:-1]))

    def note(self, tick: int, event: Event) -> None:
        """Takes an event of the clock; a change that the controller itself refused is no longer waited for."""
        if is_change(event):
            self._waiting.append(Change.from_dict(tick, event))
            if self._delays and DELAY in self._waiting[-1].set:
                self._delays.waiting.append(self._waiting[-1])
        elif change := refused_change(event):
            self._waiting = [other for other in self._waiting if not other.is_as(change)]
            self.awaited.discard(change.tick)

    def judge(self, until: int) -> list[Change]:
        """Looks at the blocks before ``until``, up to where events are known; returns the changes not carried out."""
        refused = self._delays.judge(until) if self._delays else []
        while self._blocks and (end := self._blocks[0]["from_tick"] + self._blocks[0]["ticks"]) <= until:
            block, self._looked = self._blocks.pop(0), end
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


class Delays:
    """Finds the sets of the delay that a plant did not carry out.

    Args:
        most_held: for how many ticks, at most, the clock may be kept waiting for a change to be seen.
    """

    def __init__(self, time: Timebase, most_held: int) -> None:
        self._time, self._most_steps = time, most_held * time.steps_per_tick
        self.waiting: list[Change] = []
        self.blocks: list[tuple[int, Floats]] = []
        self._looked, self._held = 0, -1.0

    @property
    def tick(self) -> int:
        n = self._time.steps_per_tick
        held = (change.tick for change in self.waiting if self._acts_at(change) - change.tick * n <= self._most_steps)
        return min(self._looked, min(held, default=self._looked))

    def judge(self, until: int) -> list[Change]:
        refused: list[Change] = []
        n = self._time.steps_per_tick
        while self.blocks and (end := self.blocks[0][0] + len(self.blocks[0][1]) // n) <= until:
            (first, held), self._looked = self.blocks.pop(0), end
            acting = np.concatenate([[self._held], held])
            for change in [change for change in self.waiting if self._acts_at(change) < end * n]:
                place = self._acts_at(change) - first * n
                self.waiting.remove(change)
                is_seen = place >= 0 and all(self._acts_at(later) > self._acts_at(change) for later in self.waiting)
                if is_seen and not acting[place] < change.tick <= acting[place + 1]:
                    why = _NO_DELAY.format(change.tick, change.describe())
                    if len(change.set) > 1:
                        raise NodeError(f"{why} The rest of the change was made, so the run cannot continue.")
                    refused.append(replace(change, refused=why))
            self._held = held[-1]
        return refused

    def _acts_at(self, change: Change) -> int:
        """Returns the plant step at which the command of a change's tick acts with the delay that it sets."""
        return change.tick * self._time.steps_per_tick + round(change.set[DELAY] * self._time.plant_rate)


def _why(change: Change) -> str:
    return (
        f"The change at tick {change.tick}, {change.describe()}, was refused: "
        "the controller's telemetry does not begin a block with it at that tick."
    )


def _shows(block: Message, change: Change, after: Scene) -> bool:
    """Tells whether a block shows what a change touches in the same way as the scene after the change."""
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
