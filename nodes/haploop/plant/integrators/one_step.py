"""The one-step methods by name, and what the length of a plant step lets them do."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.integrators.linear_rates import LinearRates, OneStep, one_step_matrix, response_to


def one_step(name: str, rates: LinearRates, step_s: float) -> OneStep:
    """The method of this name, for steps of ``step_s``; no other is imported.

    Raises:
        KeyError: there is no one-step method of this name.
    """
    match name:
        case "euler":
            from haploop.plant.integrators.euler import Euler

            return Euler(rates, step_s)
        case "semi-implicit-euler":
            from haploop.plant.integrators.semi_implicit_euler import SemiImplicitEuler

            return SemiImplicitEuler(rates, step_s)
        case "rk4":
            from haploop.plant.integrators.rk4 import RungeKutta4

            return RungeKutta4(rates, step_s)
        case "implicit-midpoint":
            from haploop.plant.integrators.implicit_midpoint import ImplicitMidpoint

            return ImplicitMidpoint(rates, step_s)
    raise KeyError(name)


def growth(scene: dict[str, Any]) -> float:
    """What the fastest growing motion of a resolved scene's bodies is multiplied by in a plant step, left alone.

    It is the spectral radius of the one-step matrix; above 1 the method is unstable whatever the controller does. A
    body that nothing holds drifts, which is no growth: its factor is 1.
    """
    rates, method, step_s = _of(scene)
    size = len(rates.matrix)
    scales = Chain.of(scene).scales(step_s)[:size].astype(float)
    matrix = scales[:, None] * one_step_matrix(method, size) / scales
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def friction_brakes(scene: dict[str, Any]) -> bool:
    """Whether a force on body 0 has sped it up its own way by the end of a plant step; else the step is too long."""
    rates, method, _ = _of(scene)
    return response_to(rates.of_inputs[1].tolist(), method)[rates.count] > 0.0


def _of(scene: dict[str, Any]) -> tuple[LinearRates, OneStep, float]:
    """Rates, method and plant step in s of a resolved scene."""
    clock, rates = scene["clock"], LinearRates(Chain.of(scene))
    step_s = 1.0 / clock["plant_rate"]
    return rates, one_step(clock["integrator"], rates, step_s), step_s
