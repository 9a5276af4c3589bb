"""One coarseness of a track: the rows of ticks, or the two extremes of buckets of ticks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from haploop.view.store.ring import Ring


@dataclass
class Level:
    """So many values for so many ticks.

    Attributes:
        ring: the values.
        ticks, values: ticks of a bucket, and values of each column for them; ticks are counted from the track's origin.
    """

    ring: Ring
    ticks: int
    values: int

    @property
    def start(self) -> int:
        """The first tick that is held in whole."""
        return -(-self.ring.start // self.values) * self.ticks

    @property
    def end(self) -> int:
        """After the last tick that is held in whole."""
        return self.ring.end // self.values * self.ticks

    def between(self, from_tick: int, to_tick: int) -> np.ndarray:
        """Values between two ticks that are multiples of ``ticks``."""
        return self.ring.between(from_tick // self.ticks * self.values, to_tick // self.ticks * self.values)
