"""One level of detail of a series: a ring buffer of rows, or of the two extremes of buckets of ticks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Shorter groups are processed place by place, each contiguous in memory: several times as fast as group by group.
_LONG_GROUP = 96


def extremes(values: np.ndarray, group: int) -> np.ndarray:
    """Returns the least and the greatest of every ``group`` consecutive values, the least first where the values rise.

    They rise unless the last is less than the first: so the two are in the order in which they occurred wherever the
    values turn once at most. A line through the result covers the same band as one through all values, and the extremes
    of such extremes are those of the values themselves, so decimation can be repeated. NaN is ignored.

    Args:
        values: shape (columns, count), ``count`` a multiple of ``group``.

    Returns:
        Shape (columns, 2 * count / group); NaN where a group holds nothing else.
    """
    columns, count = values.shape
    places = values.reshape(columns, count // group, group).transpose(2, 0, 1)
    if group < _LONG_GROUP:
        places = np.ascontiguousarray(places)
    least, greatest, falls = np.fmin.reduce(places), np.fmax.reduce(places), places[-1] < places[0]
    pairs = np.empty((columns, count // group, 2))
    pairs[..., 0] = np.where(falls, greatest, least)
    pairs[..., 1] = np.where(falls, least, greatest)
    return pairs.reshape(columns, 2 * (count // group))


class Ring:
    """Holds at least the newest ``capacity`` values of each of several columns.

    There is room for twice as many: when it is full, the newest half moves to the front, so that requested values are
    always contiguous in memory and a value is moved once at most, on average.

    Attributes:
        start, end: numbers of the first value held and of the one after the last; the first ever appended has number 0.
    """

    def __init__(self, capacity: int, columns: int) -> None:
        """Makes an empty ring with ``columns`` columns at first."""
        self._values = np.full((columns, 2 * capacity), np.nan)
        self.capacity = capacity
        self.start = self.end = 0

    @property
    def nbytes(self) -> int:
        return self._values.nbytes

    def append(self, values: np.ndarray) -> None:
        """Appends values of shape (columns, count), ``count`` at most the capacity."""
        self.extend(values.shape[1])[:] = values

    def extend(self, count: int) -> np.ndarray:
        """Returns room for ``count`` more values, at most the capacity, (columns, count), which the caller fills."""
        used = self.end - self.start
        if used + count > self._values.shape[1]:
            for column in self._values:  # one by one they are moved in place; all at once would need a copy
                column[: self.capacity] = column[used - self.capacity : used]
            self.start, used = self.end - self.capacity, self.capacity
        self.end += count
        return self._values[:, used : used + count]

    def between(self, first: int, end: int) -> np.ndarray:
        """Returns a view of the values from number ``first`` to before ``end``, as far as held, (columns, count)."""
        first, end = max(first, self.start), min(end, self.end)
        return self._values[:, first - self.start : max(first, end) - self.start]

    def forget(self, number: int) -> None:
        """Forgets the values before this number."""
        if number > self.start:
            self._values[:, : self.end - number] = self._values[:, number - self.start : self.end - self.start].copy()
            self.start = number

    def grow(self, columns: int) -> None:
        """Adds columns up to this number; their values so far are NaN."""
        more = np.full((columns - len(self._values), self._values.shape[1]), np.nan)
        self._values = np.concatenate([self._values, more])

    def clear(self, column: int) -> None:
        self._values[column] = np.nan


@dataclass
class LodLevel:
    """A ring buffer with its scale: ``values`` values of each column per ``ticks`` ticks, from the origin on."""

    ring: Ring
    ticks: int
    values: int

    @property
    def start(self) -> int:
        return -(-self.ring.start // self.values) * self.ticks

    @property
    def end(self) -> int:
        return self.ring.end // self.values * self.ticks

    def between(self, from_tick: int, to_tick: int) -> np.ndarray:
        """Returns the values between two ticks that are multiples of ``ticks``."""
        return self.ring.between(from_tick // self.ticks * self.values, to_tick // self.ticks * self.values)
