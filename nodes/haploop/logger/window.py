"""The last half second of a run: does the device rest, swing, or stay away from the wall?"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

WINDOW_S = 0.5
# Below this, swinging is no limit cycle whatever the encoder: a thousandth of what a wall of 1 N/mm gives way to 1 N.
SMALLEST_SWING_M = 1e-6
CROSSINGS = 4
# A quantised position on the wall's face may lie inside by this much, relative to the face's position.
ROUNDING = 1e-12
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
        self._swung: tuple[int, tuple[int, float]] = -1, (0, 0.0)
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

    def filled(self, x: np.ndarray, rows: dict[str, np.ndarray], steps: int, extremes: Extremes) -> Window:
        """This window with what another kept of a run: x and the controller's rows to its end, after so many steps."""
        self._x, self._ticks, self._steps = x, rows, steps
        self.x_min_m, self.x_max_m, self.force_max_N = extremes
        return self

    def _last(self) -> tuple[np.ndarray, dict[str, np.ndarray], int]:
        """x at the plant steps of the window, controller columns at its ticks, and its first step."""
        steps = min(self._keep_steps, self._steps if self._steps >= self._keep_steps else self._steps // 2)
        first = self._steps - steps
        ticks = self._steps // self._steps_per_tick + bool(self._steps % self._steps_per_tick)
        ticks -= -(-first // self._steps_per_tick)
        rows = {name: column[len(column) - ticks :] for name, column in self._ticks.items()}
        return self._x[-steps - 1 :], rows, first

    def _swings(self) -> tuple[int, float]:
        """``swings`` of the window, found once."""
        if self._swung[0] != self._steps:
            self._swung = self._steps, swings(self._last()[0], self.swing_m)
        return self._swung[1]

    def figures(self) -> dict[str, Any]:
        """The ``window`` entry of the summary.

        The displayed stiffness is the mean of total force over penetration, ticks in contact (Choi et al. 2022, V.B.2);
        ticks whose penetration is a rounding error of the wall's position are left out of it. ``growth_1_s`` is the
        r of e^(r t) by which the swings grow (decay where negative); null where nothing swings.
        """
        x, rows, first = self._last()
        crossings, growth = self._swings()
        inside = rows["in_contact"] > 0
        depth = rows["wall_position"][inside] - rows["x"][inside]
        real = np.abs(depth) > ROUNDING * np.abs(rows["wall_position"][inside])
        stiffness = rows["total"][inside][real] / depth[real]
        return {
            "from_s": first / self._rate,
            "oscillation_m": float(np.ptp(x)) if len(x) else 0.0,
            "growth_1_s": _rate(growth, len(x) / self._rate) if crossings >= CROSSINGS else None,
            "outside_fraction": float(np.mean(~inside)) if len(inside) else 1.0,
            "displayed_stiffness_N_m": float(np.mean(stiffness)) if len(stiffness) else None,
            "penetration_mean_m": float(np.mean(np.abs(depth))) if len(depth) else None,
        }

    def verdict(self, diverged: str | None) -> Verdict:
        """Judge the window; ``diverged`` is why the plant ended by itself, if it did."""
        if diverged:
            return Verdict("diverged", f"{diverged}.")
        _, rows, _ = self._last()
        if not rows["in_contact"].any():
            return Verdict(
                "no-contact", f"No tick of the last {WINDOW_S:g} s (second half of a shorter run) was in contact."
            )
        crossings, growth = self._swings()
        seen = (
            f"In the last {WINDOW_S:g} s (second half of a shorter run) x crossed its trend line {crossings} times "
            f"by more than {self.swing_m * 1e6:.3g} um, its second half {growth:.2f} times as wide as its first; "
            f"a limit cycle is at least {CROSSINGS} crossings and 0.5 times."
        )
        return Verdict("limit-cycle" if crossings >= CROSSINGS and growth >= 0.5 else "steady", seen)


def _rate(growth: float, seconds: float) -> float | None:
    """r in 1/s if what is ``growth`` times as wide in the second half of ``seconds`` follows e^(r t)."""
    return 2.0 * math.log(growth) / seconds if growth > 0.0 else None


@lru_cache(maxsize=4)
def _centred(count: int) -> tuple[np.ndarray, float]:
    """So many equal steps around 0, and the sum of their squares."""
    t = np.arange(count) - (count - 1) / 2.0
    return t, np.dot(t, t)


def swings(x: np.ndarray, swing_m: float) -> tuple[int, float]:
    """How often x swings across its straight trend by more than ``swing_m`` on either side, and how the width grows.

    Args:
        x: positions at equal steps, m.
        swing_m: a crossing counts only from beyond +swing_m to beyond -swing_m or back.

    Returns:
        (crossings, peak to peak of the second half over that of the first; 0 for no width at all).
    """
    if len(x) < 4:
        return 0, 0.0
    t, square = _centred(len(x))
    offset = x - x.mean()
    offset = offset - t * (np.dot(t, offset) / square)
    is_above = offset[np.abs(offset) > swing_m] > 0.0
    first, second = np.ptp(offset[: len(x) // 2]), np.ptp(offset[len(x) // 2 :])
    return int(np.count_nonzero(is_above[1:] != is_above[:-1])), float(second / first) if first > 0 else 0.0
