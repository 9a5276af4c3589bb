"""Running sums that keep what rounding drops, and come out the same however the run is cut into blocks."""

from __future__ import annotations

from collections.abc import Iterable

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


class RunningSums:
    """Several running sums, each a float and the sum of the rounding errors of its additions.

    Each addition s + a = s' leaves the error e = (s - (s' - b)) + (a - b), b = s' - s, exactly (Knuth's TwoSum);
    the errors are summed beside (Ogita, Rump and Oishi 2005, cascaded summation), so that sum + error carries about
    twice the digits of a float.

    Attributes:
        sums, errors: shape (rows,).
    """

    def __init__(self) -> None:
        self.sums = np.zeros(0)
        self.errors = np.zeros(0)

    def grow(self, rows: int) -> None:
        """Make room for ``rows`` sums in all; new ones start at 0."""
        missing = np.zeros(rows - len(self.sums))
        self.sums = np.concatenate([self.sums, missing])
        self.errors = np.concatenate([self.errors, missing])

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
