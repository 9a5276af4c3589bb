"""The one-step methods: the Euler methods, the implicit midpoint rule and the classical Runge-Kutta method."""

from __future__ import annotations

import numpy as np

from haploop.plant.integrators.linear_rates import LinearRates, Rows, moved


class Euler:
    """z+ = z + h z'(z).

    Order 1. An undamped swing of frequency w grows by sqrt(1 + (w h)^2) every step, whatever h; a damped one decays
    only for w h < 2 zeta (zeta its damping ratio, up to 1).
    """

    def __init__(self, rates: LinearRates, step_s: float) -> None:
        self._rates, self._h = rates, step_s

    def step(self, z: Rows, begin: Rows, _middle: Rows, _end: Rows) -> Rows:
        return moved(z, self._h, self._rates.at(z, begin))


class SemiImplicitEuler:
    """v+ = v + h a(x, v), x+ = x + h v+: lengths follow the rates that were just found.

    Order 1. For undamped bodies it is symplectic: up to w h = 2 their energy oscillates by a fraction w h, but does not
    drift; for a single oscillator v^2 + w^2 x^2 - w^2 h x v is kept (Hairer, Lubich and Wanner 2006, I.1.2 and IX.3).
    """

    def __init__(self, rates: LinearRates, step_s: float) -> None:
        self._rates, self._h = rates, step_s

    def step(self, z: Rows, begin: Rows, _middle: Rows, _end: Rows) -> Rows:
        n = self._rates.count
        after = moved(z, self._h, self._rates.at(z, begin))
        after[:n] = moved(z[:n], self._h, after[n : 2 * n])
        return after


class ImplicitMidpoint:
    """z+ = z + h z'((z + z+) / 2).

    With m = (z + z+) / 2 this is m = z + h/2 (A m + p), so m = (I - h/2 A)^-1 (z + h/2 p) and z+ = 2 m - z. Order 2,
    stable at every step, and every quadratic energy of undamped bodies is kept (Hairer, Lubich and Wanner 2006, IV.2);
    but a swing with w h > 1 is far too slow: its phase advances by 2 atan(w h / 2), never by more than pi.
    """

    def __init__(self, rates: LinearRates, step_s: float) -> None:
        self._half = step_s / 2.0
        implicit = np.eye(len(rates.matrix)) - step_s / 2.0 * rates.matrix
        inverse = np.linalg.inv(implicit.astype(float)).astype(np.longdouble)
        inverse = 2.0 * inverse - inverse @ implicit @ inverse  # one Newton step, to the last digit
        self._inverse = inverse.astype(float).tolist()

    def step(self, z: Rows, _begin: Rows, middle: Rows, _end: Rows) -> Rows:
        pushed = moved(z, self._half, middle)
        means = [sum(factor * a for factor, a in zip(row, pushed, strict=True)) for row in self._inverse]
        return [2.0 * mean - a for mean, a in zip(means, z, strict=True)]


class RungeKutta4:
    """Four rates, at the beginning, twice in the middle and at the end, weighted 1 : 2 : 2 : 1 (Kutta 1901).

    Order 4. An undamped swing is stable up to w h = 2 sqrt(2); below that it loses a fraction (w h)^6 / 72 of its
    energy every step, which no damper took.
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
