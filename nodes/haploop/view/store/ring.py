"""The newest values of several columns, side by side in one array that is never made anew."""

from __future__ import annotations

import numpy as np


class Ring:
    """At least the newest ``capacity`` values of each column.

    There is room for twice as many: when it is full, the newest half moves to the front, so that what is asked for is
    always one piece of memory and a value is moved once at most, on average.

    Args:
        capacity: values of each column that are surely held.
        columns: how many columns there are at first.

    Attributes:
        start, end: numbers of the first value held and of the one after the last; the first ever appended has number 0.
    """

    def __init__(self, capacity: int, columns: int) -> None:
        self._values = np.full((columns, 2 * capacity), np.nan)
        self.capacity = capacity
        self.start = self.end = 0

    def append(self, values: np.ndarray) -> None:
        """Take the next values, shape (columns, count), ``count`` at most the capacity."""
        count, used = values.shape[1], self.end - self.start
        if used + count > self._values.shape[1]:
            self._values[:, : self.capacity] = self._values[:, used - self.capacity : used]
            self.start, used = self.end - self.capacity, self.capacity
        self._values[:, used : used + count] = values
        self.end += count

    def between(self, first: int, end: int) -> np.ndarray:
        """The values from number ``first`` to before ``end``, as far as they are held; a view, (columns, count)."""
        first, end = max(first, self.start), min(end, self.end)
        return self._values[:, first - self.start : max(first, end) - self.start]

    def grow(self, columns: int) -> None:
        """Have so many columns; what the new ones were so far is not known, NaN."""
        more = np.full((columns - len(self._values), self._values.shape[1]), np.nan)
        self._values = np.concatenate([self._values, more])

    def forget(self, column: int) -> None:
        """No longer know what a column was."""
        self._values[column] = np.nan
