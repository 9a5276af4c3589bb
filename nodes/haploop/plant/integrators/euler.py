"""The Euler methods, explicit and semi-implicit (symplectic)."""

from __future__ import annotations

from haploop.plant.integrators.linear_rates import LinearRates, Rows, moved
from haploop.plant.integrators.registry import Integrator


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

    Order 1. For undamped bodies it is symplectic: up to w h = 2 their energy swings, by a part of w h, and stays; for
    a single oscillator v^2 + w^2 x^2 - w^2 h x v is kept (Hairer, Lubich and Wanner 2006, I.1.2 and IX.3).
    """

    def __init__(self, rates: LinearRates, step_s: float) -> None:
        self._rates, self._h = rates, step_s

    def step(self, z: Rows, begin: Rows, _middle: Rows, _end: Rows) -> Rows:
        n = self._rates.count
        after = moved(z, self._h, self._rates.at(z, begin))
        after[:n] = moved(z[:n], self._h, after[n : 2 * n])
        return after


EULER = Integrator("euler", "one of the explicit Euler method, order 1", 1, Euler)
SEMI_IMPLICIT_EULER = Integrator(
    "semi-implicit-euler", "one of the semi-implicit Euler method, order 1", 1, SemiImplicitEuler
)
