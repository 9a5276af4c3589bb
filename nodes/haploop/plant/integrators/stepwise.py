"""The motion of a chain of bodies by a one-step method, from plant step to plant step."""

from __future__ import annotations

import numpy as np

from haploop.plant.chain.history import ChainHistory, Interval
from haploop.plant.integrators.linear_rates import LinearRates
from haploop.plant.integrators.registry import find_integrator
from haploop.plant.line.base import Hold
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase

# A run that diverges ends at the next tick. Until then bodies this fast stand still: their squares would overflow.
_LOST_M_S = 1e50


class StepwiseMotion(ChainHistory):
    """z' = A z + B (command, friction, load) by ``clock.integrator``, every plant step by its formula.

    Command and friction are held over a plant step, the load is linear in it, as in the exact motion. What the method
    makes of it is its own, and so is energy that no element took or gave: the books, which know the exact integrals
    from each state on, show it in their residual. Digits below the rounding of a float are not kept.
    """

    def __init__(self, scene: Scene, time: Timebase) -> None:
        super().__init__(scene, time)
        method = find_integrator(scene.clock.integrator).method
        assert method
        self._method, self._rates = method, LinearRates(self.chain)
        self._of_command, _, self._of_load = self._rates.of_inputs
        self._step = method(self._rates, self._step_s).step

    def advance(self, tick: int, holds: list[Hold]) -> float:
        """Moves through interval ``tick`` under the forces held in it; returns x at its end, m."""
        interval = self._begin(holds)
        self._fill_in(interval, self.loads(tick * self._n, (tick + 1) * self._n + 1))
        return self._accept(tick, interval)

    def _fill_in(self, interval: Interval, loads: np.ndarray) -> None:
        """Fills in the states; ``loads`` at every step and at the end, N."""
        load = np.stack([loads[:-1], (loads[:-1] + loads[1:]) / 2.0, loads[1:]])
        pushes = interval.held[:, 0, None] * self._of_command + load[:, :, None] * self._of_load
        step, v, z = self._step, self._v, self.state.z.tolist()
        states = []
        for begin, middle, end in zip(*pushes.tolist(), strict=True):
            if abs(z[v]) < _LOST_M_S:
                z = step(z, begin, middle, end)
            states.append(z)
        interval.states[1:], interval.comps[1:] = states, 0.0
