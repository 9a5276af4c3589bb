"""Loops of machine code (numba) for what takes longest in a batch with books: formulas of motion and books, compiled.

NumPy goes over all members once for each operation, a loop once for all operations. The same operations in the same
order give the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from haploop.logger.books import one_mass, work
from haploop.logger.books.one_mass import OneMassParams, Steps
from haploop.logger.books.work import BatchSums, Displacement, Sums, SumSteps
from haploop.plant.motion import record
from haploop.plant.motion.one_mass import Mechanics
from haploop.protocol.machine_code import MachineCode

_code = MachineCode(__file__, (work, one_mass, record))
_compiled = _code.compiled
_way, _lost, _change_over = _compiled(work.way), _compiled(work.lost), _compiled(record.change_over)
_net_force, _hand_work = _compiled(one_mass.net_force), _compiled(one_mass.hand_work)
_sum_squares = _compiled(one_mass.sum_squares)


@_compiled
def _ways(x, x_low, dx, by_tick):  # pragma: no cover
    ticks, n, members = dx.shape
    for tick in range(ticks):
        for step in range(n):
            row = tick * n + step
            for j in range(members):
                moved = _way(x[row, j], x[row + 1, j], x_low[row, j], x_low[row + 1, j])
                dx[tick, step, j] = moved
                by_tick[tick, j] += moved


@_compiled
def _numbers(table, j):  # pragma: no cover
    a, b, c = table[6, j], table[7, j], table[8, j]
    square = a, b, c, table[9, j], table[10, j], table[11, j]
    return table[0, j], table[1, j], table[2, j], (table[3, j], table[4, j], table[5, j]), square


@_compiled
def _energies(numbers, of_each, x, v, force, tau, tau_of_each, rise, dx, works, squares):  # pragma: no cover
    ticks, n, members = dx.shape
    damping, stiffness, rest, lag, square = _numbers(numbers, 0)
    for tick in range(ticks):
        for step in range(n):
            t, risen = tau[tick, step, 0], rise[tick, step, 0]
            for j in range(members):
                if of_each is not None:
                    damping, stiffness, rest, lag, square = _numbers(numbers, j)
                if tau_of_each is not None:
                    t, risen = tau[tick, step, j], rise[tick, step, j]
                at_v = v[tick, step, j]
                net = _net_force(damping, stiffness, rest, x[tick, step, j], at_v, force[tick, step, j], t)
                rates = at_v, net, risen
                works[tick, j] += _hand_work(lag, t, risen, dx[tick, step, j], rates)
                squares[tick, j] += _sum_squares(square, rates)


@_compiled
def _add(sums, errors, increments):  # pragma: no cover
    ticks, rows, members = increments.shape
    for tick in range(ticks):
        for row in range(rows):
            for j in range(members):
                before, added = sums[row, j], increments[tick, row, j]
                after = before + added
                errors[row, j] += _lost(before, added, after)
                sums[row, j] = after


@_compiled
def _over(held, i, j):  # pragma: no cover
    return (held[i, 0, j], held[i, 1, j], held[i, 2, j]), (held[i, 3, j], held[i, 4, j], held[i, 5, j])


@_compiled
def _fill(
    held, of_each, response, response_of_each, x, v, x_comp, v_comp, force, first, known, count, to_x, to_v, to_low
):  # pragma: no cover  # fmt: skip
    ticks, members = x.shape
    for tick in range(ticks):
        for i in range(known, count):
            step, (of_x, of_v) = first + i, _over(held, i, 0)
            pull, push = response[0, step, tick, 0], response[1, step, tick, 0]
            for j in range(members):
                if of_each is not None:
                    of_x, of_v = _over(held, i, j)
                if response_of_each is not None:
                    pull, push = response[0, step, tick, j], response[1, step, tick, j]
                at_x, at_v, held_N = x[tick, j], v[tick, j], force[tick, j]
                dx = _change_over(of_x, pull, at_x, at_v, held_N, x_comp[tick, j])
                end = at_x + dx
                to_x[step, tick, j] = end
                to_v[step, tick, j] = at_v + _change_over(of_v, push, at_x, at_v, held_N, v_comp[tick, j])
                to_low[step, tick, j] = dx - (end - at_x)


def _of_each(table: np.ndarray) -> int | None:
    """Returns whether every member has its own number: 1, or None if they share one, which makes another program."""
    return None if table.shape[-1] == 1 else 1


def _from_nothing(*shape: int) -> np.ndarray:
    """Returns sums to which nothing was added, -0.0: 0.0 + -0.0 would be 0.0."""
    return np.full(shape, -0.0)


def displacement(x: np.ndarray, x_low: np.ndarray, steps_per_tick: int, _summed: SumSteps) -> Displacement:
    """Does what ``work.displacement`` does."""
    members = x.shape[1]
    dx = np.empty(((len(x) - 1) // steps_per_tick, steps_per_tick, members))
    moved = Displacement(dx, _from_nothing(len(dx), members))
    _ways(x, x_low, *moved)
    return moved


def energies(params: OneMassParams, steps: Steps, _summed: SumSteps) -> tuple[np.ndarray, np.ndarray]:
    """Does what ``one_mass.step_energies`` does."""
    m, (ticks, _, members) = params.mechanics, steps.dx.shape
    numbers = np.broadcast_arrays(m.damping, m.stiffness, m.rest_m, *params.lag, *params.square)
    found = _from_nothing(ticks, members), _from_nothing(ticks, members)
    table = np.stack(numbers).reshape(len(numbers), -1)
    of_each, tau_of_each = _of_each(table), _of_each(steps.tau)
    # A rise of 0 adds zeros, which change no sum.
    rise = np.zeros_like(steps.tau) if steps.rise is None else steps.rise
    _energies(table, of_each, *steps[:4], tau_of_each, rise, steps.dx, *found)
    return found


def add_ticks(state: Sums, increments: np.ndarray) -> Sums:
    """Does what ``work.add_ticks_of_batch`` does."""
    sums = Sums(*(part.copy() for part in state))
    _add(*sums, increments)
    return sums


def filled(
    held: np.ndarray, response: np.ndarray, hold: Sequence[np.ndarray], rows: record.Rows, first: int, count: int
) -> None:
    """Does what ``record.fill_steps`` does."""
    if len(rows) == 1:
        return record.fill_steps(held, response, hold, rows, first, count)
    known = int(not first)
    response = np.ascontiguousarray(response)
    to = rows["x"], rows["v"], rows["x_low"]
    _fill(held, _of_each(held), response, _of_each(response), *hold, first, known, count, *to)
    if known:
        for row, start in zip(to, hold[:3], strict=True):
            row[0] = start
    rows["force"][first : first + count] = hold[-1]
    return None


def _or_numpy(loop: Callable[..., Any], plain: Callable[..., Any]) -> Callable[..., Any]:
    """Returns a function that does what ``plain`` does, by a loop if numba can compile or load it.

    Both make all of their results from scratch, so that a loop that stopped half-way does no harm.
    """

    def does(*of: Any) -> Any:
        try:
            return loop(*of)
        except Exception:  # numba's own, and those of a damaged cache
            return plain(*of)

    return does


def is_made() -> bool:
    """Tells whether the loops were compiled before, on this processor, and only have to be loaded."""
    return _code.is_made()


def try_out() -> None:
    """Compiles the loops, or loads them, for numbers that all members share; raises whatever numba raises."""
    _code.try_out(_try_out)


def _try_out() -> None:
    rows = {name: np.zeros((2, 2, 2)).swapaxes(0, 1) for name in record.COLUMNS}
    filled(np.zeros((3, 6, 1)), np.zeros((2, 3, 2, 1)), [np.zeros((2, 2))] * 5, rows, 0, 2)
    moved = displacement(np.zeros((2, 2)), np.zeros((2, 2)), 1, work.sum_steps)
    mechanics = Mechanics(1.0, {}, 0.0, 0.0, (0.0, 0.0))
    x, tau = np.zeros((1, 1, 2)), np.zeros((1, 1, 1))
    params = OneMassParams(mechanics, np.zeros((6, 1)), np.zeros((3, 1)), ())
    energies(params, Steps(x, x, x, tau, None, moved.by_step), work.sum_steps)
    add_ticks(work.no_sums(1, 2), np.zeros((1, 1, 2)))


SUMS = BatchSums(
    _or_numpy(displacement, work.displacement),
    _or_numpy(energies, one_mass.step_energies),
    _or_numpy(add_ticks, work.add_ticks_of_batch),
)
fill = _or_numpy(filled, record.fill_steps)
