"""Device and hand of many loops at once, moved by the exact flow of each."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from haploop.plant.motion.one_mass import LinearMotion, change_over
from haploop.plant.motion.transition import HeldFlow
from haploop.protocol.arrays import rows_of
from haploop.protocol.ticks import Timebase

# Where every loop has a response of its own to the hand, fewer intervals of it are made at a time.
_PIECE_TICKS = 8


class LinearMotionArray(LinearMotion):
    """``LinearMotion`` with an array over many loops in place of every number; ``advance`` is the same code.

    All loops have their holds cut alike: one delay, which does not change.

    Args:
        scene: a stacked scene, whose numbers are floats, or arrays of shape (loops,).
        time: the integers all loops share.

    Attributes:
        x, v: position in m and velocity in m/s at the end of the last interval, shape (loops,).
    """

    _rows = staticmethod(list)

    def __init__(self, scene: dict[str, Any], time: Timebase) -> None:
        super().__init__(scene, time)
        loops, coefficients = scene["loops"], self._held.coefficients
        load = self._load(0) + self._spring_at_origin_N
        if coefficients.ndim > 2 or len(load) > 1:
            self._piece_ticks = _PIECE_TICKS
        if coefficients.ndim == 2:
            self._held = HeldFlow(coefficients[..., None])
        self.x, self.v = (np.full(loops, start) for start in self._mechanics.start)
        self._x_low, self._v_low = np.zeros((2, loops))

    def _load(self, step: int) -> Any:
        return self._tau.at_steps(step, step + 1)[0]

    def take_record(self, tick: int) -> dict[str, np.ndarray]:
        """As of one loop: x, v, x_low and force of shape (steps + 1, loops), and ``command``, shared by all loops.

        Beside them ``held_N``: the force of every hold, shape (holds, loops).
        """
        holds = self._take_holds(tick)
        x, v, x_low, force = (holds[0].column() for _ in range(4))
        for hold in holds:
            dx, dv = hold.changes(0), hold.changes(1)
            at_x = hold.fill(x, hold.x, np.add, hold.x, dx)
            hold.fill(v, hold.v, np.add, hold.v, dv)
            hold.fill(x_low, hold.x_low, np.subtract, dx, at_x - hold.x)
            hold.fill(force, hold.force, np.positive, hold.force)
        x[-1], v[-1], x_low[-1], force[-1] = self.x, self.v, self._x_low, self.force
        return {"x": x, "v": v, "x_low": x_low, "force": force} | self._held_in(holds)

    def take_positions(self, tick: int) -> dict[str, np.ndarray]:
        """``take_record`` without v, x_low and force."""
        holds = self._take_holds(tick)
        x = holds[0].column()
        for hold in holds:
            hold.fill(x, hold.x, np.add, hold.x, hold.changes(0))
        x[-1] = self.x
        return {"x": x} | self._held_in(holds)

    def _take_holds(self, tick: int) -> list[Holds]:
        starts, self._starts = self._starts, []
        width, loops = 6 * len(self._cuts), len(self.x)
        response = self._between(tick, len(starts) // width)
        holds = []
        for index, (first, count) in enumerate(self._cuts):
            x, x_low, v, v_low, force = (rows_of(starts[6 * index + i :: width], loops)[:, None] for i in range(5))
            command = np.array(starts[6 * index + 5 :: width], float)
            held = self._held.coefficients[:count]
            holds.append(Holds(first, held, response, x, x_low, v, v_low, force, command))
        return holds

    def _held_in(self, holds: list[Holds]) -> dict[str, np.ndarray]:
        command = np.repeat([hold.command for hold in holds], [len(hold.held) for hold in holds], axis=0).T
        forces = np.concatenate([hold.force[:, 0] for hold in holds])
        return {"command": np.append(command, self.command), "held_N": forces}


class Holds(NamedTuple):
    """The i-th hold of every interval of a block, of all loops.

    Attributes:
        first: its first plant step in an interval.
        held: coefficients over its steps, shape (steps, 6, 1 or loops).
        response: D in the intervals, shape (ticks, n, 2, 1 or loops).
        x, x_low, v, v_low, force: where it begins and what is held, shape (ticks, 1, loops).
        command: the commands in effect, shape (ticks,).
    """

    first: int
    held: np.ndarray
    response: np.ndarray
    x: np.ndarray
    x_low: np.ndarray
    v: np.ndarray
    v_low: np.ndarray
    force: np.ndarray
    command: np.ndarray

    @property
    def _known(self) -> int:
        """How many of its steps begin with a known state: an interval begins where the one before ended."""
        return int(self.first == 0)

    @property
    def _during(self) -> slice:
        return slice(self.first + self._known, self.first + len(self.held))

    def changes(self, state: int) -> np.ndarray:
        """What its steps, but for a known one, add to x (0) or v (1)."""
        held, response = self.held[self._known :, 3 * state : 3 * state + 3], self.response[:, self._during, state]
        return change_over(held, response, self.x, self.v, self.force, self.v_low if state else self.x_low)

    def column(self) -> np.ndarray:
        """Room for a state at every step of the block and at its end."""
        ticks, n = self.response.shape[:2]
        return np.empty((ticks * n + 1, self.x.shape[-1]))

    def fill(self, column: np.ndarray, begin: np.ndarray, ufunc: np.ufunc, *of: Any) -> np.ndarray:
        """Put ``begin`` where it is known and ``ufunc(*of)`` elsewhere; returns the latter, as they lie there."""
        intervals = column[:-1].reshape(*self.response.shape[:2], -1)
        if self._known:
            intervals[:, :1] = begin
        return ufunc(*of, out=intervals[:, self._during])
