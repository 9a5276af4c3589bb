"""The books of a recording over time, for a figure."""

from __future__ import annotations

import numpy as np

from haploop.tools.dissipate.booking import Booked
from haploop.tools.dissipate.recording.samples import Floats
from haploop.view.store.lod_level import extremes

# Points above which the trace is decimated.
_MOST = 8192
# Length of the detail, s.
_CLOSE_S = 0.1


class Trace:
    """Keeps the books of a recording of any length in bounded memory, decimated with their extremes kept.

    Args:
        rows: number of rows of ``lines``: t, x, sampled and true books of every element, rows of a recorded force.

    Attributes:
        close: the interval in which most energy was given back, undecimated, with rows like those of ``lines``; None
            before any was given back.
    """

    def __init__(self, period_s: float, rows: int) -> None:
        self._span = max(8, round(_CLOSE_S / period_s))
        self._group, self._points, self._left = 1, np.empty((rows, 0)), np.empty((rows, 0))
        self._open = np.empty((rows + 1, 0))
        self._most_given_J = 0.0
        self.close: Floats | None = None

    def add(self, booked: Booked) -> None:
        rows = np.vstack([booked.t_s, booked.x_m, booked.sampled_J, booked.true_J, *(booked.force or ())])
        self._keep(rows)
        self._look_closely(np.vstack([rows, -np.minimum(booked.added_J, 0.0).sum(axis=0)]))

    def lines(self) -> Floats:
        """Returns the rows over the whole recording; shape (rows, points)."""
        return np.hstack([self._points, self._left])

    def _keep(self, rows: Floats) -> None:
        left = np.hstack([self._left, rows])
        whole = left.shape[1] - left.shape[1] % self._group
        done = left[:, :whole] if self._group == 1 else extremes(left[:, :whole], self._group)
        self._left, self._points = left[:, whole:], np.hstack([self._points, done])
        while self._points.shape[1] > _MOST:
            # The newest points, which do not make up a group of four, stay unchanged.
            usable = self._points.shape[1] // 4 * 4
            self._points = np.hstack([extremes(self._points[:, :usable], 4), self._points[:, usable:]])
            self._group = max(4, 2 * self._group)

    def _look_closely(self, tagged: Floats) -> None:
        """Compares intervals of equal length that overlap by half, by the energy given back in them (the last row)."""
        waiting = np.hstack([self._open, tagged])
        while waiting.shape[1] >= self._span:
            self._consider(waiting[:, : self._span])
            waiting = waiting[:, self._span // 2 :]
        self._open = waiting
        if self.close is None and waiting.shape[1]:
            self._consider(waiting)

    def _consider(self, stretch: Floats) -> None:
        given = float(stretch[-1].sum())
        if given > self._most_given_J:
            self._most_given_J, self.close = given, stretch[:-1].copy()
