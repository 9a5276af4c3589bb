"""A loop of machine code (numba) for plant steps of many chains under projected friction, with the bits of NumPy."""

from __future__ import annotations

import numpy as np

from haploop.protocol.machine_code import MachineCode

_code = MachineCode(__file__, ())
# Members that are moved through all steps before the next ones, so that what they need stays in the cache.
_BLOCK = 64


@_code.compiled
def move(moves, of_friction, most, v, loads, held, states, at_ends):  # pragma: no cover
    """Fills in states, and friction in N and whether body 0 stops, at the end of every step.

    Args:
        moves: what (states, command, load, the load's rise) add to the states in a step, (states + 3, states, members).
        of_friction: what a newton of friction adds, (states, members).
        most: the largest friction, N, (members,).
        v: place of the velocity of body 0 among the states.
        loads: on the last body at every step and the end, N, (n + 1, members or 1).
        held: command held over every step, N, (n, members).
        states: at every step and at the end; the first row is known, (n + 1, states, members).
        at_ends: (n, 2, members).
    """
    size, members = states.shape[1:]
    each = loads.shape[1] > 1
    acting = np.empty((size + 3, _BLOCK))
    for first in range(0, members, _BLOCK):
        count = min(_BLOCK, members - first)
        for i in range(len(held)):
            for j in range(count):
                m = first + j
                load = loads[i, m if each else 0]
                acting[size, j], acting[size + 1, j] = held[i, m], load
                acting[size + 2, j] = loads[i + 1, m if each else 0] - load
            for k in range(size):
                acting[k, :count] = states[i, k, first : first + count]
            for k in range(size):
                after = states[i + 1, k, first : first + count]
                row = moves[0, k, first : first + count]
                for j in range(count):
                    after[j] = row[j] * acting[0, j]
                for of in range(1, size + 3):
                    row = moves[of, k, first : first + count]
                    for j in range(count):
                        after[j] += row[j] * acting[of, j]
                for j in range(count):
                    after[j] += acting[k, j]
            at, after = slice(first, first + count), states[i + 1, v, first : first + count]
            of_v, limit, was = of_friction[v, at], most[at], states[i, v, at]
            friction, stops = at_ends[i, 0, at], at_ends[i, 1, at]
            for j in range(count):
                needed = after[j] / -of_v[j]
                friction[j] = limit[j] if needed > limit[j] else -limit[j] if needed < -limit[j] else needed
                stops[j] = friction[j] == needed
            for k in range(size):
                change, state = of_friction[k, at], states[i + 1, k, at]
                for j in range(count):
                    state[j] += change[j] * friction[j]
            before, x = states[i, 0, at], states[i + 1, 0, at]
            for j in range(count):
                if stops[j]:
                    friction[j] = after[j] = 0.0
                    x[j] = before[j] if was[j] == 0.0 else x[j]


def is_made() -> bool:
    """Tells whether the loops were compiled before, on this processor, and only have to be loaded."""
    return _code.is_made()


def try_out() -> None:
    """Compiles the loop, or loads it; raises whatever numba raises."""
    _code.try_out(_try_out)


def _try_out() -> None:
    states, at_ends = np.zeros((2, 2, 2)), np.zeros((1, 2, 2))
    move(np.zeros((5, 2, 2)), np.ones((2, 2)), np.zeros(2), 1, np.zeros((2, 1)), np.zeros((1, 2)), states, at_ends)
