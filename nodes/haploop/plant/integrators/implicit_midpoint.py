"""The implicit midpoint rule."""

from __future__ import annotations

import numpy as np

from haploop.plant.integrators.linear_rates import LinearRates, Rows, moved
from haploop.plant.integrators.registry import Integrator


class ImplicitMidpoint:
    """z+ = z + h z'((z + z+) / 2).

    With m = (z + z+) / 2 this is m = z + h/2 (A m + p), so m = (I - h/2 A)^-1 (z + h/2 p) and z+ = 2 m - z. Order 2,
    stable at every step, and every quadratic energy of undamped bodies is kept (Hairer, Lubich and Wanner 2006, IV.2);
    but a swing with w h > 1 is far too slow, its phase advances by 2 atan(w h / 2) and never by more than pi.
    """

    def __init__(self, rates: LinearRates, step_s: float) -> None:
        self._half = step_s / 2.0
        implicit = np.eye(len(rates.matrix)) - step_s / 2.0 * rates.matrix
        inverse = np.linalg.inv(implicit.astype(float)).astype(np.longdouble)
        inverse = 2.0 * inverse - inverse @ implicit @ inverse  # one step of Newton's, to the last digit
        self._inverse = inverse.astype(float).tolist()

    def step(self, z: Rows, _begin: Rows, middle: Rows, _end: Rows) -> Rows:
        pushed = moved(z, self._half, middle)
        means = [sum(factor * a for factor, a in zip(row, pushed, strict=True)) for row in self._inverse]
        return [2.0 * mean - a for mean, a in zip(means, z, strict=True)]


IMPLICIT_MIDPOINT = Integrator("implicit-midpoint", "one of the implicit midpoint rule, order 2", 2, ImplicitMidpoint)
