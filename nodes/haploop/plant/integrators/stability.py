"""The growth of a one-step method's own motions, and whether its plant step is short enough for friction."""

from __future__ import annotations

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.integrators.linear_rates import LinearRates, OneStep, one_step_matrix, response_to
from haploop.plant.integrators.registry import find_integrator
from haploop.protocol.scene.scene import Scene


def growth(scene: Scene) -> float:
    """Returns the factor by which the fastest growing motion of a scene's bodies, left alone, grows in a plant step.

    It is the spectral radius of the one-step matrix; above 1 the method is unstable whatever the controller does. A
    body that nothing holds drifts, which is no growth: its factor is 1. The scene is resolved, its integrator a
    one-step method.
    """
    rates, method, step_s = _method_of(scene)
    size = len(rates.matrix)
    scales = Chain.from_scene(scene).scales(step_s)[:size].astype(float)
    matrix = scales[:, None] * one_step_matrix(method, size) / scales
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def friction_brakes(scene: Scene) -> bool:
    """Tells whether a force on body 0 speeds it up its own way over a plant step; else the step is too long."""
    rates, method, _ = _method_of(scene)
    return response_to(rates.of_inputs[1].tolist(), method)[rates.count] > 0.0


def _method_of(scene: Scene) -> tuple[LinearRates, OneStep, float]:
    """Returns rates, method and plant step in s of a resolved scene."""
    step_s, rates = 1.0 / scene.clock.plant_rate, LinearRates(Chain.from_scene(scene))
    method = find_integrator(scene.clock.integrator).method
    assert method
    return rates, method(rates, step_s), step_s
