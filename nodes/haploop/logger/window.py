"""The last half second of a run: does the device rest, swing, or stay away from the wall?"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from haploop.logger.window_look import CROSSINGS, Seen, Span, look

WINDOW_S = 0.5
# Below this, swinging is no limit cycle whatever the encoder: a thousandth of what a wall of 1 N/mm gives way to 1 N.
SMALLEST_SWING_M = 1e-6
CONTROLLER_COLUMNS = ("x", "total", "in_contact", "wall_position")


@dataclass(frozen=True)
class Verdict:
    """One word and the rule that gave it."""

    word: str
    rule: str


class Extremes(NamedTuple):
    """Of a whole run: least and greatest position in m, greatest force in N."""

    x_min_m: float
    x_max_m: float
    force_max_N: float


def keep_steps(plant_rate: int) -> int:
    """The plant steps a window covers."""
    return math.ceil(WINDOW_S * plant_rate)


class Window:
    """Keeps what the last ``WINDOW_S`` seconds (or the second half of a shorter run) need to be judged.

    Args:
        resolution_m: encoder step, 0 without one; swings within one step either way do not count.
    """

    def __init__(self, plant_rate: int, steps_per_tick: int, resolution_m: float) -> None:
        self._rate, self._steps_per_tick = plant_rate, steps_per_tick
        self._keep_steps = keep_steps(plant_rate)
        self.swing_m = max(resolution_m, SMALLEST_SWING_M)
        self._x = np.zeros(0)
        self._ticks = {name: np.zeros(0) for name in CONTROLLER_COLUMNS}
        self._steps = 0
        self._seen: tuple[int, Seen] = -1, Seen(False, 0, 0.0, {})
        self.x_min_m, self.x_max_m, self.force_max_N = math.inf, -math.inf, 0.0

    def add(self, x: np.ndarray, force: np.ndarray, rows: dict[str, np.ndarray]) -> None:
        """Take the states of some intervals (end state included), the forces held and the controller's rows."""
        kept = self._x if len(self._x) else x[:1]
        self._x = np.concatenate([kept, x[1:]])[-self._keep_steps - 1 :]
        keep_ticks = self._keep_steps // self._steps_per_tick + 1
        self._ticks = {name: np.concatenate([self._ticks[name], rows[name]])[-keep_ticks:] for name in self._ticks}
        self._steps += len(x) - 1
        self.x_min_m = min(self.x_min_m, float(x.min()))
        self.x_max_m = max(self.x_max_m, float(x.max()))
        self.force_max_N = max(self.force_max_N, float(np.abs(force).max(initial=0.0)))

    def judged(self, steps: int, seen: Seen, extremes: Extremes) -> Window:
        """This window after so many steps of a run of which others kept this."""
        self._steps, self._seen = steps, (steps, seen)
        self.x_min_m, self.x_max_m, self.force_max_N = extremes
        return self

    def _look(self) -> Seen:
        """What the window shows, found once."""
        if self._seen[0] != self._steps:
            span = Span.of(self._steps, self._keep_steps, self._steps_per_tick)
            x, rows = self._x[None], {name: column[None] for name, column in self._ticks.items()}
            self._seen = self._steps, look(x, rows, span, self._rate, np.array([self.swing_m]))[0]
        return self._seen[1]

    def figures(self) -> dict[str, Any]:
        """The ``window`` entry of the summary.

        The displayed stiffness is the mean of total force over penetration, ticks in contact (Choi et al. 2022, V.B.2);
        ticks whose penetration is a rounding error of the wall's position are left out of it. ``growth_1_s`` is the
        r of e^(r t) by which the swings grow (decay where negative); null where nothing swings.
        """
        return self._look().figures

    def verdict(self, diverged: str | None) -> Verdict:
        """Judge the window; ``diverged`` is why the plant ended by itself, if it did."""
        if diverged:
            return Verdict("diverged", f"{diverged}.")
        seen = self._look()
        if not seen.touched:
            return Verdict(
                "no-contact", f"No tick of the last {WINDOW_S:g} s (second half of a shorter run) was in contact."
            )
        rule = (
            f"In the last {WINDOW_S:g} s (second half of a shorter run) x crossed its trend line {seen.crossings} "
            f"times by more than {self.swing_m * 1e6:.3g} um, its second half {seen.growth:.2f} times as wide as its "
            f"first; a limit cycle is at least {CROSSINGS} crossings and 0.5 times."
        )
        return Verdict("limit-cycle" if seen.crossings >= CROSSINGS and seen.growth >= 0.5 else "steady", rule)
