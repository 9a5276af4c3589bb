"""The classical Runge-Kutta method."""

from __future__ import annotations

from haploop.plant.integrators.linear_rates import LinearRates, Rows, moved
from haploop.plant.integrators.registry import Integrator


class RungeKutta4:
    """Four rates, at the beginning, twice in the middle and at the end, weighted 1 : 2 : 2 : 1 (Kutta 1901).

    Order 4. An undamped swing is stable up to w h = 2 sqrt(2); below that it loses a part (w h)^6 / 72 of its energy
    every step, which no damper took.
    """

    def __init__(self, rates: LinearRates, step_s: float) -> None:
        self._rates, self._h = rates, step_s

    def step(self, z: Rows, begin: Rows, middle: Rows, end: Rows) -> Rows:
        rates, h = self._rates, self._h
        k1 = rates.at(z, begin)
        k2 = rates.at(moved(z, h / 2.0, k1), middle)
        k3 = rates.at(moved(z, h / 2.0, k2), middle)
        k4 = rates.at(moved(z, h, k3), end)
        mean = [(a + 2.0 * (b + c) + d) / 6.0 for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
        return moved(z, h, mean)


RK4 = Integrator("rk4", "one of the classical Runge-Kutta method, order 4", 4, RungeKutta4, evaluations=4)
