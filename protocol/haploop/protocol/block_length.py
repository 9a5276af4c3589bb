"""The number of ticks in one block of telemetry, adapted to the speed of the run."""

from __future__ import annotations

import time

# A block that takes no longer than this is never far behind what a viewer shows or a killed run leaves in its log.
AT_MOST_S = 0.1
_FIRST_TICKS = 100


class BlockLength:
    """Adapts the length of blocks so that each takes 0.05 to 0.1 s of wall time, up to the scene's ``block_ticks``.

    No bit of a run depends on it.
    """

    def __init__(self, most_ticks: int) -> None:
        self._most = most_ticks
        self.ticks = min(most_ticks, _FIRST_TICKS)
        self._began = time.perf_counter()

    def next(self) -> None:
        """Ends a block; doubles the length after a fast one, halves it after a slow one."""
        now = time.perf_counter()
        took_s, self._began = now - self._began, now
        if took_s < AT_MOST_S / 2:
            self.ticks = min(2 * self.ticks, self._most)
        elif took_s > AT_MOST_S:
            self.ticks = max(self.ticks // 2, 1)
