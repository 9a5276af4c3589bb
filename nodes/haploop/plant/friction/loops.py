"""Loops of machine code (numba) for intervals in which the first body of a chain sticks and slips, alone or in a batch.

The formulas are those of ``stick_slip`` and ``substeps`` as they stand; so are the bits.
"""

from __future__ import annotations

from itertools import accumulate
from typing import NamedTuple

import numpy as np

from haploop.plant.chain import motion
from haploop.plant.chain.history import Interval, StickSlipState
from haploop.plant.friction import stick_slip, substeps
from haploop.plant.friction.stick_slip import Row, StickSlip
from haploop.plant.line import Hold
from haploop.protocol.machine_code import MachineCode

_code = MachineCode(__file__, (motion, stick_slip, substeps))
# Pieces that are kept before they are handed over.
_PIECES = 16_384


class Pieces(NamedTuple):
    """Rows of ``substeps.pieces_record``, and how many there are, or were to be."""

    rows: np.ndarray
    noted: np.ndarray


@_code.compiled
def _row_on(row, z, command, load):  # pragma: no cover
    total = row.of_command * command + row.of_load * load
    for i in range(len(row.of_states)):
        if row.of_states[i] != 0.0:
            total = total + row.of_states[i] * z[i]
    return total


@_code.compiled
def _moved(table, z, z_comp, command, friction, load, rise):  # pragma: no cover
    size = len(z)
    after, change = np.empty(size), np.zeros(size)
    for i in range(size):
        for j in range(size):
            change[j] += table[i, j] * z[i]
    for j in range(size):
        total = change[j] + table[size, j] * command + table[size + 1, j] * friction
        total = total + table[size + 2, j] * load + table[size + 3, j] * rise + z_comp[j]
        after[j] = z[j] + total
        change[j] = total - (after[j] - z[j])
    return after, change


@_code.compiled
def _same(z):  # pragma: no cover
    return z


@_code.compiled
def _count_of(pieces):  # pragma: no cover
    return pieces.noted[0]


@_code.compiled
def _drop_last(pieces):  # pragma: no cover
    pieces.noted[0] -= 1


@_code.compiled
def _is_full(pieces, first, step):  # pragma: no cover
    return pieces.noted[0] > len(pieces.rows)


@_code.compiled
def _note(pieces, of, head, begin, comp):  # pragma: no cover
    at, size = pieces.noted[0], len(begin)
    pieces.noted[0] = at + 1
    if at < len(pieces.rows):
        row = pieces.rows[at]
        row[0], row[1], row[2], row[3], row[4], row[5] = head
        row[6 : 6 + size] = begin
        row[6 + size :] = comp[: of.v]


_friction_at, _against = _code.compiled(stick_slip.friction_at), _code.compiled(stick_slip.holds_against)
_forces = {"row_on": _row_on, "holds_against": _against}
_decide_at_rest = _code.compiled(stick_slip.decide_at_rest, **_forces)
_holds_through = _code.compiled(stick_slip.holds_through, **_forces)
_tangents = _code.compiled(stick_slip.tangents_meet_below)
_may_switch_within = _code.compiled(stick_slip.may_switch_within, row_on=_row_on, tangents_meet_below=_tangents)
_slipping, _lost_in = _code.compiled(stick_slip.slipping), _code.compiled(motion.lost_in)
_slipping_at = _code.compiled(stick_slip.slipping_at, friction_at=_friction_at)
_solve_step = _code.compiled(
    substeps.solve_step,
    decide_at_rest=_decide_at_rest,
    holds_through=_holds_through,
    may_switch_within=_may_switch_within,
    friction_over=_code.compiled(substeps.friction_over, friction_at=_friction_at, moved=_moved),
    at_rest=_code.compiled(substeps.at_rest),
    moved=_moved,
    numbers=_same,
    note=_note,
    count_of=_count_of,
    drop_last=_drop_last,
    is_full=_is_full,
)


