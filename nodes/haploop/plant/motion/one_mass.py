"""The state of device and hand, moved by the exact flow from one change of force to the next."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from itertools import accumulate
from typing import Any

import numpy as np

from haploop.plant.line.delay import Hold
from haploop.plant.motion.hand_force import hand_force
from haploop.plant.motion.mechanics import Mechanics
from haploop.plant.motion.transition import HeldFlow, StepFlow
from haploop.protocol.ticks import Timebase

# Responses to the hand are made for this many intervals at a time, on a fixed grid.
_PIECE_TICKS = 256
RECORD = ("x", "v", "x_low", "force", "command")


class LinearMotion:
    """m a + b v + k x = f + tau + k x_rest, f held, tau piecewise linear between plant steps.

    The motion is a sum: z = y + D. D is the response to tau and the spring's rest from zero at the start of an
    interval; it does not depend on the controller and is made beforehand for every plant step. y starts as z and
    follows the held forces: over a hold of i steps y+ = y + (e^{A i h} - I) y + (integral of e^{A s} ds) f / m.
    So a hold costs one step whatever its length, and the plant steps within it are filled in when they are recorded.

    The state is a float and the rounding it left over (compensated addition), so that neither slow motion nor a long
    run loses what a single interval adds.

    Attributes:
        x, v: position in m and velocity in m/s at the end of the last interval.
    """

    # How the rows of an array are to be used, one by one.
    _rows = staticmethod(np.ndarray.tolist)

    def __init__(self, scene: dict[str, Any], time: Timebase) -> None:
        self._mechanics = m = Mechanics.of(scene)
        self._steps = time.steps_per_tick
        self._held = HeldFlow.of(m.mass_kg, m.damping, m.stiffness, time.step_s, self._steps)
        self._over = self._held.by_count()
        self._step = StepFlow.of(m.mass_kg, m.damping, m.stiffness, time.step_s)
        self._tau = hand_force(scene, time.plant_rate)
        self._spring_at_origin_N = m.stiffness * m.rest_m
        self._pieces: dict[int, np.ndarray] = {}
        self._piece_ticks = _PIECE_TICKS
        self._response: list[list[float]] = []
        self._response_first = self._response_end = 0
        self.x, self.v = m.start
        self._x_low = self._v_low = 0.0
        late = time.delay_steps % self._steps
        self._cuts = [(0, late), (late, self._steps - late)] if late else [(0, self._steps)]
        self._starts: list[float] = []
        self._parts: list[tuple[list[tuple[int, int]], list[float]]] = []
        self._last: Hold = (0, 0.0, -1)

    def advance(self, tick: int, holds: list[Hold]) -> None:
        """Move through interval ``tick`` under the forces held in it."""
        if tick >= self._response_end:
            self._respond_from(tick)
        x, v, x_low, v_low = self.x, self.v, self._x_low, self._v_low
        drive_x, drive_v = self._response[tick - self._response_first]
        last = holds[-1]
        for hold in holds:
            count, force, command = hold
            self._starts += (x, x_low, v, v_low, force, command)
            x_x, x_v, x_force, v_x, v_v, v_force = self._over[count]
            dx = x_x * x + x_v * v + x_force * force + x_low
            dv = v_x * x + v_v * v + v_force * force + v_low
            if hold is last:
                dx += drive_x
                dv += drive_v
            next_x, next_v = x + dx, v + dv
            x_low, v_low = dx - (next_x - x), dv - (next_v - v)
            x, v = next_x, next_v
        self.x, self.v, self._x_low, self._v_low = x, v, x_low, v_low
        self._last = last

    def _respond_from(self, tick: int) -> None:
        """What tau adds to x and v over each of the next intervals."""
        piece = tick // self._piece_ticks
        self._response_first, self._response_end = piece * self._piece_ticks, (piece + 1) * self._piece_ticks
        self._response = self._rows(self._responses(piece)[:, -1])

    def _responses(self, piece: int) -> np.ndarray:
        """D at the steps of the intervals of a piece, from each interval's start; shape (intervals, n + 1, 2)."""
        if piece not in self._pieces:
            if len(self._pieces) > 8:
                self._pieces.clear()
            self._pieces[piece] = self._make_responses(piece)
        return self._pieces[piece]

    def _make_responses(self, piece: int) -> np.ndarray:
        n, ticks = self._steps, self._piece_ticks
        first = piece * ticks * n
        force = self._tau.at_steps(first, first + ticks * n + 1) + self._spring_at_origin_N
        start, rise = (rows.reshape(ticks, n, *force.shape[1:]) for rows in (force[:-1], np.diff(force, axis=0)))
        states = list(self._driven(start.swapaxes(0, 1), rise.swapaxes(0, 1)))
        response = np.zeros((ticks, n + 1, 2, *states[0][0].shape[1:]))
        for i, (x, v) in enumerate(states, 1):
            response[:, i, 0], response[:, i, 1] = x, v
        return response

    def _driven(self, start: Any, rise: Any) -> Iterator[tuple[Any, Any]]:
        """D at every step of intervals but their start, from the load at the start of each step and its rise over it.

        Args:
            start, rise: N, shape (n, intervals); both and what is yielded may have a last axis for many loops.

        Yields:
            What is added to x and v, shape (intervals,) each.
        """
        s = self._step
        push_x, push_v = s.x_force * start + s.x_slope * rise, s.v_force * start + s.v_slope * rise
        x = v = push_x[0] - push_x[0]
        for i in range(self._steps):
            x, v = x + (s.x_x * x + s.x_v * v + push_x[i]), v + (s.v_x * x + s.v_v * v + push_v[i])
            yield x, v

    def acceleration(self, tick: int) -> float:
        """Acceleration at ``tick``, the present one, under the force held over the step that ends there, m/s^2."""
        m, load = self._mechanics, self._load(tick * self._steps)
        return (self.force + load - m.damping * self.v - m.stiffness * (self.x - m.rest_m)) / m.mass_kg

    def _load(self, step: int) -> Any:
        """tau at a step, N."""
        return float(self._tau.at_steps(step, step + 1)[0])

    # The record of every plant step

    @property
    def force(self) -> float:
        """The force held last, N; 0 before the first command."""
        return self._last[1]

    @property
    def command(self) -> int:
        """Tick of the command in effect last; -1 before the first."""
        return self._last[2]

    def take_record(self, tick: int) -> dict[str, np.ndarray]:
        """x, v, x_low, force, command at every plant step from interval ``tick`` on and at the end; starts anew.

        The end is the present state itself.
        """
        parts = [*self._parts, (self._cuts, self._starts)]
        self._parts, self._starts = [], []
        filled = []
        for cuts, starts in parts:
            filled.append(self._filled(tick, cuts, starts))
            tick += len(filled[-1][0])
        end = self.x, self.v, self._x_low, self.force, self.command
        return {
            name: np.concatenate([*(column.ravel() for column in columns), [last]])
            for name, last, *columns in zip(RECORD, end, *filled, strict=True)
        }

    def cut_as(self, counts: tuple[int, ...]) -> None:
        """From the next interval on the holds have these numbers of steps."""
        self._parts.append((self._cuts, self._starts))
        firsts = accumulate(counts, initial=0)
        self._cuts, self._starts = list(zip(firsts, counts, strict=False)), []

    def _filled(self, tick: int, cuts: list[tuple[int, int]], of_holds: list[float]) -> list[np.ndarray]:
        """The record of a part, from interval ``tick`` on and without its end; shape (intervals, n) each.

        Step i of a hold that began at y is y plus the flow of i steps, plus D. Every interval of a part is cut alike,
        so the i-th holds of all its intervals are filled in at once.
        """
        starts = np.frombuffer(array("d", of_holds)).reshape(-1, len(cuts), 6)
        ticks = len(starts)
        columns = [np.empty((ticks, self._steps)) for _ in RECORD]
        response = self._between(tick, ticks)
        for index, (first, count) in enumerate(cuts):
            x, x_low, v, v_low, force, command = (entry[:, None] for entry in starts[:, index].T)
            known = not first  # the state itself, as it stood at the end of the interval before
            during, held = slice(first + known, first + count), self._held.coefficients[known:count]
            dx = change_over(held[:, :3], response[:, during, 0], x, v, force, x_low)
            dv = change_over(held[:, 3:], response[:, during, 1], x, v, force, v_low)
            at_x = x + dx
            rows = at_x, v + dv, dx - (at_x - x), force, command
            for column, row, begin in zip(columns, rows, (x, v, x_low, force, command), strict=True):
                column[:, during] = row
                if known:
                    column[:, :1] = begin
        return columns

    def _between(self, tick: int, ticks: int) -> np.ndarray:
        """D at the steps of some intervals, their ends left out; shape (ticks, n, 2)."""
        first, last = tick // self._piece_ticks, max(tick, tick + ticks - 1) // self._piece_ticks
        pieces = [self._responses(piece) for piece in range(first, last + 1)]
        joined = pieces[0] if len(pieces) == 1 else np.concatenate(pieces)
        start = tick - first * self._piece_ticks
        return joined[start : start + ticks, :-1]


def change_over(held: Any, response: Any, x: Any, v: Any, force: Any, low: Any) -> Any:
    """What the plant steps of holds add to a state, from the beginning of each hold, one hold an interval.

    Args:
        held: coefficients of x, v and force over these steps, shape (steps, 3).
        response: the state's D at these steps of every interval, shape (intervals, steps).
        x, v: at the beginning of every hold, shape (intervals, 1).
        force: held, N, shape (intervals, 1).
        low: what rounding left of the state at the beginning, shape (intervals, 1).

    Returns:
        Shape (intervals, steps); all shapes may have one more axis, for many loops.
    """
    return held[:, 0] * x + held[:, 1] * v + held[:, 2] * force + low + response
