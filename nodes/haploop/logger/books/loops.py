"""A machine-code loop (numba) for the books of a chain whose first body sticks and slips; bit-identical to NumPy."""

from __future__ import annotations

from functools import partial

import numpy as np

from haploop.plant.friction import step_loop
from haploop.plant.friction.step_loop import NONE, STATES, add_up
from haploop.protocol.machine_code import MachineCode

_code = MachineCode(__file__, (step_loop,))
_inlined = partial(_code.compiled, inlined=True)
# Integrals of products that are summed side by side: no chain has more dampers, links and actuator than these.
_PRODUCTS = 6


@_inlined
def _rates_of(rates, lags, acting, rise, w):  # pragma: no cover
    """Fills in the rates; returns the lag integral."""
    count, lag = len(rates) - 3, 0.0
    w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7] = add_up(rates, acting, NONE)
    w[count] = rise
    for i in range(count + 1):
        if lags[i] != 0.0:
            lag += lags[i] * w[i]
    return lag


@_inlined
def _products_of(forms, w, count, found):  # pragma: no cover
    a, b, c, d, e, f, pair = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
    for i in range(count):
        for j in range(i, count):
            both, of = w[i] * w[j], forms[pair]
            a, b, c = a + of[0] * both, b + of[1] * both, c + of[2] * both
            d, e, f = d + of[3] * both, e + of[4] * both, f + of[5] * both
            pair += 1
    found[0], found[1], found[2], found[3], found[4], found[5] = a, b, c, d, e, f


@_inlined
def _stored(masses, links, stiffness, rest, at, then, way):  # pragma: no cover
    """Returns the changes of the kinetic energy and of the energy in the springs."""
    n, states, v, dv, kinetic, beyond = len(masses), len(at) - len(masses), 0.0, 0.0, 0.0, at[0] - rest
    for body in range(n):
        v, dv = v + at[n + body], dv + (then[n + body] - at[n + body])
        kinetic += masses[body] * dv * (v + dv / 2.0)
    for i in range(1, n):
        beyond += at[i]
    for i in range(n):
        beyond += at[states + i]
    spring = stiffness * way * (beyond + way / 2.0)
    for i in range(1, n):
        change = (then[i] - at[i]) + (then[states + i] - at[states + i])
        spring += links[i - 1] * change * (at[i] + change / 2.0)
    return kinetic, spring


@_code.compiled
def _book(
    masses, links, spring, rates, forms, lags, which, rows, pieces, first, constant_N, has_lag, found
):  # pragma: no cover
    """Fills in the books of each tick, summed step by step; a segment is a step, or a piece of one."""
    n, states, steps, members = len(masses), rates.shape[1] - 3, rows.shape[1] - 1, rows.shape[2]
    constants, steps_per_tick = max(len(constant_N) - 1, 0), steps // found.shape[1]
    columns, products, due = states + n, len(found) - 5 - constants, first.copy()
    acting, w, heats, book = np.empty(states + 3), np.empty(STATES + 1), np.empty(_PRODUCTS), np.empty(len(found))
    at, then = np.empty(columns), np.empty(columns)
    for step in range(steps):
        for m in range(members):
            tau, over, is_last = rows[columns + 3, step, m], 0.0, False
            rise, end, p = rows[columns + 3, step + 1, m] - tau, first[m + 1], due[m]
            is_cut = p < end and pieces[columns + 2, p] == step
            book[:] = 0.0
            while not is_last:
                is_last, level, snap_J = True, 0, 0.0
                if is_cut:
                    is_last = p + 1 == end or pieces[columns + 2, p + 1] != step
                    friction, stuck = pieces[columns, p], int(pieces[columns + 1, p] > 0.0)
                    level, snap_J = int(pieces[columns + 3, p]), pieces[columns + 4, p]
                    for i in range(columns):
                        at[i] = pieces[i, p]
                    if not is_last:
                        for i in range(columns):
                            then[i] = pieces[i, p + 1]
                    p += 1
                else:
                    friction, stuck = rows[columns, step, m], int(rows[columns + 1, step, m] > 0.0)
                    for i in range(columns):
                        at[i] = rows[i, step, m]
                if is_last:
                    for i in range(columns):
                        then[i] = rows[i, step + 1, m]
                start, lasts = tau + rise * over, 1.0 / (1 << level)
                over += lasts
                for i in range(states):
                    acting[i] = at[i]
                # The hand's spring acts by its distance from rest; thus no digits are spent on where the rest lies.
                acting[0] = at[0] - spring[1] + at[states]
                acting[states], acting[states + 1], acting[states + 2] = rows[columns + 2, step, m], friction, start
                kind = which[2 * level + stuck]
                lag = _rates_of(rates[stuck], lags[kind], acting, rise, w)
                _products_of(forms[kind], w, states + 1, heats)
                way, moved = 0.0, (then[0] - at[0]) + (then[states] - at[states])
                for i in range(n):
                    way += (then[i] - at[i]) + (then[states + i] - at[states + i])
                risen = rise * lasts
                work = (start + risen / 2.0) * way + risen * lag
                kinetic, stored = _stored(masses, links, spring[0], spring[1], at, then, way)
                if constants:
                    work -= constant_N[constants] * way
                book[0] += work
                for i in range(products):
                    book[1 + i] += heats[i]
                book[products + 1] += -friction * moved + snap_J
                book[products + 2] += kinetic
                book[products + 3] += stored
                for i in range(constants):
                    book[products + 4 + i] += constant_N[i] * way
            due[m], tick = p, step // steps_per_tick
            dx = (rows[0, step + 1, m] - rows[0, step, m]) + (rows[states, step + 1, m] - rows[states, step, m])
            book[-1] = (book[products] if has_lag else 0.0) + rows[columns + 4, step, m] * dx
            for i in range(len(found)):
                if step % steps_per_tick:
                    found[i, tick, m] += book[i]
                else:
                    found[i, tick, m] = book[i]