@_code.compiled
def _follow(of, mode, table, forced, states, comps, held, at_ends, loads, ends, begin):  # pragma: no cover
    """Follows a mode from a step on; returns the first step in which it does not hold. See ``motion.follow``."""
    size, friction = states.shape[1], _slipping(of, mode)
    y, comp, moved, z = states[begin].copy(), comps[begin].copy(), np.empty(size), states[begin].copy()
    if begin:
        for j in range(size):
            y[j] = z[j] - forced[begin, j]
            comp[j] = comp[j] + _lost_in(z[j], -forced[begin, j], y[j])
    first = 0
    for end in ends:
        at, first = max(first, begin), end
        for step in range(at, end):
            command, load, end_load = held[step, 0], loads[step], loads[step + 1]
            moved[:] = 0.0
            for i in range(size):
                for j in range(size):
                    moved[j] += table[i, step - at, j] * y[i]
            after = np.empty(size)
            for j in range(size):
                total = moved[j] + table[size, step - at, j] * command + table[size + 1, step - at, j] * friction
                moved[j] = total + comp[j]
                change = moved[j] + forced[step + 1, j]
                states[step + 1, j] = after[j] = y[j] + change
                comps[step + 1, j] = change - (after[j] - y[j])
            if not _holds_through(of, mode, after, command, end_load):
                return step
            if mode.is_stuck and not _holds_through(of, mode, z, command, load):
                return step
            if _may_switch_within(of, mode, z, after, command, load, end_load, friction, 1.0):
                return step
            held[step, 2] = at_ends[step, 0] = friction
            held[step, 3] = at_ends[step, 1] = mode.is_stuck
            z = after
        if at < end:
            for j in range(size):
                before = y[j]
                y[j] = before + moved[j]
                comp[j] = moved[j] - (y[j] - before)
    return len(held)


@_code.compiled
def _advance(
    count, numbers, factors, coarsest, finest, whole_steps, tables, tables_held, forced, interval, loads, ends,
    first_step, is_stuck, direction, pieces, upto, member,
):  # pragma: no cover  # fmt: skip
    """Moves members through an interval, from one on; returns the first one whose pieces there is no room for."""
    members, n, halving = len(is_stuck), len(interval.held), substeps.Halving(coarsest, finest)
    law = stick_slip.Friction(numbers[0], numbers[1], numbers[2], numbers[3])
    force, change = Row(factors[0], numbers[6], numbers[7]), Row(factors[1], numbers[8], numbers[9])
    of = StickSlip(law, count, numbers[4], numbers[5], force, change)
    for m in range(member, members):
        before = pieces.noted[0]
        states, comps = interval.states[:, :, m].copy(), interval.comps[:, :, m].copy()
        held, at_ends = interval.held[:, :, m].copy(), interval.at_ends[:, :, m].copy()
        load = loads[:, min(m, loads.shape[1] - 1)].copy()
        free, clamped = forced[0], forced[1]
        place = min(m, free.shape[2] - 1)
        free, clamped = free[:, :, place].copy(), clamped[:, :, place].copy()
        mode, step = StickSlipState(is_stuck[m], direction[m]), 0
        while step < n:
            if whole_steps:
                mode = _decide_at_rest(of, mode, states[step], held[step, 0], load[step])
                table, of_load = tables_held[int(mode.is_stuck)], clamped if mode.is_stuck else free
                step = _follow(of, mode, table, of_load, states, comps, held, at_ends, load, ends, step)
            if step < n:
                rise, command = load[step + 1] - load[step], held[step, 0]
                made = _solve_step(
                    of, halving, tables, mode, first_step + step, states[step], comps[step], command, load[step], rise,
                    pieces,
                )  # fmt: skip
                mode, states[step + 1], comps[step + 1] = made.mode, made.z, made.z_comp
                held[step, 2], held[step, 3] = made.friction, made.is_stuck
                at_ends[step, 0] = _slipping_at(of, mode, states[step + 1, of.v])
                at_ends[step, 1] = mode.is_stuck
                step += 1
        if pieces.noted[0] > len(pieces.rows):
            pieces.noted[0] = before
            return m
        interval.states[:, :, m], interval.comps[:, :, m] = states, comps
        interval.held[:, :, m], interval.at_ends[:, :, m] = held, at_ends
        is_stuck[m], direction[m], upto[m] = mode.is_stuck, mode.direction, pieces.noted[0]
    return members


