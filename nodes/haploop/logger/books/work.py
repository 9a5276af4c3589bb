"""Work of held forces over ticks and plant steps, and its sums, the same however a run is cut into blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np

# Sums a flow over the plant steps of each interval, from a first step up to before an end.
SumSteps = Callable[..., Any]
# The book of an unmodelled hand: what all others leave over, so that they have no residual.
CLOSING = "unmodelled_work"


class BatchSums(NamedTuple):
    """The slowest sums of the books of a batch; each does the same as its counterpart in NumPy.

    Attributes:
        displacement, add_ticks: as ``displacement`` and ``add_ticks_of_batch``.
        energies: as ``step_energies`` of one mass.
    """

    displacement: Callable[..., Displacement]
    energies: Callable[..., tuple[Any, Any]]
    add_ticks: Callable[[Sums, np.ndarray], Sums]


class Displacement(NamedTuple):
    """The displacement of the device, with the digits that the difference of two positions has lost, m.

    Attributes:
        by_step: over every plant step, shape (ticks, steps), or (ticks, steps, batch).
        by_tick: over every interval, shape (ticks,), or (ticks, batch).
    """

    by_step: Any
    by_tick: Any


def displacement(x: Any, x_low: Any, steps_per_tick: int | None, sum_steps: SumSteps) -> Displacement:
    """Returns the displacement between recorded positions.

    Args:
        x: positions at every step and at the end, shape (ticks * n + 1,), or (ticks * n + 1, batch), m.
        x_low: their rounding remainders, m.
        steps_per_tick: n; None where the steps are those of one interval and have no axis for ticks.
    """
    dx = way(x[:-1], x[1:], x_low[:-1], x_low[1:])
    if steps_per_tick is not None:
        dx = by_interval(dx, steps_per_tick)
    return Displacement(dx, sum_steps(dx))


def way(start: Any, end: Any, start_low: Any, end_low: Any) -> Any:
    """Returns the displacement between two positions, each with its rounding remainder, m."""
    dx = end - start
    dx += end_low - start_low
    return dx


def by_interval(column: np.ndarray, steps_per_tick: int) -> np.ndarray:
    """Returns a column of shape (ticks * n, ...) as (ticks, n, ...)."""
    return column.reshape(-1, steps_per_tick, *column.shape[1:])


def sampled_work(x_m: Any, force: Any) -> Any:
    """Returns -f[k-1] (x_m[k] - x_m[k-1]), J: all that a controller can know (Choi et al. 2022, eq. 4).

    Args:
        x_m: positions as measured at consecutive ticks, m, shape (ticks + 1,).
        force: commanded at all of them but the last, N, shape (ticks,) or (forces, ticks).
    """
    return force * -(x_m[1:] - x_m[:-1])


def in_effect(force: np.ndarray, command: np.ndarray, first: int) -> np.ndarray:
    """Returns the force an account commanded while each of these commands is in effect, N; 0 before the first command.

    Args:
        force: of the commands from ``first`` on.
        command: tick of each command, -1 before the first.
    """
    start, end = int(command[0]), int(command[-1])
    if first <= start and end - start == len(command) - 1 and (command[1:] > command[:-1]).all():
        return force[start - first : end - first + 1]
    found = force.take(np.maximum(command - first, 0), axis=0)
    found[command < 0] = 0.0
    return found


def sum_rows(rows: Iterable[Any]) -> Any:
    """Returns the sum of one or more arrays of one shape, element by element, added first to last."""
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
        # NumPy adds in order over every axis but the one whose entries lie closest in memory, here that of the batch;
        # and -0.0 changes no number added to it, not even -0.0.
        return np.add.reduce(steps, axis=1, initial=-0.0)
    return sum_rows(steps[:, step] for step in range(steps.shape[1]))


class Sums(NamedTuple):
    """Running sums, each a float and the sum of the rounding errors of its additions.

    The errors of the additions, each exact, are summed separately (Ogita, Rump and Oishi 2005, cascaded summation), so
    that sum + error carries about twice the digits of a float.

    Attributes:
        sums, errors: shape (rows,), or (rows, batch).
    """

    sums: np.ndarray
    errors: np.ndarray


def lost(before: Any, added: Any, after: Any) -> Any:
    """Returns the error of s' = s + a, exactly: (s - (s' - b)) + (a - b), b = s' - s (Knuth's TwoSum)."""
    part = after - before
    return (before - (after - part)) + (added - part)


def no_sums(rows: int = 0, members: int | None = None) -> Sums:
    """Returns ``rows`` sums of value 0, for one run or for every member of a batch."""
    shape = (rows,) if members is None else (rows, members)
    return Sums(np.zeros(shape), np.zeros(shape))


def with_rows(state: Sums, rows: int) -> Sums:
    """Returns the sums, extended to ``rows`` of them; new ones are 0."""
    missing = np.zeros((rows - len(state.sums), *state.sums.shape[1:]))
    return Sums(*(np.concatenate([part, missing]) for part in state))


def add_columns(state: Sums, increments: np.ndarray) -> tuple[Sums, np.ndarray]:
    """Adds column after column, shape (rows, columns), and keeps every intermediate total.

    Returns:
        The sums after the last column, and the totals before the first column and after each one, shape
        (rows, columns + 1).
    """
    sums = np.add.accumulate(np.concatenate([state.sums[:, None], increments], axis=1), axis=1)
    before, after = sums[:, :-1], sums[:, 1:]
    of_each = lost(before, increments, after)
    errors = np.add.accumulate(np.concatenate([state.errors[:, None], of_each], axis=1), axis=1)
    return Sums(sums[:, -1].copy(), errors[:, -1].copy()), sums + errors


def add_ticks_of_batch(state: Sums, increments: np.ndarray) -> Sums:
    """Adds tick after tick, shape (ticks, rows, batch), for every member bit-identical to ``add_columns``."""
    sums, errors = state.sums, state.errors.copy()
    for increment in increments:
        after = sums + increment
        errors += lost(sums, increment, after)
        sums = after
    return Sums(sums, errors)
