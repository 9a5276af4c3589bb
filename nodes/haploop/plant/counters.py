"""Counters of what happens to commands and readings."""

from __future__ import annotations

from typing import Any

import numpy as np

# What is counted: the columns of the plant's telemetry, each named by its place in the summary, with its meaning.
DROPPED, LOST = "lost.commands_dropped", "lost.commands_lost"
SATURATED = "actuator.saturated_commands"
CLIPPED = "accelerometer.clipped_ticks"
COUNTERS = {
    DROPPED: "commands that never acted, since a later one overtook them (jitter, or a delay made shorter)",
    LOST: "commands that the line lost, of those that would have acted within the run",
    SATURATED: "commands whose force the saturation of the actuator cut off; only in scenes with one",
    CLIPPED: "ticks at which the accelerometer's range cut its reading off; only in scenes with one",
}


class Counter:
    """Counter of events at plant steps, noted in any order and possibly before the plant gets there.

    The count thus depends on the steps done alone, not on how far ahead commands or samples have come.

    Attributes:
        state: (number of events before the end of the last column, steps of the others).
    """

    def __init__(self) -> None:
        self._steps: list[int] = []
        self._before = 0

    def note(self, step: int, happened: Any = True) -> None:
        """Counts an event at a step, if it happened."""
        if happened:
            self._steps.append(step)

    @property
    def state(self) -> Any:
        return self._before, tuple(self._steps)

    def restore(self, state: Any) -> None:
        self._before, self._steps = state[0], list(state[1])

    def column(self, first: int, end: int) -> np.ndarray:
        """Returns the number of events before each of the steps first ... end; forgets those before ``end``."""
        steps = np.sort(np.array(self._steps, np.int64))
        counts = self._before + np.searchsorted(steps, np.arange(first, end + 1))
        self._before = int(counts[-1])
        self._steps = [step for step in self._steps if step >= end]
        return counts.astype(float)

    def select(self, kept: np.ndarray) -> None:
        """Drops the members that are not kept, a mask of shape (members,); one run has none to drop."""


class BatchCounter(Counter):
    """Counter of the events of every member of a batch, whatever their steps; the state has shape (members,)."""

    def __init__(self, members: int) -> None:
        self._count: Any = np.zeros(members, np.int64)

    def note(self, step: int, happened: Any = True) -> None:
        """Counts an event for the members it happened to: a mask of shape (members,), or one truth value for all."""
        self._count = self._count + happened

    @property
    def state(self) -> Any:
        return self._count

    def restore(self, state: Any) -> None:
        self._count = state

    def select(self, kept: np.ndarray) -> None:
        self._count = self._count[kept]


def make_counter(members: int | None) -> Counter:
    return Counter() if members is None else BatchCounter(members)
