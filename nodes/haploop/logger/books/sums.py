"""Sums in a fixed order, and running sums that keep what rounding drops: the same however a run is cut into blocks."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np


def sum_rows(rows: Iterable[Any]) -> Any:
    """Returns the sum of at least one array, first to last, element by element; all of one shape."""
    first, *others = rows
    total = first.copy()
    for row in others:
        total += row
    return total


def sum_steps(flow: np.ndarray, first: int = 0, end: int | None = None) -> np.ndarray:
    """Returns the sum over the plant steps of each interval, or over those from ``first`` on before ``end``, in order.

    Args:
        flow: what each step adds, shape (ticks, steps), or (ticks, steps, batch).

    Returns:
        Shape (ticks,), or (ticks, batch).
    """
    steps = flow[:, first:end]
    if steps.ndim == 3 and steps.shape[2] > 1:
        # NumPy adds in order over every axis but the one that lies closest in memory, here that of the batch; and
        # -0.0 changes no number added to it, not even -0.0.
        return np.add.reduce(steps, axis=1, initial=-0.0)
    return sum_rows(steps[:, step] for step in range(steps.shape[1]))


class Sums(NamedTuple):
    """Running sums, each a float and the sum of the rounding errors of its additions.

    Each addition s + a = s' leaves the error e = (s - (s' - b)) + (a - b), b = s' - s, exactly (Knuth's TwoSum);
    the errors are summed beside (Ogita, Rump and Oishi 2005, cascaded summation), so that sum + error carries about
    twice the digits of a float.

    Attributes:
        sums, errors: shape (rows,), or (rows, batch).
    """

    sums: np.ndarray
    errors: np.ndarray


def no_sums(rows: int = 0, members: int | None = None) -> Sums:
    """Returns so many sums that stand at 0, for one run or for every member of a batch."""
    shape = (rows,) if members is None else (rows, members)
    return Sums(np.zeros(shape), np.zeros(shape))


def with_rows(state: Sums, rows: int) -> Sums:
    """Returns the sums with ``rows`` of them in all; new ones stand at 0."""
    missing = np.zeros((rows - len(state.sums), *state.sums.shape[1:]))
    return Sums(*(np.concatenate([part, missing]) for part in state))


def add_columns(state: Sums, increments: np.ndarray) -> tuple[Sums, np.ndarray]:
    """Adds column after column and keeps every total on the way.

    Args:
        increments: shape (rows, columns).

    Returns:
        The sums after the last column, and the totals before the first column and after each one, shape
        (rows, columns + 1).
    """
    sums = np.add.accumulate(np.concatenate([state.sums[:, None], increments], axis=1), axis=1)
    before, after = sums[:, :-1], sums[:, 1:]
    added = after - before
    lost = (before - (after - added)) + (increments - added)
    errors = np.add.accumulate(np.concatenate([state.errors[:, None], lost], axis=1), axis=1)
    return Sums(sums[:, -1].copy(), errors[:, -1].copy()), sums + errors


def add_ticks_of_batch(state: Sums, increments: np.ndarray) -> Sums:
    """Adds tick after tick for every member of a batch, to the same bits as :func:`add_columns`.

    Args:
        increments: shape (ticks, rows, batch).
    """
    sums, errors = (part.copy() for part in state)
    after, added, lost = (np.empty_like(sums) for _ in range(3))
    for increment in increments:
        np.add(sums, increment, out=after)
        np.subtract(after, sums, out=added)
        np.subtract(increment, added, out=lost)
        np.subtract(after, added, out=added)
        np.subtract(sums, added, out=added)
        lost += added
        errors += lost
        sums, after = after, sums
    return Sums(sums, errors)
