"""A loop of machine code (numba) for an interval of a chain without friction.

The formulas are those of ``motion.follow``, and so are the results, to the bit.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from haploop.plant.chain import motion
from haploop.protocol.machine_code import MachineCode

_code = MachineCode(__file__, (motion,))


@_code.compiled
def follow(held, forced, course, ends):  # pragma: no cover
    """Fills in the states of an interval.

    Args:
        held: transitions over 1 ... n steps, shape (n, states + 2, states).
        forced: the forced response, shape (n + 1, states).
        course: of the interval, shape (n + 1, columns); the start and what is held are known.
        ends: the step at which each hold ends.
    """
    size, first = forced.shape[1], 0
    y, comp, moved = course[0, :size].copy(), course[0, size : 2 * size].copy(), np.empty(size)
    for end in ends:
        at, first = first, end
        for step in range(at, end):
            table, command = held[step - at], course[step, 2 * size]
            for j in range(size):
                moved[j] = table[0, j] * y[0]
            for i in range(1, size):
                for j in range(size):
                    moved[j] += table[i, j] * y[i]
            for j in range(size):
                moved[j] = (moved[j] + table[size, j] * command + table[size + 1, j] * 0.0) + comp[j]
                change = moved[j] + forced[step + 1, j]
                after = y[j] + change
                course[step + 1, j], course[step + 1, size + j] = after, change - (after - y[j])
        if at < end:
            for j in range(size):
                before = y[j]
                y[j] = before + moved[j]
                comp[j] = moved[j] - (y[j] - before)


@lru_cache(maxsize=1024)
def ends_of(counts: tuple[int, ...]) -> np.ndarray:
    """Returns the step at which each hold ends, from the number of steps of each."""
    return np.cumsum(counts)


def is_made() -> bool:
    """Tells whether the loop was compiled before, on this processor, and only has to be loaded."""
    return _code.is_made()


def try_out() -> None:
    """Compiles the loop, or loads it; raises whatever numba raises."""
    _code.try_out(lambda: follow(np.zeros((1, 4, 2)), np.zeros((2, 2)), np.zeros((2, 8)), ends_of((1,))))
