"""The motion of a chain of bodies by a one-step method, from plant step to plant step, and its growth if left alone."""

from __future__ import annotations

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.chain.history import ChainHistory, Interval
from haploop.plant.integrators.linear_rates import LinearRates, OneStep, response_to
from haploop.plant.integrators.registry import find_integrator
from haploop.plant.line import Hold
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase

# A run that diverges ends at the next tick. Until then bodies this fast are not moved: their squares would overflow.
_LOST_M_S = 1e50


class StepwiseMotion(ChainHistory):
    """z' = A z + B (command, friction, load) by ``clock.integrator``, every plant step by its formula.

    Command and friction are held over a plant step, the load is linear in it, as in the exact motion. The error is the
    method's own, and so is energy that no element took or gave: the books, which know the exact integrals from each
    state on, show this energy in their residual. Digits below the rounding of a float are not kept.
    """

    def __init__(self, scene: Scene, time: Timebase) -> None:
        super().__init__(scene, time)
        method = find_integrator(scene.clock.integrator).one_step()
        assert method
        self._method, self._rates = method, LinearRates(self.chain)
        self._of_command, _, self._of_load = self._rates.of_inputs
        self._step = method(self._rates, self._step_s).step

    def advance(self, tick: int, holds: list[Hold]) -> float:
        interval = self._begin(holds)
        self._fill_in(interval, self.loads(tick * self._n, (tick + 1) * self._n + 1))
        return self._accept(tick, interval)

    def _fill_in(self, interval: Interval, loads: np.ndarray) -> None:
        """Fills in the states; ``loads`` are those at every step and at the end, N."""
        load = np.stack([loads[:-1], (loads[:-1] + loads[1:]) / 2.0, loads[1:]])
        pushes = interval.held[:, 0, None] * self._of_command + load[:, :, None] * self._of_load
        step, v, z = self._step, self._v, self.state.z.tolist()
        states = []
        for begin, middle, end in zip(*pushes.tolist(), strict=True):
            if abs(z[v]) < _LOST_M_S:
                z = step(z, begin, middle, end)
            states.append(z)
        interval.states[1:], interval.comps[1:] = states, 0.0


def growth(scene: Scene) -> float:
    """Returns the factor by which the fastest growing motion of a scene's bodies, left alone, grows in a plant step.

    It is the spectral radius of the one-step matrix; above 1 the method is unstable whatever the controller does. A
    body that nothing holds drifts, which is not growth: its factor is 1. The scene must be resolved, its integrator a
    one-step method.
    """
    rates, method, step_s = _method_of(scene)
    size, still = len(rates.matrix), [0.0] * len(rates.matrix)
    scales = Chain.from_scene(scene).scales(step_s)[:size].astype(float)
    matrix = scales[:, None] * np.stack(method.step(list(np.eye(size)), still, still, still)) / scales
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def friction_brakes(scene: Scene) -> bool:
    """Tells whether a force on body 0 speeds it up in the force's direction over a plant step.

    If it does not, the step is too long.
    """
    rates, method, _ = _method_of(scene)
    return response_to(rates.of_inputs[1].tolist(), method)[rates.count] > 0.0


def _method_of(scene: Scene) -> tuple[LinearRates, OneStep, float]:
    step_s, rates = 1.0 / scene.clock.plant_rate, LinearRates(Chain.from_scene(scene))
    method = find_integrator(scene.clock.integrator).one_step()
    assert method
    return rates, method(rates, step_s), step_s
