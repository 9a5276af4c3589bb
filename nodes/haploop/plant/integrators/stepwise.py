"""The motion of a chain of bodies by a one-step method, from plant step to plant step."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.plant.chain.history import ChainHistory, Interval
from haploop.plant.integrators.linear_rates import LinearRates
from haploop.plant.integrators.one_step import one_step
from haploop.plant.line.delay import Hold
from haploop.protocol.ticks import Timebase

# A run that diverges ends at the next tick. Until then bodies this fast stand still: their squares would overflow.
_LOST_M_S = 1e50


class StepwiseMotion(ChainHistory):
    """z' = A z + B (command, friction, load) by ``clock.integrator``, every plant step by its formula.

    The same problem as that of ``ChainMotion``: command and friction held over a plant step, load linear in it. What
    the method makes of it is its own, and so is energy that no element took or gave: the books, which know the exact
    integrals from each state on, show it in their residual. Digits below the rounding of a float are not kept.
    """

    def __init__(self, scene: dict[str, Any], time: Timebase) -> None:
        super().__init__(scene, time)
        self._name, self._rates = scene["clock"]["integrator"], LinearRates(self._chain)
        self._of_command, _, self._of_load = self._rates.of_inputs
        self._step = one_step(self._name, self._rates, self._step_s).step

    def advance(self, tick: int, holds: list[Hold]) -> None:
        """Move through interval ``tick`` under the forces held in it."""
        interval = self._begin(holds)
        self._walk(interval, self.loads(tick * self._n, (tick + 1) * self._n + 1))
        self._accept(tick, interval)

    def _walk(self, interval: Interval, loads: np.ndarray) -> None:
        """Fill in the states; ``loads`` at every step and at the end, N."""
        load = np.stack([loads[:-1], (loads[:-1] + loads[1:]) / 2.0, loads[1:]])
        pushes = interval.held[:, 0, None] * self._of_command + load[:, :, None] * self._of_load
        step, v, z = self._step, self._v, self.z.tolist()
        states = []
        for begin, middle, end in zip(*pushes.tolist(), strict=True):
            if abs(z[v]) < _LOST_M_S:
                z = step(z, begin, middle, end)
            states.append(z)
        interval.states[1:], interval.lows[1:] = states, 0.0
