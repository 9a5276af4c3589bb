"""The explicit Euler method."""

from __future__ import annotations

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
