"""The last half second of a run."""

from __future__ import annotations

import math

import numpy as np

from haploop.logger.verdict.measures import WINDOW_S, Seen, Span, look
from haploop.logger.verdict.verdict import SMALLEST_SWING_M, Extremes, Shown

CONTROLLER_COLUMNS = ("x", "total", "in_contact", "wall_position")


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

    def _look(self) -> Seen:
        """What the window shows, found once."""
        if self._seen[0] != self._steps:
            span = Span.of(self._steps, self._keep_steps, self._steps_per_tick)
            x, rows = self._x[None], {name: column[None] for name, column in self._ticks.items()}
            self._seen = self._steps, look(x, rows, span, self._rate, np.array([self.swing_m]))[0]
        return self._seen[1]

    def shown(self) -> Shown:
        """What it and the whole run show."""
        return Shown(self._look(), Extremes(self.x_min_m, self.x_max_m, self.force_max_N), self.swing_m)
