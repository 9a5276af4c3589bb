"""The motion by DOP853 of a chain whose first body sticks and slips, event by event."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from haploop.plant.chain.history import Interval, StickSlipState
from haploop.plant.friction.stick_slip import RubbingHistory, decide_at_rest, friction_at, slipping_at
from haploop.plant.integrators.dop853 import Dop853Motion, Event, Rates, System
from haploop.plant.line import Hold
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase

_MOST_SWITCHES = 1000


class _Forces(NamedTuple):
    """A command in N, and a load of ``load`` N at time ``start`` that rises by ``slope`` N/s."""

    command: float
    load: float
    slope: float
    start: float

    def load_at(self, t: float) -> float:
        return self.load + self.slope * (t - self.start)


class Dop853FrictionMotion(RubbingHistory, Dop853Motion):
    """The motion without friction, restarted where friction switches: at events, found on the dense output.

    Slipping ends where v changes sign; there body 0 sticks, clamped with v = 0.0, if the other forces on it are
    within the breakaway force. Sticking ends where they exceed it. The books get one friction force a step, that of
    the part in which the body slips, so that the residual shows the steps within which friction switched.
    """

    def __init__(self, scene: Scene, time: Timebase) -> None:
        super().__init__(scene, time)
        self._clamped = System(self.chain, stuck=True)
        self._pull = (self.chain.accelerations()[0] * self.chain.masses_kg[0]).astype(float)

    def advance(self, tick: int, holds: list[Hold]) -> float:
        self._mode = self.state.mode
        return super().advance(tick, holds)

    def _through(self, interval: Interval, first: int, last: int, load: float, slope: float) -> None:
        """Moves through steps ``first`` ... ``last``, from one switch of friction to the next.

        Raises:
            ArithmeticError: friction switches again and again, with no time between.
        """
        v, end = self._v, last * self._step_s
        forces = _Forces(float(interval.held[first, 0]), load, slope, first * self._step_s)
        z, t = interval.states[first].copy(), forces.start
        interval.held[first:last, 2:] = 0.0, 1.0
        self._mode = decide_at_rest(self.stick_slip, self._mode, z, forces.command, load)
        for _ in range(_MOST_SWITCHES):
            begun = t
            z, t, has_ceased = self._piece(interval, z, t, last, forces)
            if has_ceased:
                z[v] = 0.0
                self._mode = self._after_switch(z, t, forces, moved=t > begun)
            if t >= end:
                break
        else:
            raise ArithmeticError(f"Friction switched {_MOST_SWITCHES} times in a plant step; raise clock.plant_rate.")
        friction = slipping_at(self.stick_slip, self._mode, z[v])
        interval.states[last], interval.at_ends[last - 1] = z, (friction, self._mode.is_stuck)

    def _after_switch(self, z: np.ndarray, t: float, forces: _Forces, moved: bool) -> StickSlipState:
        """Returns the mode after the present one has ceased; a slip that lasted no time counts as sticking."""
        mode = self._mode
        if mode.is_stuck:
            return StickSlipState(False, math.copysign(1.0, self._other_forces(t, z, forces)))
        if moved:
            return decide_at_rest(self.stick_slip, mode, z, forces.command, forces.load_at(t))
        return StickSlipState(True, mode.direction)

    def _piece(
        self, interval: Interval, z: np.ndarray, t: float, last: int, forces: _Forces
    ) -> tuple[np.ndarray, float, bool]:
        """Moves from time t in s to step ``last``, or to where the mode ceases; returns state, time, whether it did."""
        mode, h = self._mode, self._step_s
        steps = np.arange(int(t / h), last + 1)
        steps = steps[steps * h > t]
        rates, watched = self._sticking(forces) if mode.is_stuck else self._slipping(forces)
        found = self._solved(rates, (t, last * h), z, steps * h, [watched])
        states = np.reshape(found.y, (len(z), -1))  # solve_ivp gives an empty list where no step ends in the piece
        reached = steps[: states.shape[1]]
        interval.states[reached] = states.T
        for step, v in zip(reached.tolist(), states[self._v].tolist(), strict=True):
            interval.at_ends[step - 1] = slipping_at(self.stick_slip, mode, v), mode.is_stuck
        has_ceased = found.status == 1
        end = float(found.t_events[0][0]) if has_ceased else last * h
        if not mode.is_stuck:
            self._tell_friction(interval, int(steps[0]) - 1, min(math.ceil(end / h), last), float(z[self._v]))
        return (found.y_events[0][0] if has_ceased else states[:, -1]).copy(), end, has_ceased

    def _tell_friction(self, interval: Interval, first: int, last: int, v: float) -> None:
        """Records friction in the steps in which the body slips, as at their beginning; ``v`` is that of the first."""
        speeds = [v, *interval.states[first + 1 : last, self._v].tolist()]
        for step, speed in zip(range(first, last), speeds, strict=False):
            interval.held[step, 2:] = -self._mode.direction * friction_at(self.friction, speed), 0.0

    def _slipping(self, forces: _Forces) -> tuple[Rates, Event]:
        """Returns z' while body 0 slips, and what falls below 0 when it no longer slips: the speed in its direction."""
        law, v, direction = self.friction, self._v, self._mode.direction
        smooth, unit = self._free.under(*forces), -direction * self._free.of_friction
        return (lambda t, z: smooth(t, z) + friction_at(law, z[v]) * unit), _Event(lambda _t, z: direction * z[v])

    def _sticking(self, forces: _Forces) -> tuple[Rates, Event]:
        """Returns z' while body 0 is held, and what falls below 0 when it no longer is: what more it could hold."""
        most = self.friction.holds_N
        return self._clamped.under(*forces), _Event(lambda t, z: most - abs(self._other_forces(t, z, forces)))

    def _other_forces(self, t: float, z: np.ndarray, forces: _Forces) -> float:
        pull, size = self._pull, len(z)
        return float(pull[:size] @ z + pull[size] * forces.command + pull[size + 2] * forces.load_at(t))


@dataclass
class _Event:
    """An event of ``solve_ivp`` that ends the motion where the function falls below 0."""

    function: Event
    terminal: bool = True
    direction: float = -1.0

    def __call__(self, t: float, z: np.ndarray) -> float:
        return self.function(t, z)
