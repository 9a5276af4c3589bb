"""Measures of a run, and the one word for it: does the device rest, swing, or stay away from the wall?"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from haploop.logger.verdict.measures import CROSSINGS, WINDOW_S, WindowMeasures

# Below this, swinging is no limit cycle whatever the encoder: a thousandth of what a wall of 1 N/mm gives way to 1 N.
SMALLEST_SWING_M = 1e-6


@dataclass(frozen=True)
class Verdict:
    """One word and the rule that gave it."""

    word: str
    rule: str


class Extremes(NamedTuple):
    """Extremes of a whole run: least and greatest position in m, greatest force in N."""

    x_min_m: float
    x_max_m: float
    force_max_N: float


class RunMeasures(NamedTuple):
    """Measures of a run so far.

    Attributes:
        window: of its window.
        extremes: of all of it.
        swing_m: what does not count as a swing.
    """

    window: WindowMeasures
    extremes: Extremes
    swing_m: float

    def is_finite(self) -> bool:
        """Tells whether every number is finite, and no sum of them is beyond what a float holds."""
        return math.isfinite(sum(self.extremes) + sum(filter(None, self.window.figures.values())))

    def verdict(self, diverged: str | None) -> Verdict:
        """Judges the run; ``diverged`` is why the plant ended by itself, if it did."""
        if diverged:
            return Verdict("diverged", f"{diverged}.")
        window = self.window
        if not window.touched:
            return Verdict(
                "no-contact", f"No tick of the last {WINDOW_S:g} s (second half of a shorter run) was in contact."
            )
        rule = (
            f"In the last {WINDOW_S:g} s (second half of a shorter run) x crossed its trend line {window.crossings} "
            f"times by more than {self.swing_m * 1e6:.3g} um, its second half {window.growth:.2f} times as wide as its "
            f"first; a limit cycle is at least {CROSSINGS} crossings and 0.5 times."
        )
        return Verdict("limit-cycle" if window.crossings >= CROSSINGS and window.growth >= 0.5 else "steady", rule)
