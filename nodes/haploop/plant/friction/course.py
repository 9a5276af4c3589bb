"""The course of one run in which the first body of a chain sticks and slips, by a loop of machine code (numba).

All that is left of an interval is one call per tick: what the loop reads and writes stays in place from tick to tick.
"""

from __future__ import annotations

import numpy as np

from haploop.plant.chain import motion
from haploop.plant.chain.history import ChainState, StickSlipState
from haploop.plant.friction import loops, step_loop, stick_slip, substeps
from haploop.plant.friction.loops import Loops, row_of, walk
from haploop.plant.friction.stick_slip import Friction, StickSlip
from haploop.plant.line import Hold
from haploop.protocol.machine_code import MachineCode

_code = MachineCode(__file__, (motion, step_loop, stick_slip, substeps, loops))


@_code.compiled
def _advance(
    whole, mass_kg, speed_up, rows, tables, held, law, pieces, course, forced, loads, modes, holds, ends, room, count,
    row, at, first_step,
):  # pragma: no cover  # fmt: skip
    """Moves through an interval; returns x at its end, m, and whether there was room for its pieces."""
    n, size, before, end = forced.shape[2] - 1, forced.shape[3], pieces[-1, 0], 0
    some = course[row : row + n + 1]
    for i in range(count):
        begin, end = end, end + int(holds[i, 0])
        ends[i] = end
        for step in range(begin, end):
            some[step, 2 * size], some[step, 2 * size + 1] = holds[i, 1], holds[i, 2]
    rubs = stick_slip.Friction(law[0], law[1], law[2], law[3])
    of = StickSlip(rubs, whole[0], mass_kg[0], speed_up[0], row_of(rows[0], 0), row_of(rows[0], 1))
    mode = walk(
        of, substeps.Halving(whole[1], whole[2]), whole[3] > 0, (tables[0][0], tables[1][0]), held[0], forced[at],
        some, loads[at * n : (at + 1) * n + 1], ends[:count], first_step,
        StickSlipState(modes[0] > 0.0, modes[1]), pieces, room,
    )  # fmt: skip
    if pieces[-1, 0] >= len(pieces):
        pieces[-1, 0] = before
        return 0.0, False
    modes[0], modes[1] = mode.is_stuck, mode.direction
    return some[n, 0], True


class Course:
    """Intervals of one run, side by side in an array; every piece of the responses begins a new array.

    Attributes:
        row: row of the array at which the last interval ends; below 0 if a new array has to be begun.
    """

    def __init__(self, of: Loops, law: Friction, steps: int) -> None:
        self._of, self._n, self._size = of, steps, of.states
        self._modes, self._holds, self._ends = np.zeros(2), np.empty((steps, 3)), np.empty(steps, np.int64)
        self._system = of.cut, *of.devices, np.array(law), of.pieces
        self._array = np.empty((0, 0))
        self.row, self._taken = -1, 0

    def begin(self, state: ChainState, forced: np.ndarray, loads: np.ndarray) -> None:
        """Begins a new array; what the last one held has been taken.

        Args:
            forced: responses by interval, by whether body 0 is stuck, shape (intervals, 2, n + 1, states).
            loads: at all steps of these intervals and at their end, N.
        """
        size, mode = self._size, state.mode
        assert mode
        self._array = np.zeros((len(loads), 2 * size + 6))
        self._array[0, :size], self._array[0, size : 2 * size] = state.z, state.z_comp
        self._modes[:] = mode
        self._args = *self._system, self._array, forced, loads, self._modes, self._holds, self._ends, self._of.room
        self.row = self._taken = 0

    def advance(self, at: int, first_step: int, holds: list[Hold]) -> float | None:
        """Moves through the interval at place ``at`` of the piece that was begun; returns x at its end, m.

        Returns None if it switches too often for the loop; it must then be moved by other means.
        """
        for place, hold in enumerate(holds):
            self._holds[place] = hold
        x, has_room = _advance(*self._args, len(holds), self.row, at, first_step)
        if not has_room:
            return None
        self.row += self._n
        return x

    def take(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns the rows since the last call, their end included, and the pieces; none where none are new."""
        begin, pieces, self._taken = self._taken, self._of.pieces, self.row
        count, pieces[-1, 0] = int(pieces[-1, 0]), 0.0
        return self._array[begin : self.row + 1 if self.row > begin else begin], pieces[:count].copy()

    def end(self, sensed: tuple[float, ...]) -> ChainState:
        """Returns the state at the end of the last interval."""
        row, before, size = self._array[self.row], self._array[self.row - 1], self._size
        mode = StickSlipState(self._modes.item(0) > 0.0, self._modes.item(1))
        return ChainState(row[:size], row[size : 2 * size], before[2 * size : 2 * size + 4], sensed, mode)

    def interval(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the states, the held force and ``at_ends`` of the last interval, as in ``Interval``."""
        rows, size = self._array[self.row - self._n : self.row + 1], 2 * self._size
        return rows[:, : self._size], rows[:-1, size], rows[:-1, size + 4 :]


def is_made() -> bool:
    """Tells whether the loops were compiled before, on this processor, and only have to be loaded."""
    return loops.is_made() and _code.is_made()


def try_out() -> None:
    """Compiles all loops, or loads them; raises whatever numba raises."""
    loops.try_out()
    _code.try_out(_try_out)


def _try_out() -> None:
    course, one = Course(loops.smallest(), Friction(1.0, 1.0, 0.0, 1.0), 1), np.zeros(2)
    course.begin(ChainState(one, one, one, (), StickSlipState(True, 1.0)), np.zeros((1, 2, 2, 2)), one)
    course.advance(0, 0, [(1, 0.0, 0)])
