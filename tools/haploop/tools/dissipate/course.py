"""How the books went, kept for a figure in memory that does not grow with the recording."""

from __future__ import annotations

import numpy as np

from haploop.tools.dissipate.booking import Booked
from haploop.tools.dissipate.samples import Floats
from haploop.view.store.lod_level import extremes

# A line is thinned out when it has so many points.
_MOST = 8192
# Length of the close view, s.
_CLOSE_S = 0.1


class Course:
    """All of it with its extremes kept, and in full the stretch in which most was given back.

    Attributes:
        close: the stretch, as rows like those of ``lines``; None before anything is given back.
    """

    def __init__(self, period_s: float) -> None:
        self._span = max(8, round(_CLOSE_S / period_s))
        self._group, self._points, self._left = 1, np.empty((0, 0)), np.empty((0, 0))
        self._open = np.empty((0, 0))
        self._most_given_J = 0.0
        self.close: Floats | None = None

    def add(self, booked: Booked) -> None:
        """Take the books at more samples."""
        rows = np.vstack([booked.t_s, booked.x_m, booked.sampled_J, booked.true_J])
        self._keep(rows)
        self._look_closely(rows, -np.minimum(booked.added_J, 0.0).sum(axis=0))

    def lines(self) -> Floats:
        """Rows t, x, the sampled and the true books of every element; shape (rows, points)."""
        return np.hstack([self._points, self._left]) if self._points.size else self._left

    def _keep(self, rows: Floats) -> None:
        left = np.hstack([self._left, rows]) if self._left.size else rows
        whole = left.shape[1] - left.shape[1] % self._group
        done = left[:, :whole] if self._group == 1 else extremes(left[:, :whole], self._group)
        self._left = left[:, whole:]
        self._points = np.hstack([self._points, done]) if self._points.size else done
        while self._points.shape[1] > _MOST:
            usable = self._points.shape[1] // 4 * 4
            thinned = extremes(self._points[:, :usable], 4)
            # What is left of a group of four are the newest points; they stay as they are.
            self._points = np.hstack([thinned, self._points[:, usable:]])
            self._group = max(4, 2 * self._group)

    def _look_closely(self, rows: Floats, given_J: Floats) -> None:
        """Compare stretches of equal length that overlap by half."""
        tagged = np.vstack([rows, given_J])
        waiting = np.hstack([self._open, tagged]) if self._open.size else tagged
        half = self._span // 2
        while waiting.shape[1] >= self._span:
            self._consider(waiting[:, : self._span])
            waiting = waiting[:, half:]
        self._open = waiting
        if self.close is None and waiting.shape[1]:
            self._consider(waiting)

    def _consider(self, stretch: Floats) -> None:
        given = float(stretch[-1].sum())
        if given > self._most_given_J:
            self._most_given_J, self.close = given, stretch[:-1].copy()
