"""The motion of a chain whose first body sticks and slips."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.plant.chain.history import HELD, Interval
from haploop.plant.chain.motion import ChainMotion
from haploop.plant.friction.law import Friction
from haploop.plant.friction.stick_slip import Mode
from haploop.plant.friction.substeps import Walk
from haploop.plant.line.delay import Hold
from haploop.protocol.ticks import Timebase


class FrictionMotion(ChainMotion):
    """Exact flow between the instants at which friction switches, and these instants by halving the step.

    Body 0 slips in a direction +-1 under friction -direction F, or is stuck: then it is clamped, v is exactly 0.0 and
    x stays, while the rest of the chain follows the flow of the clamped system. It slips until v changes its sign;
    there it sticks if the other forces on it are within the breakaway force, else it slips where they pull. It is stuck
    until they exceed the breakaway force. An interval in which nothing switches is one linear motion, as without
    friction; any other, and every one of a scene too stiff or with too curved a law for that, is walked step by step.
    """

    held_names = (*HELD, "friction", "stuck")

    def __init__(self, scene: dict[str, Any], time: Timebase) -> None:
        self._friction = Friction(scene["friction"])
        super().__init__(scene, time)
        self._clamped = self._responses(time, stuck=True)
        self._walk.halve(self._free.flow, self._clamped.flow)

    def _held_before(self) -> np.ndarray:
        self._walk = Walk(self._chain, self._friction, self._step_s)
        mode = self.mode = self._walk.mode
        mode.start(self.z, float(self.loads(0, 1)[0]))
        return np.array([0.0, -1.0, mode.friction_at(self.z[self._v]), float(mode.is_stuck)])

    def advance(self, tick: int, holds: list[Hold]) -> None:
        """Move through interval ``tick`` under the forces held in it."""
        interval = self._begin(holds)
        loads = self.loads(tick * self._n, (tick + 1) * self._n + 1)
        step = 0
        while step < self._n:
            if self._walk.whole_steps:
                step = self._as_it_goes(interval, step, holds, tick, loads)
            if step < self._n:
                self._through(interval, step, tick, loads)
                step += 1
        self._accept(tick, interval)

    def _as_it_goes(self, interval: Interval, begin: int, holds: list[Hold], tick: int, loads: np.ndarray) -> int:
        """Follow the present mode from step ``begin`` on; returns the first step in which it does not hold."""
        mode = self.mode
        mode.decide_at_rest(interval.states[begin], interval.held[begin, 0], loads[begin])
        friction = self.slipping(mode)
        self._follow(interval, begin, holds, self._clamped if mode.is_stuck else self._free, tick, friction)
        interval.held[begin:, 2:] = interval.at_ends[begin:] = friction, mode.is_stuck
        goes_on = self.goes_on(interval, begin, friction, loads)
        return self._n if goes_on.all() else begin + int(goes_on.argmin())

    def slipping(self, mode: Mode) -> Any:
        """The friction force while the mode holds, the same at every speed, N."""
        return 0.0 if mode.is_stuck else -mode.direction * self._friction.kinetic_N

    def goes_on(self, interval: Interval, begin: int, friction: Any, loads: np.ndarray) -> np.ndarray:
        """Whether the mode holds throughout each step from ``begin`` on; of one loop or, on its last axis, of many."""
        mode, states, command = self.mode, interval.states.swapaxes(0, 1), interval.held[begin:, 0]
        starts, ends, load, end_load = states[:, begin:-1], states[:, begin + 1 :], loads[begin:-1], loads[begin + 1 :]
        goes_on = mode.goes_on(ends, command, end_load)
        if mode.is_stuck:
            goes_on &= mode.goes_on(starts, command, load)
        return goes_on & ~mode.may_pause(starts, ends, command, load, end_load, friction, 1.0)

    def _through(self, interval: Interval, step: int, tick: int, loads: np.ndarray) -> None:
        """Through one step, whatever happens in it."""
        states, lows, held, at_ends = interval
        load, rise = float(loads[step]), float(loads[step + 1] - loads[step])
        through = self._walk.through(tick * self._n + step, states[step], lows[step], float(held[step, 0]), load, rise)
        states[step + 1], lows[step + 1], held[step, 2], held[step, 3] = through
        at_ends[step] = self.mode.friction_at(states[step + 1, self._v]), self.mode.is_stuck

    def take_record(self, tick: int) -> dict[str, np.ndarray]:
        """As without friction; the pieces of the steps within which friction switched come beside, ``pieces.*``."""
        return super().take_record(tick) | self.take_pieces()

    def take_pieces(self) -> dict[str, np.ndarray]:
        """The pieces of steps since the last call; see ``Walk.take_pieces``."""
        return self._walk.take_pieces()

    def take_interval(self) -> Interval:
        """The last interval, which is then in no record."""
        return self._intervals.pop()
