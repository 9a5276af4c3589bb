"""Swings that last but are no wider than a staircase of counts may be: whether they are a buzz cannot be said."""

from __future__ import annotations

from typing import NamedTuple

from haploop.logger.verdict.spectrum import Line
from haploop.tools.dissipate.swing.buzz import Band

# This many windows in a row, a quarter of a window apart, are a swing that lasts.
_LASTS = 5


class Hidden(NamedTuple):
    """A swing within the counts of the positions: frequency, Hz, width and count, m."""

    frequency_Hz: float
    width_m: float
    count_m: float


class HiddenFinder:
    """Looks for a swing within the counts that keeps its frequency as long as one that is reported.

    Attributes:
        found: the widest of them; None where there was none.
    """

    def __init__(self, band: Band) -> None:
        self._near_Hz, self._row = band.resolved_Hz, list[Hidden]()
        self.found: Hidden | None = None

    def look(self, line: Line, count_m: float) -> None:
        """Takes the swing of a window that is within the counts."""
        if self._row and abs(line.frequency_Hz - self._row[-1].frequency_Hz) >= self._near_Hz:
            self.end()
        self._row = [*self._row[1 - _LASTS :], Hidden(line.frequency_Hz, line.width, count_m)]
        widest = max(self._row, key=lambda each: each.width_m)
        if len(self._row) == _LASTS and (self.found is None or widest.width_m > self.found.width_m):
            self.found = widest

    def end(self) -> None:
        """Takes a window without such a swing, or a gap."""
        self._row = []
