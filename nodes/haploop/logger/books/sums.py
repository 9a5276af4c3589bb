"""Running sums that keep what rounding drops, and come out the same however the run is cut into blocks."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np


def sum_in_order(values: np.ndarray) -> np.ndarray:
    """Sum over the last axis, first to last, so that the order of addition never depends on memory layout.

    Args:
        values: shape (..., n), n >= 1.

    Returns:
        Shape (...).
    """
    total = values[..., 0].copy()
    for index in range(1, values.shape[-1]):
        total += values[..., index]
    return total


def sum_rows(rows: Iterable[np.ndarray]) -> np.ndarray:
    """Sum of at least one row, first to last, in every column by itself.

    Args:
        rows: shape (n,) each.

    Returns:
        Shape (n,).
    """
    first, *others = rows
    total = first.copy()
    for row in others:
        total += row
    return total


def by_tick(flow: Any, steps_per_tick: int, first: int = 0, end: int | None = None) -> Any:
    """Sum over the steps of each tick, or over those from ``first`` on before ``end``, in their order.

    Args:
        flow: what is added at each step, shape (ticks * n,), or (ticks * n, loops).

    Returns:
        Shape (ticks,), or (ticks, loops).
    """
    total = flow[first::steps_per_tick].copy()
    for step in range(first + 1, steps_per_tick if end is None else end):
        total += flow[step::steps_per_tick]
    return total


def by_tick_of_loops(flow: np.ndarray, steps_per_tick: int, first: int = 0, end: int | None = None) -> np.ndarray:
    """``by_tick`` of shape (ticks * n, loops) in half the time, to the same bits.

    NumPy adds in order over every axis but the one that lies closest in memory, which is that of the loops.
    """
    loops = flow.shape[1]
    if loops == 1:
        return by_tick(flow, steps_per_tick, first, end)
    steps = flow.reshape(-1, steps_per_tick, loops)[:, first:end]
    return np.add.reduce(steps, axis=1, initial=-0.0)  # what changes no number added to it, not even -0.0


class RunningSums:
    """Several running sums, each a float and the sum of the rounding errors of its additions.

    Each addition s + a = s' leaves the error e = (s - (s' - b)) + (a - b), b = s' - s, exactly (Knuth's TwoSum);
    the errors are summed beside (Ogita, Rump and Oishi 2005, cascaded summation), so that sum + error carries about
    twice the digits of a float.

    Args:
        loops: nothing, or of how many loops there are sums: all arrays then have one more axis, the last.

    Attributes:
        sums, errors: shape (rows,).
    """

    def __init__(self, *loops: int) -> None:
        self.sums = np.zeros((0, *loops))
        self.errors = np.zeros((0, *loops))

    def grow(self, rows: int) -> None:
        """Make room for ``rows`` sums in all; new ones start at 0."""
        missing = np.zeros((rows - len(self.sums), *self.sums.shape[1:]))
        self.sums = np.concatenate([self.sums, missing])
        self.errors = np.concatenate([self.errors, missing])

    def of_loops(self, loops: np.ndarray) -> RunningSums:
        """The sums of some loops, whose places are ``loops``, out of those of many."""
        some = RunningSums(len(loops))
        some.sums, some.errors = self.sums[:, loops], self.errors[:, loops]
        return some

    def add(self, increments: np.ndarray) -> np.ndarray:
        """Add column after column.

        Args:
            increments: shape (rows, columns).

        Returns:
            The totals before the first column and after each one, shape (rows, columns + 1).
        """
        sums = np.add.accumulate(np.concatenate([self.sums[:, None], increments], axis=1), axis=1)
        before, after = sums[:, :-1], sums[:, 1:]
        added = after - before
        lost = (before - (after - added)) + (increments - added)
        errors = np.add.accumulate(np.concatenate([self.errors[:, None], lost], axis=1), axis=1)
        self.sums, self.errors = sums[:, -1].copy(), errors[:, -1].copy()
        return sums + errors

    def add_of_loops(self, increments: np.ndarray) -> None:
        """Add column after column, shape (rows, columns, loops), to the same bits as ``add`` for each loop."""
        sums, errors = self.sums, self.errors
        for column in range(increments.shape[1]):
            increment = increments[:, column]
            after = sums + increment
            added = after - sums
            lost = increment - added
            lost += np.subtract(sums, np.subtract(after, added, out=added), out=added)
            errors, sums = np.add(errors, lost, out=lost), after
        self.sums, self.errors = sums, errors
