"""Exact transition of a linear mechanical system over a plant step, and the exact integrals for its energy books."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from haploop.protocol.arrays import each

Matrix = np.ndarray
Real = float | np.floating

# Coefficients are made once and used for every step, so their error adds up: they are computed in the widest float.
_wide = np.longdouble
_WHOLE = np.array(0)


def transition_minus_identity(rates: Matrix, duration: Real, levels: Matrix = _WHOLE) -> Matrix:
    """Returns e^{A t} - I, accurate in every entry however small A t is.

    With E = e^{A h} - I on a step so short that |A h| <= 1/2, the Taylor series converges in a few terms and loses
    nothing; the step is then doubled by e^{2 A h} - I = 2 E + E^2, which never subtracts the identity
    (Moler and Van Loan 2003, scaling and squaring, kept in the form of expm1).

    Args:
        rates: A, shape (n, n), 1/s.
        duration: 2^level t, s.
        levels: levels of t, shape (...). One series serves them all: for half the step its terms are the same times a
            power of 2, to the bit.

    Returns:
        Shape (..., n, n).
    """
    step, doublings = _short_step(rates, duration)
    term = scaled = rates * step
    shrunk = part = _parts(levels - doublings, scaled)
    increment = term * part
    for order in range(2, 24):
        term, shrunk = term @ scaled / order, shrunk * part
        increment = increment + term * shrunk
    doubled = _first(increment, levels, scaled)
    for level in range(doublings)[::-1]:
        doubled = 2.0 * doubled + doubled @ doubled
        increment = np.where(_beside(levels, scaled) <= level, doubled, increment)
    return increment


def gramian(rates: Matrix, weight: Matrix, duration: Real, levels: Matrix = _WHOLE) -> Matrix:
    """Returns W = integral over [0, t] of e^{A' s} Q e^{A s} ds.

    The step is halved until |A h| <= 1/2, and the result doubled back.
    On the short step W is a Taylor series in h: the k-th derivative of e^{A's} Q e^{As} at 0 is D_k with
    D_0 = Q, D_{k+1} = A' D_k + D_k A. Then W(2h) = W(h) + P' W(h) P with P = e^{A h}, P(2h) = P(h)^2. Each term added
    is positive semidefinite where Q is, so nothing cancels; the block exponential (Van Loan 1978) overflows instead.

    Args:
        rates: A, shape (n, n), 1/s.
        weight: Q, symmetric to the bit, shape (n, n), or several, shape (weights, n, n).
        duration: 2^level t, s.
        levels: levels of t, shape (...); see ``transition_minus_identity``.

    Returns:
        Shape (..., n, n), or (..., weights, n, n).
    """
    step, doublings = _short_step(rates, duration)
    scaled, derivative = rates * step, weight
    shrunk = part = _parts(levels - doublings, weight)
    total = weight * step * part
    for order in range(2, 34):
        moved = scaled.T @ derivative  # whose transpose is D A
        derivative, shrunk = (moved + moved.swapaxes(-1, -2)) / order, shrunk * part
        total = total + derivative * step * shrunk
    increment, doubled = transition_minus_identity(rates, step), _first(total, levels, weight)
    for level in range(doublings)[::-1]:
        moved = doubled @ increment
        doubled = 2.0 * doubled + moved + moved.swapaxes(-1, -2) + increment.T @ moved
        increment = 2.0 * increment + increment @ increment
        total = np.where(_beside(levels, weight) <= level, doubled, total)
    return (total + total.swapaxes(-1, -2)) / 2.0


def _short_step(rates: Matrix, duration: Real) -> tuple[Any, int]:
    """Returns a step for the series, and how often it is doubled up to the duration."""
    size = np.abs(rates * duration).sum(axis=1).max()
    doublings = max(0, int(np.ceil(np.log2(size))) + 1) if size > 0.5 else 0
    return duration / _wide(2) ** doublings, doublings


def _beside(levels: Matrix, of: Matrix) -> Matrix:
    """Returns ``levels`` with a further axis for each axis of ``of``, a matrix or several."""
    return levels.reshape(*levels.shape, *[1] * of.ndim)


def _parts(levels: Matrix, of: Matrix) -> Matrix:
    """Returns the fraction of the series' step that each finer level has; 1 at the other levels."""
    return _wide(0.5) ** np.maximum(_beside(levels, of), 0)


def _first(series: Matrix, levels: Matrix, of: Matrix) -> Matrix:
    """Returns the series at the least level: over its whole step, if it is doubled for that level."""
    return series.reshape(-1, *of.shape)[levels.argmin()]


class FohTransition(NamedTuple):
    """First-order-hold transition over one plant step of m a + b v + k x = F: F is linear over the step.

        dx = x_x x + x_v v + x_force F(0) + x_slope (F(h) - F(0))
        dv = v_x x + v_v v + v_force F(0) + v_slope (F(h) - F(0))

    It is the transition minus the identity, so that a small change keeps all its digits beside a large state. Every
    coefficient is a float; in a batch of members that differ, an array of shape (members,).
    """

    x_x: Any
    x_v: Any
    x_force: Any
    x_slope: Any
    v_x: Any
    v_v: Any
    v_force: Any
    v_slope: Any


def make_foh_transition(mass: Any, damping: Any, stiffness: Any, step_s: float) -> FohTransition:
    """Makes the exact transition over ``step_s`` seconds for mass in kg (> 0), damping in N s/m, stiffness in N/m."""

    def entries(mass: float, damping: float, stiffness: float) -> tuple[float, ...]:
        increment = _over_a_step(mass, damping, stiffness, step_s)
        return tuple(float(entry) for entry in _to_state(increment, mass, stiffness, step_s).ravel())

    return FohTransition(*each(entries, mass, damping, stiffness))


def make_zoh_transitions(mass: Any, damping: Any, stiffness: Any, step_s: float, steps: int) -> np.ndarray:
    """Makes the zero-order-hold transitions over 0, 1, 2 ... ``steps`` plant steps under a force that is held.

    E(i + 1) = E(i) + E(1) + E(1) E(i) for E = e^{A i h} - I, which never subtracts the identity.

    Returns:
        Shape (steps + 1, 6), row i for i steps, columns x_x, x_v, x_force, v_x, v_v, v_force; of a batch of members
        that differ shape (steps + 1, 6, members).
    """

    def rows(mass: float, damping: float, stiffness: float) -> np.ndarray:
        one = _over_a_step(mass, damping, stiffness, step_s)
        increment, rows = np.zeros_like(one), []
        for _ in range(steps + 1):
            rows.append(_to_state(increment, mass, stiffness, step_s)[:, :3].ravel().astype(float))
            increment = increment + one + one @ increment
        return np.array(rows)

    return each(rows, mass, damping, stiffness)


@lru_cache(maxsize=4096)
def _over_a_step(mass: float, damping: float, stiffness: float, step_s: float) -> Matrix:
    """Returns e^{A h} - I in the coordinates of ``_rates``."""
    return transition_minus_identity(_rates(mass, damping, stiffness, step_s), _wide(step_s))


def _rates(mass: float, damping: float, stiffness: float, step_s: float) -> Matrix:
    """Returns A for the state (c x, v, F h / m, rise of F over a step * h / m) with c = ``natural_rate``.

    In these coordinates every rate is at most about |A| and an undamped oscillation is a pure rotation.
    """
    h, c = _wide(step_s), _wide(natural_rate(mass, stiffness, step_s))
    rates = np.zeros((4, 4), _wide)
    rates[0, 1] = c
    rates[1] = -stiffness / mass / c, -damping / mass, 1.0 / h, 0.0
    rates[2, 3] = 1.0 / h
    return rates


def _to_state(increment: Matrix, mass: float, stiffness: float, step_s: float) -> Matrix:
    """Returns the rows of x and v in the coordinates (x, v, F, rise of F); shape (2, 4)."""
    h, c = _wide(step_s), _wide(natural_rate(mass, stiffness, step_s))
    return increment[:2] * np.array([c, _wide(1), h / mass, h / mass]) / np.array([[c], [_wide(1)]])


def natural_rate(mass: float, stiffness: float, step_s: float) -> float:
    """Returns c in 1/s, which makes c x comparable to v: the natural frequency, but at least 1 / step."""
    return max(math.sqrt(stiffness / mass), 1.0 / step_s)


def motion_integrals(mass: float, damping: float, stiffness: float, step_s: float) -> tuple[Matrix, Matrix]:
    """Returns the exact integrals over one step for heat and lagged displacement, from the rates at its start.

    The rates are w = (v(0), a(0) / c, F' h / (m c)).
    Differentiating m a + b v + k x = F once gives a linear system for w itself, w' = R w with v = w_0; F' is constant
    within a step and c is ``natural_rate``. In terms of rates nothing cancels when a large force holds the device at
    rest.

    Returns:
        In the widest float, (square, lag): integral of v(t)^2 dt = w' square w, shape (3, 3), s; and
        integral of (t - h/2) / h * v(t) dt = lag . w, shape (3,), s.
    """
    h, c = _wide(step_s), _wide(natural_rate(mass, stiffness, step_s))
    rates = np.zeros((3, 3), _wide)
    rates[0, 1] = c
    rates[1] = -stiffness / mass / c, -damping / mass, 1.0 / h
    square = gramian(rates, np.diag([_wide(1), _wide(0), _wide(0)]), h)
    # Two integrators on top of w, y' = v and z' = y / h, so that z(h) = integral of (h - t) / h * v dt.
    extended = np.zeros((5, 5), _wide)
    extended[:3, :3] = rates
    extended[3, 0] = 1.0
    extended[4, 3] = 1.0 / h
    increment = transition_minus_identity(extended, h)
    return square, increment[3, :3] / 2.0 - increment[4, :3]


def real_for(damping_rate: float, step_s: float) -> type[np.floating]:
    """Returns the float type in which to sum forms of rates; terms cancel in the ratio of step to time constant."""
    return np.longdouble if damping_rate * step_s > 100.0 else np.float64