def books_by_tick(device: list[np.ndarray], rows: np.ndarray, pieces: np.ndarray, first: np.ndarray,
                  constant_N: np.ndarray, books: int, ticks: int, has_lag: bool) -> np.ndarray:  # fmt: skip
    """Returns the energy that each tick adds to each book, J, shape (books, ticks, members).

    The books are those of ``ChainBooks``, with the lag of the actuator, if it has one, after the heats of dampers. The
    last is that lag plus what the actuator's limits keep: the force beyond them times the displacement of the device.

    Args:
        device: masses in kg, stiffness of the links in N/m, (stiffness N/m, rest m) of the hand's spring, and what
            ``ChainForms.for_loops`` returns.
        rows: at each step and at the end, for each member: the states, the rounding remainders of the lengths,
            friction, whether body 0 is stuck, the force held, tau and the force beyond the limits of the actuator;
            shape (states + lengths + 5, steps + 1, members).
        pieces: of steps that were cut, by member and in order: the same up to stuck, then step, level and the energy
            lost by setting v to 0, J; shape (states + lengths + 5, pieces).
        first: where the pieces of each member begin, and where the last ones end, shape (members + 1,).
        constant_N: constant forces in tau, followed by their sum, N; empty without such forces.
    """
    found = np.empty((books, ticks, rows.shape[2]))
    _book(*device, rows, pieces, first, constant_N, has_lag, found)
    return found


def rates_of(rates: list[np.ndarray]) -> np.ndarray:
    """Returns the rates with body 0 free and held as the loop takes them, shape (2, acting, states padded)."""
    table = np.stack(rates)
    return np.ascontiguousarray(np.pad(table, [(0, 0), (0, STATES - table.shape[1]), (0, 0)]).swapaxes(1, 2))


def pairs_of(forms: np.ndarray) -> np.ndarray:
    """Returns quadratic forms, shape (kinds, products, rates, rates), as the loop takes them, by pairs of rates."""
    kinds, products, size, _ = forms.shape
    above, to = forms * (np.triu(np.full((size, size), 2.0), 1) + np.eye(size)), np.triu_indices(size)
    table = np.zeros((kinds, len(to[0]), _PRODUCTS))
    table[..., :products] = np.moveaxis(above[:, :, to[0], to[1]], 1, -1)
    return table


def is_made() -> bool:
    """Tells whether the loops were compiled before, on this processor, and only have to be loaded."""
    return _code.is_made()


def try_out() -> None:
    """Compiles the loop, or loads it; raises whatever numba does."""
    one = np.zeros(1)
    forms = pairs_of(np.zeros((1, 1, 3, 3))), np.zeros((1, 3)), np.zeros(2, np.int64)
    device = [one, np.zeros(0), np.zeros(2), rates_of([np.zeros((2, 5))] * 2), *forms]
    pieces, first = np.zeros((8, 0)), np.zeros(2, np.int64)
    _code.try_out(lambda: books_by_tick(device, np.zeros((8, 2, 1)), pieces, first, one[:0], 6, 1, False))
