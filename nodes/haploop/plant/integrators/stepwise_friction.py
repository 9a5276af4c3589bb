"""The motion by a one-step method of a chain whose first body sticks and slips."""

from __future__ import annotations

import numpy as np

from haploop.plant.chain.history import Interval
from haploop.plant.friction.stick_slip import Friction, RubbingHistory, friction_at, holds_against
from haploop.plant.integrators.linear_rates import LinearRates, OneStep, Rows, moved, response_to
from haploop.plant.integrators.stepwise import StepwiseMotion
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase


class FrictionProjection:
    """Friction held over the step, f = -clip(v_free / g, -most, most), as a one-step method around another.

    v_free is v of body 0 at the end of the step without friction, g what a unit of friction adds to that v by the
    method's own formula, so that the step is the method's own under f. ``most`` is F(v) by Stribeck's law at the
    beginning, the breakaway force at rest. Where f is enough, v is exactly 0.0; a body that was at rest stays, its x to
    the bit, and the rest of the chain follows the rates of the clamped system. Stops and starts fall on plant steps, so
    that every method, whatever its order, has an error of order h in their times.
    """

    def __init__(self, friction: Friction, free: OneStep, clamped: OneStep, rates: LinearRates) -> None:
        self._friction, self._free, self._clamped, self._v = friction, free, clamped, rates.count
        self._unit = unit = rates.of_inputs[1].tolist()
        self._response = response_to(unit, free)
        self._rows: list[tuple[float, float, float, float]] = []

    def step(self, z: Rows, begin: Rows, middle: Rows, end: Rows) -> Rows:
        v, law = self._v, self._friction
        after = self._free.step(z, begin, middle, end)
        stopping = after[v] / self._response[v]
        most = friction_at(law, z[v])
        if z[v] == 0.0:
            if holds_against(law, stopping):
                self._rows.append((0.0, 1.0, 0.0, 1.0))
                return self._clamped.step(z, self._held(begin), self._held(middle), self._held(end))
            most = law.holds_N
        friction = -max(-most, min(most, stopping))
        after = moved(after, friction, self._response)
        if stops := abs(stopping) <= most:
            after[v] = 0.0
        self._rows.append((friction, 0.0, 0.0 if stops else friction, float(stops)))
        return after

    def _held(self, push: Rows) -> Rows:
        """Returns the push together with the force that keeps body 0 from accelerating."""
        push = moved(push, -push[self._v] / self._unit[self._v], self._unit)
        push[self._v] = 0.0
        return push

    def take_rows(self) -> np.ndarray:
        """Returns friction in N and stuck (1.0 or 0.0) for every step since the last call: over it, then at its end."""
        rows = np.array(self._rows).reshape(-1, 4)
        self._rows = []
        return rows


class StepwiseFrictionMotion(RubbingHistory, StepwiseMotion):
    """One-step motion, every step projected onto what friction allows; see ``FrictionProjection``."""

    def __init__(self, scene: Scene, time: Timebase) -> None:
        super().__init__(scene, time)
        free, clamped = (
            self._method(rates, self._step_s) for rates in (self._rates, LinearRates(self.chain, stuck=True))
        )
        self._projection = FrictionProjection(self.friction, free, clamped, self._rates)
        self._step = self._projection.step

    def _fill_in(self, interval: Interval, loads: np.ndarray) -> None:
        super()._fill_in(interval, loads)
        rows = self._projection.take_rows()
        interval.held[:, 2:] = 0.0
        interval.held[: len(rows), 2:], interval.at_ends[: len(rows)] = rows[:, :2], rows[:, 2:]
