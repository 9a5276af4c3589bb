"""The last half second of many runs at once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from haploop.logger.books.buffers_batch import Row
from haploop.logger.verdict.measures import Span, look
from haploop.logger.verdict.verdict import SMALLEST_SWING_M, Extremes, Shown
from haploop.logger.verdict.window import CONTROLLER_COLUMNS, keep_steps
from haploop.protocol.ticks import Timebase

# Loops whose windows are laid out together: reading one loop alone out of a wide array is slow.
_TOGETHER = 32


class WindowArray:
    """Keeps what ``Window`` keeps of every loop, in rings that are written once.

    Args:
        resolutions_m: encoder step of each loop, 0 without one; a number, or shape (loops,).
        spare_ticks: ticks to be kept beyond the window.

    Attributes:
        kept_ticks: of them the window takes so many at most.
    """

    def __init__(self, time: Timebase, resolutions_m: float | np.ndarray, loops: int, *, spare_ticks: int = 0) -> None:
        self._time, n = time, time.steps_per_tick
        self.kept_ticks = min(keep_steps(time.plant_rate) // n + 2, time.ticks + 1)
        kept_ticks = self.kept_ticks + spare_ticks
        self._resolutions = np.broadcast_to(resolutions_m, loops)
        # The state at step s is in row s - 1, so that an interval, but for its start, lies in one piece.
        self._x = np.zeros((kept_ticks * n, loops))
        self._ticks = {name: np.zeros((kept_ticks, loops)) for name in CONTROLLER_COLUMNS}
        self._steps = 0
        self._x_min, self._x_max = np.full(loops, np.inf), np.full(loops, -np.inf)
        self._force_max = np.zeros(loops)

    def add(self, x: np.ndarray, held_N: np.ndarray, rows: Sequence[Row]) -> None:
        """Take the states of some intervals (end state included), the forces held and the controller's rows.

        Args:
            x: shape (ticks * n + 1, loops).
            held_N: of every hold, shape (holds, loops).
            rows: one a tick.
        """
        if not self._steps:
            self._x[-1] = x[0]
        ticks = self._steps // self._time.steps_per_tick
        _write(self._x, self._steps, x[1:])
        for tick, row in enumerate(rows, ticks):
            for name, ring in self._ticks.items():
                ring[tick % len(ring)] = row.columns[name]
        self._steps += len(x) - 1
        self._x_min = np.minimum(self._x_min, x.min(axis=0))
        self._x_max = np.maximum(self._x_max, x.max(axis=0))
        self._force_max = np.maximum(self._force_max, np.abs(held_N).max(axis=0))

    def shown(self, loops: Iterable[int]) -> Iterator[Shown]:
        """What each of these loops shows, as ``Window`` tells it of a loop that ran alone."""
        wanted = np.fromiter(loops, np.intp)
        n, rate, steps = self._time.steps_per_tick, self._time.plant_rate, self._steps
        span = Span.of(steps, keep_steps(rate), n)
        for first in range(0, len(wanted), _TOGETHER):
            some = wanted[first : first + _TOGETHER]
            swing_m = np.maximum(self._resolutions[some], SMALLEST_SWING_M)
            x = _read(self._x, steps + len(self._x), some)
            ticks = {name: _read(ring, steps // n, some) for name, ring in self._ticks.items()}
            seen = look(x, ticks, span, rate, swing_m)
            yield from map(Shown, seen, self._extremes_of(some), swing_m.tolist())

    def _extremes_of(self, loops: np.ndarray) -> Iterator[Extremes]:
        columns = (of[loops].tolist() for of in (self._x_min, self._x_max, self._force_max))
        return map(Extremes, *columns)


def _write(ring: np.ndarray, at: int, rows: np.ndarray) -> None:
    """Put row ``at`` and those after it into a ring, in which row i lies at i modulo its length."""
    skipped = max(0, len(rows) - len(ring))
    rows, at = rows[skipped:], (at + skipped) % len(ring)
    before_wrap = min(len(rows), len(ring) - at)
    ring[at : at + before_wrap] = rows[:before_wrap]
    ring[: len(rows) - before_wrap] = rows[before_wrap:]


def _read(ring: np.ndarray, end: int, loops: np.ndarray) -> np.ndarray:
    """The rows before ``end`` that a ring still holds, oldest first, of some loops; shape (loops, rows)."""
    count = min(end, len(ring))
    first = (end - count) % len(ring)
    wanted = slice(loops[0], loops[-1] + 1) if loops[-1] - loops[0] == len(loops) - 1 else loops
    rows = np.concatenate([ring[first : first + count, wanted], ring[: max(0, first + count - len(ring)), wanted]])
    return np.ascontiguousarray(rows.T)