class Loops:
    """Intervals of one chain, or of a batch that shares it.

    Args:
        tables: transitions over h / 2^level by whether body 0 is stuck and by level, (2, levels, states + 4, states).
        held: over 1 ... n steps by whether it is stuck, (2, states + 2, n, states).
    """

    def __init__(
        self, of: StickSlip, halving: substeps.Halving, whole_steps: bool, tables: np.ndarray, held: np.ndarray
    ) -> None:
        size = tables.shape[-1]
        # What numba need not look into at every call is made of arrays there.
        numbers = np.array([*of.law, of.mass_kg, of.speed_up, *of.force[1:], *of.change[1:]])
        factors = np.stack([_dense(row, size) for row in (of.force, of.change)])
        self._system = of.v, numbers, factors, *halving, whole_steps, tables, held
        self._pieces = Pieces(np.empty((_PIECES, 6 + size + of.v)), np.zeros(1, np.int64))

    def advance(
        self, interval: Interval, forced: tuple[np.ndarray, np.ndarray], loads: np.ndarray, holds: list[Hold],
        first_step: int, is_stuck: np.ndarray, direction: np.ndarray,
    ) -> list[tuple[int, np.ndarray]] | None:  # fmt: skip
        """Moves all members through an interval, whose first plant step is numbered; changes their modes in place.

        Returns:
            (member, rows of its pieces) of those that have any; None where one switches too often for the loops: the
            interval is then to be moved by other means.
        """
        ends, upto = np.array([*accumulate([hold[0] for hold in holds])]), np.empty(len(is_stuck), np.int64)
        found, pieces, begun, loads = list[tuple[int, np.ndarray]](), self._pieces, 0, np.ascontiguousarray(loads)
        while begun < len(is_stuck):
            pieces.noted[0] = 0
            member = _advance(
                *self._system, forced, interval, loads, ends, first_step, is_stuck, direction, pieces, upto, begun
            )  # fmt: skip
            if member == begun:
                return None
            if count := int(pieces.noted[0]):
                rows, first = pieces.rows[:count].copy(), 0
                for place, end in enumerate(upto[begun:member].tolist(), begun):
                    if end > first:
                        found.append((place, rows[first:end]))
                        first = end
            begun = member
        return found


def _dense(row: Row, size: int) -> np.ndarray:
    factors = np.zeros(size)
    for i, factor in row.of_states:
        factors[i] = factor
    return factors


def try_out() -> None:
    """Compiles the loops, or loads them; raises whatever numba does."""
    _code.try_out(_try_out)


def _try_out() -> None:
    row = Row([], 1.0, 1.0)
    of = StickSlip(stick_slip.Friction(1.0, 1.0, 0.0, 1.0), 1, 1.0, 1.0, row, row)
    loops = Loops(of, substeps.Halving(0, 1), True, np.zeros((2, 3, 6, 2)), np.zeros((2, 4, 1, 2)))
    interval = Interval(*(np.zeros(shape) for shape in ((2, 2, 1), (2, 2, 1), (1, 4, 1), (1, 2, 1))))
    forced = np.zeros((2, 2, 1)), np.zeros((2, 2, 1))
    loops.advance(interval, forced, np.zeros((2, 1)), [(1, 0.0, 0)], 0, np.zeros(1, bool), np.ones(1))
