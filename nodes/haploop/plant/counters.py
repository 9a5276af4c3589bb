"""How often something happened, step by step."""

from __future__ import annotations

import numpy as np

# What is counted: the columns of the plant's telemetry, each named by its place in the summary.
DROPPED, LOST = "lost.commands_dropped", "lost.commands_lost"
SATURATED = "actuator.saturated_commands"
CLIPPED = "accelerometer.clipped_ticks"
TALLIES = (DROPPED, LOST, SATURATED, CLIPPED)


class Tally:
    """Counts what happens at plant steps, noted in any order and possibly before the plant gets there.

    What is counted so depends on the steps done alone, not on how far ahead commands or samples have come.

    Attributes:
        note: takes the step of something that happens.
    """

    def __init__(self) -> None:
        self._steps: list[int] = []
        self._before = 0
        self.note = self._steps.append

    def column(self, first: int, end: int) -> np.ndarray:
        """How often it happened before each of the steps first ... end; forgets what lies before ``end``.

        Returns:
            Shape (end - first + 1,), float64.
        """
        steps = np.sort(np.array(self._steps, np.int64))
        counts = self._before + np.searchsorted(steps, np.arange(first, end + 1))
        self._before = int(counts[-1])
        self._steps[:] = [step for step in self._steps if step >= end]
        return counts.astype(float)
