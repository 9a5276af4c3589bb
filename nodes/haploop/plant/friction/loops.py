"""Loops of machine code (numba) for intervals in which the first body of a chain sticks and slips, alone or in a batch.

The formulas are those of ``stick_slip`` and ``substeps``, unchanged, and so are the results, to the bit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from haploop.plant.chain import motion
from haploop.plant.chain.history import StickSlipState
from haploop.plant.chain.loops import ends_of
from haploop.plant.friction import step_loop, stick_slip, substeps
from haploop.plant.friction.step_loop import (
    ACTS,
    NONE,
    STATES,
    add_up,
    creeps,
    decide_at_rest,
    holds_against,
    holds_through,
    may_switch_within,
    row_on,
    slipping,
    slipping_at,
    solve_step,
)
from haploop.plant.friction.stick_slip import Row, StickSlip
from haploop.plant.line import Hold
from haploop.protocol.machine_code import MachineCode

_code = MachineCode(__file__, (motion, step_loop, stick_slip, substeps))
_lost_in = _code.compiled(motion.lost_in, inlined=True)
# This many pieces are kept before they are handed over.
_PIECES = 16_384
# Members taken out of a batch at a time, so that what lies side by side in memory is read and written together.
_TOGETHER = 8
# (member of each piece, rows of ``pieces_record``).
Pieces = tuple[np.ndarray, np.ndarray]


@_code.compiled
def _follow(of, mode, held, forced, course, loads, ends, begin, y, comp, z, after, moved):  # pragma: no cover
    """Follows a mode from a step on; returns the first step in which it does not hold. See ``motion.follow``."""
    size, friction, k = forced.shape[2], slipping(of, mode), int(mode.is_stuck)
    for j in range(size):
        z[j] = y[j] = course[begin, j]
        comp[j] = course[begin, size + j]
        if begin:
            y[j] = z[j] - forced[k, begin, j]
            comp[j] = comp[j] + _lost_in(z[j], -forced[k, begin, j], y[j])
    first = 0
    for end in ends:
        at, first = max(first, begin), end
        for step in range(at, end):
            command, load, end_load = course[step, 2 * size], loads[step], loads[step + 1]
            response, row = forced[k, step + 1], course[step + 1]
            y[size], y[size + 1] = command, friction
            total = add_up(held[k, step - at], y, NONE)
            moved[0], moved[1], moved[2], moved[3] = total[0], total[1], total[2], total[3]
            moved[4], moved[5], moved[6], moved[7] = total[4], total[5], total[6], total[7]
            for j in range(size):
                moved[j] = moved[j] + comp[j]
                change = moved[j] + response[j]
                after[j] = row[j] = y[j] + change
                row[size + j] = change - (after[j] - y[j])
            if not holds_through(of, mode, after, command, end_load):
                return step
            if mode.is_stuck and not holds_through(of, mode, z, command, load):
                return step
            if creeps(of, mode, after[of.v]) and holds_against(of.law, row_on(of.force, after, command, end_load)):
                return step
            if may_switch_within(of, mode, z, after, command, load, end_load, friction, 1.0):
                return step
            course[step, 2 * size + 2], course[step, 2 * size + 3] = friction, k
            course[step, 2 * size + 4], course[step, 2 * size + 5] = friction, k
            for j in range(size):
                z[j] = after[j]
        if at < end:
            for j in range(size):
                before = y[j]
                y[j] = before + moved[j]
                comp[j] = moved[j] - (y[j] - before)
    return len(loads) - 1


@_code.compiled
def walk(
    of, halving, whole_steps, tables, held, forced, course, loads, ends, first_step, mode, pieces, room
):  # pragma: no cover
    """Moves one member through an interval; returns its mode at the end."""
    step, n, size = 0, len(loads) - 1, forced.shape[2]
    z, comp, next_z, next_comp, moved = room[0], room[1], room[2], room[3], room[4]
    while step < n:
        if whole_steps:
            mode = decide_at_rest(of, mode, course[step], course[step, 2 * size], loads[step])
            step = _follow(of, mode, held, forced, course, loads, ends, step, z, comp, next_z, next_comp, moved)
        if step < n:
            for j in range(size):
                z[j], comp[j] = course[step, j], course[step, size + j]
            for j in range(size, STATES):
                z[j] = comp[j] = 0.0
            made = solve_step(
                of, halving, tables, mode, first_step + step, z, comp, course[step, 2 * size], loads[step],
                loads[step + 1] - loads[step], pieces, next_z, next_comp,
            )  # fmt: skip
            mode = made.mode
            for j in range(size):
                course[step + 1, j], course[step + 1, size + j] = z[j], comp[j]
            course[step, 2 * size + 2], course[step, 2 * size + 3] = made.friction, made.is_stuck
            course[step, 2 * size + 4] = slipping_at(of, mode, z[of.v])
            course[step, 2 * size + 5] = mode.is_stuck
            step += 1
    return mode


@_code.compiled
def row_of(rows, at):  # pragma: no cover
    of = rows[at]
    return Row((of[0], of[1], of[2], of[3], of[4], of[5], of[6], of[7]), of[8], of[9])


@_code.compiled
def _advance(
    whole, mass_kg, speed_up, rows, tables, held, devices, laws, free, clamped, loads, ends, first_step, courses, modes,
    pieces, upto, member,
):  # pragma: no cover  # fmt: skip
    """Moves members through an interval, from ``member`` on; returns the first for whose pieces there is no room."""
    members, n, size = courses.shape[2], courses.shape[0] - 1, free.shape[1]
    halving, room = substeps.Halving(whole[1], whole[2]), np.empty((5, ACTS))
    some, load = np.empty((_TOGETHER, n + 1, 2 * size + 6)), np.empty((_TOGETHER, n + 1))
    forced = np.empty((2, n + 1, size))
    while member < members:
        many, done = min(_TOGETHER, members - member), 0
        for step in range(n + 1):
            for at in range(many):
                some[at, step, 2 * size] = courses[step, 2 * size, member + at]
                load[at, step] = loads[step, min(member + at, loads.shape[1] - 1)]
        for j in range(2 * size):
            for at in range(many):
                some[at, 0, j] = courses[0, j, member + at]
        for at in range(many):
            m, before = member + at, pieces[-1, 0]
            if free.shape[2] > 1 or not at:
                place = min(m, free.shape[2] - 1)
                forced[0], forced[1] = free[:, :, place], clamped[:, :, place]
            law, device = min(m, laws.shape[1] - 1), devices[m]
            rubs = stick_slip.Friction(laws[0, law], laws[1, law], laws[2, law], laws[3, law])
            force, change = row_of(rows[device], 0), row_of(rows[device], 1)
            of = StickSlip(rubs, whole[0], mass_kg[device], speed_up[device], force, change)
            mode = StickSlipState(modes[0, m] > 0.0, modes[1, m])
            mode = walk(
                of,
                halving,
                whole[3] > 0,
                (tables[0][device], tables[1][device]),
                held[device],
                forced,
                some[at],
                load[at],
                ends,
                first_step,
                mode,
                pieces,
                room,
            )
            if pieces[-1, 0] >= len(pieces):
                pieces[-1, 0] = before
                break
            modes[0, m], modes[1, m], upto[m], done = mode.is_stuck, mode.direction, int(pieces[-1, 0]), done + 1
        for step in range(n + 1):
            for j in range(2 * size + 6):
                if not (2 * size <= j < 2 * size + 2):
                    for at in range(done):
                        courses[step, j, member + at] = some[at, step, j]
        member += done
        if done < many:
            break
    return member


class Loops:
    """Intervals of chains of several devices with equally many states; the law of friction is passed in.

    Args:
        of: sticking and slipping of each device.
        halving, whole_steps: how plant steps are cut, and whether one in which nothing switches is left whole.
        tables: transitions over h / 2^level by device, by whether body 0 is stuck and by level, shape (devices, 2,
            levels, states + 4, states).
        held: over 1 ... n steps by device and whether it is stuck, shape (devices, 2, states + 2, n, states).

    Attributes:
        cut: how plant steps are cut, as the loops need it, with the place of the velocity of body 0 among the states.
        devices: what the loops need of each; arrays with the devices on the first axis.
        states: the number of states.
        pieces, room: arrays for pieces, with their number in a last row, and for intermediate states.
    """

    def __init__(
        self, of: Sequence[StickSlip], halving: substeps.Halving, whole_steps: bool, tables: np.ndarray,
        held: np.ndarray,
    ) -> None:  # fmt: skip
        rows = np.zeros((len(of), 2, STATES + 2))
        assert tables.shape[-1] <= STATES
        for of_device, one in zip(rows, of, strict=True):
            for row, (of_states, *others) in zip(of_device, (one.force, one.change), strict=True):
                row[-2:] = others
                for i, factor in of_states:
                    row[i] = factor
        filled = [(0, 0)] * 4 + [(0, STATES - tables.shape[-1])]
        both = np.pad(tables, filled), np.ascontiguousarray(tables.swapaxes(3, 4))
        held = np.ascontiguousarray(np.pad(held, filled).swapaxes(2, 3))
        masses_kg, speeds_up = np.array([[one.mass_kg, one.speed_up] for one in of]).T.copy()
        self.cut = np.array([of[0].v, *halving, whole_steps])
        self.devices = masses_kg, speeds_up, rows, both, held
        self.states = tables.shape[-1]
        self.pieces = np.zeros((_PIECES + 1, 6 + self.states + of[0].v))
        self.room = np.empty((5, ACTS))

    def advance(
        self, course: np.ndarray, forced: tuple[np.ndarray, np.ndarray], loads: np.ndarray, holds: list[Hold],
        first_step: int, modes: np.ndarray, laws: np.ndarray, devices: np.ndarray,
    ) -> list[Pieces] | None:  # fmt: skip
        """Moves all members through the interval that begins at step ``first_step``; changes their modes in place.

        Args:
            course: of an ``Interval``, shape (n + 1, columns, members); all but the start and what the line holds is
                filled in.
            forced: responses to the loads while body 0 slips and while it sticks, shape (n + 1, states, 1 or members).
            loads: shape (n + 1, 1 or members), N.
            modes: whether body 0 sticks, and its direction, shape (2, members).
            laws: the numbers of ``Friction``, shape (4, 1 or members).
            devices: the place of each member's device among the devices, shape (members,).

        Returns:
            Their pieces, member after member; None if one switches too often for the loops: the interval must then be
            moved by other means.
        """
        ends = ends_of(tuple([hold[0] for hold in holds]))
        found, pieces, begun, members = list[Pieces](), self.pieces, 0, course.shape[2]
        upto = np.empty(members, np.int64)
        while begun < members:
            pieces[-1, 0] = 0.0
            member = _advance(
                self.cut, *self.devices, devices, laws, *forced, loads, ends, first_step, course, modes, pieces, upto,
                begun,
            )  # fmt: skip
            if member == begun:
                return None
            if count := int(pieces[-1, 0]):
                counts = np.diff(upto[begun:member], prepend=0)
                found.append((np.repeat(np.arange(begun, member), counts), pieces[:count].copy()))
            begun = member
        return found


def is_made() -> bool:
    """Tells whether the loops were compiled before, on this processor, and only have to be loaded."""
    return _code.is_made()


def try_out() -> None:
    """Compiles the loops, or loads them; raises whatever numba raises."""
    _code.try_out(_try_out)


def smallest() -> Loops:
    """Returns the loops of a chain of one body that does not move, with one plant step per tick."""
    row = Row([], 1.0, 1.0)
    of = StickSlip(stick_slip.Friction(1.0, 1.0, 0.0, 1.0), 1, 1.0, 1.0, row, row)
    return Loops([of], substeps.Halving(0, 1), True, np.zeros((1, 2, 3, 6, 2)), np.zeros((1, 2, 4, 1, 2)))


def _try_out() -> None:
    forced = np.zeros((2, 2, 1)), np.zeros((2, 2, 1))
    course, hold = np.zeros((2, 10, 1)), (1, 0.0, 0)
    modes, laws, devices = np.ones((2, 1)), np.ones((4, 1)), np.zeros(1, np.int64)
    smallest().advance(course, forced, np.zeros((2, 1)), [hold], 0, modes, laws, devices)
