"""The last half second of one run, or of every member of a batch."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from haploop.logger.verdict.measures import (
    SMALLEST_SWING_M,
    WINDOW_S,
    Extremes,
    RunMeasures,
    measure_window,
    window_span,
)
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_select

CONTROLLER_COLUMNS = ("x", "total", "in_contact", "wall_position")
# Members whose windows are laid out together: reading one member alone out of a wide array is slow.
TOGETHER = 32


def keep_steps(plant_rate: int) -> int:
    return math.ceil(WINDOW_S * plant_rate)


class WindowState(NamedTuple):
    """The complete state of a window. A ring has row i in place i modulo its length.

    Attributes:
        x: ring of positions at the steps, m, shape (ticks kept * n, members). The state at step s is row s - 1, so that
            an interval, except for its start, lies in one piece.
        rows: rings of ``CONTROLLER_COLUMNS`` at the ticks, shape (ticks kept, members) each.
        x_min_m, x_max_m, force_max_N: extremes of the whole run, shape (members,).
    """

    steps: int
    x: np.ndarray
    rows: dict[str, np.ndarray]
    x_min_m: np.ndarray
    x_max_m: np.ndarray
    force_max_N: np.ndarray


class Window:
    """Keeps what the last ``WINDOW_S`` seconds (or the second half of a shorter run) need to be judged."""

    def __init__(
        self, time: Timebase, resolution_m: float | np.ndarray, members: int = 1, *, spare_ticks: int = 0
    ) -> None:
        """Makes the window of one run or of the members of a batch, with room for some ticks beyond it.

        Swings within an encoder step ``resolution_m`` (a number or shape (members,), 0 without) do not count.
        """
        self._time, n = time, time.steps_per_tick
        self.kept_ticks = min(keep_steps(time.plant_rate) // n + 2, time.ticks + 1)
        kept_ticks = self.kept_ticks + spare_ticks
        self.swing_m = np.maximum(np.broadcast_to(resolution_m, members), SMALLEST_SWING_M)
        self.state = WindowState(
            0,
            np.zeros((kept_ticks * n, members)),
            {name: np.zeros((kept_ticks, members)) for name in CONTROLLER_COLUMNS},
            np.full(members, np.inf),
            np.full(members, -np.inf),
            np.zeros(members),
        )

    def add(self, x: np.ndarray, held_N: np.ndarray, rows: dict[str, np.ndarray]) -> None:
        """Takes the next intervals.

        Args:
            x: positions at the steps and at the end, shape (ticks * n + 1, members), m.
            held_N: force of every hold, or of every step, shape (holds, members), N.
            rows: ``CONTROLLER_COLUMNS`` at the ticks, shape (ticks, members) each.
        """
        s = self.state
        if not s.steps:
            s.x[-1] = x[0]
        _write(s.x, s.steps, x[1:])
        for name, ring in s.rows.items():
            _write(ring, s.steps // self._time.steps_per_tick, rows[name])
        self.state = s._replace(
            steps=s.steps + len(x) - 1,
            x_min_m=np.fmin(s.x_min_m, x.min(axis=0)),
            x_max_m=np.fmax(s.x_max_m, x.max(axis=0)),
            force_max_N=np.fmax(s.force_max_N, np.abs(held_N).max(axis=0, initial=0.0)),
        )

    def measures(self, places: Iterable[int] = (0,)) -> Iterator[RunMeasures]:
        """Yields the measures of the members at these places, each computed as if it were alone."""
        wanted = np.fromiter(places, np.intp)
        n, rate, s = self._time.steps_per_tick, self._time.plant_rate, self.state
        span = window_span(s.steps, keep_steps(rate), n)
        for first in range(0, len(wanted), TOGETHER):
            some = wanted[first : first + TOGETHER]
            x = last_rows(s.x, s.steps + len(s.x), some)
            rows = {name: last_rows(ring, s.steps // n, some) for name, ring in s.rows.items()}
            swing_m = self.swing_m[some]
            windows = measure_window(x, rows, span, rate, self._time.control_rate, swing_m)
            yield from map(RunMeasures, windows, self.extremes(some), swing_m.tolist())

    def contacts(self, places: np.ndarray) -> np.ndarray:
        """Returns whether each tick of the window was in contact, shape (places, ticks)."""
        n, rows = self._time.steps_per_tick, self.state.rows["in_contact"]
        ticks = window_span(self.state.steps, keep_steps(self._time.plant_rate), n).ticks
        some = last_rows(rows, self.state.steps // n, places)
        return some[:, some.shape[1] - ticks :] > 0.0

    def extremes(self, places: np.ndarray) -> Iterator[Extremes]:
        s = self.state
        return map(Extremes, *(of[places].tolist() for of in (s.x_min_m, s.x_max_m, s.force_max_N)))

    def select(self, kept: np.ndarray) -> None:
        """Drops members of a batch: those for which ``kept``, shape (members,), is false."""
        self.state, self.swing_m = tree_select((self.state, self.swing_m), kept)


def _write(ring: np.ndarray, at: int, rows: np.ndarray) -> None:
    """Puts row ``at`` and those after it into a ring, in which row i lies at i modulo its length."""
    skipped = max(0, len(rows) - len(ring))
    rows, at = rows[skipped:], (at + skipped) % len(ring)
    before_wrap = min(len(rows), len(ring) - at)
    ring[at : at + before_wrap] = rows[:before_wrap]
    if before_wrap < len(rows):
        ring[: len(rows) - before_wrap] = rows[before_wrap:]


def last_rows(ring: np.ndarray, end: int, places: np.ndarray) -> np.ndarray:
    """Returns the rows before ``end`` that a ring still holds, oldest first, of some members; shape (members, rows)."""
    count = min(end, len(ring))
    first = (end - count) % len(ring)
    wanted = slice(places[0], places[-1] + 1) if places[-1] - places[0] == len(places) - 1 else places
    rows = np.concatenate([ring[first : first + count, wanted], ring[: max(0, first + count - len(ring)), wanted]])
    return np.ascontiguousarray(rows.T)
