"""The motion by a one-step method of a chain whose first body sticks and slips."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.plant.chain.history import HELD, Interval
from haploop.plant.friction.law import Friction
from haploop.plant.friction.stick_slip import Mode
from haploop.plant.integrators.friction_projection import FrictionProjection
from haploop.plant.integrators.linear_rates import LinearRates
from haploop.plant.integrators.one_step import one_step
from haploop.plant.integrators.stepwise import StepwiseMotion
from haploop.protocol.ticks import Timebase


class StepwiseFrictionMotion(StepwiseMotion):
    """As without friction, every step projected onto what friction allows; see ``FrictionProjection``."""

    held_names = (*HELD, "friction", "stuck")

    def __init__(self, scene: dict[str, Any], time: Timebase) -> None:
        self._friction = Friction(scene["friction"])
        super().__init__(scene, time)
        free, clamped = (
            one_step(self._name, rates, self._step_s) for rates in (self._rates, LinearRates(self._chain, stuck=True))
        )
        self._projection = FrictionProjection(self._friction, free, clamped, self._rates)
        self._step = self._projection.step

    def _held_before(self) -> np.ndarray:
        mode = Mode(self._chain, self._friction, self._step_s)
        mode.start(self.z, float(self.loads(0, 1)[0]))
        return np.array([0.0, -1.0, mode.friction_at(self.z[self._v]), float(mode.is_stuck)])

    def _walk(self, interval: Interval, loads: np.ndarray) -> None:
        super()._walk(interval, loads)
        rows = self._projection.take_rows()
        interval.held[:, 2:] = 0.0
        interval.held[: len(rows), 2:], interval.at_ends[: len(rows)] = rows[:, :2], rows[:, 2:]
