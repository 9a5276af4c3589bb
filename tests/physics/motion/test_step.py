"""One plant step is the exact solution over the step, to the last digits, whatever mass, damping and stiffness."""

from __future__ import annotations

import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from haploop.plant.motion.transition import (
    FohTransition,
    gramian,
    make_foh_transition,
    motion_integrals,
    natural_rate,
    transition_minus_identity,
)
from oracles.decimal_flow import flow_minus_identity

H = 1e-4
CRITICAL = 2 * np.sqrt(0.02 * 10.0)
CASES = {
    "paper": (0.02, 0.11, 10.0, H),
    "free": (0.02, 0.0, 0.0, H),
    "damped only": (0.02, 0.11, 0.0, H),
    "spring only": (0.02, 0.0, 10.0, H),
    "critical": (0.02, CRITICAL, 10.0, H),
    "almost critical": (0.02, CRITICAL * (1 + 1e-9), 10.0, H),
    "overdamped": (1e-3, 50.0, 10.0, H),
    "stiff": (1e-3, 0.1, 1e6, H),
    "stiff and overdamped": (1e-3, 100.0, 1e6, H),
    "slow": (10.0, 1e-6, 1e-9, H),
    "coarse step": (0.02, 0.11, 10.0, 0.1),
}
POSITIVE = st.floats(1e-3, 10.0)
systems = st.tuples(POSITIVE, st.floats(0.0, 20.0), st.floats(0.0, 2e4), st.sampled_from([1e-3, H, 1e-5]))


def coefficients(flow: FohTransition) -> np.ndarray:
    """Rows dx, dv over x, v, F(0), F(h) - F(0)."""
    f = flow
    return np.array([[f.x_x, f.x_v, f.x_force, f.x_slope], [f.v_x, f.v_v, f.v_force, f.v_slope]])


@pytest.mark.parametrize("case", CASES)
def test_every_coefficient_of_a_step_is_right_to_the_last_bits(case):
    """Against fifty digits; a coefficient is small beside others at times, and right all the same."""
    expected = flow_minus_identity(*CASES[case])
    flow = make_foh_transition(*CASES[case])
    for name, value in expected.items():
        assert getattr(flow, name) == pytest.approx(value, rel=4e-15, abs=0), name


@given(systems)
def test_a_step_is_what_the_matrix_exponential_says(system):
    mass, damping, stiffness, h = system
    scaled = np.array([[0, h, 0, 0], [-stiffness / mass * h, -damping / mass * h, h / mass, 0], [0, 0, 0, 1], [0] * 4])
    expected = expm(scaled)[:2] - np.eye(4)[:2]
    scale = np.abs(expm(scaled)[:2])
    assert np.abs(coefficients(make_foh_transition(*system)) - expected).max() <= 1e-12 * scale.max()


@given(systems, st.tuples(*[st.floats(-1.0, 1.0)] * 4))
def test_two_half_steps_are_one_step_where_the_force_is_a_straight_line(system, start):
    mass, damping, stiffness, h = system
    x, v, force, rise = start
    whole = coefficients(make_foh_transition(*system)) @ start
    half = coefficients(make_foh_transition(mass, damping, stiffness, h / 2))
    middle = np.array([x, v]) + half @ [x, v, force, rise / 2]
    end = middle + half @ [*middle, force + rise / 2, rise / 2]
    largest = np.abs(coefficients(make_foh_transition(*system))).sum(axis=1) + np.abs([x, v])
    assert np.all(np.abs(end - [x, v] - whole) <= 1e-14 * (largest + 1))


def test_simple_systems_step_as_their_textbook_solutions():
    """No forces at all; a damper alone; an undamped swing; the critical one."""
    free = make_foh_transition(0.02, 0.0, 0.0, H)
    assert (free.x_x, free.x_v, free.v_x, free.v_v) == (0.0, H, 0.0, 0.0)
    assert free.x_force == pytest.approx(H**2 / 0.04, rel=1e-15)
    assert free.x_slope == pytest.approx(H**2 / 0.12, rel=1e-15)
    damper = make_foh_transition(0.02, 0.11, 0.0, H)
    assert damper.v_v == pytest.approx(np.expm1(-0.11 * H / 0.02), rel=1e-15)
    swing = make_foh_transition(0.02, 0.0, 10.0, H)
    w = np.sqrt(500.0)
    assert swing.x_x == pytest.approx(-2 * np.sin(w * H / 2) ** 2, rel=1e-14)
    assert swing.x_v == pytest.approx(np.sin(w * H) / w, rel=1e-14)
    critical = make_foh_transition(0.02, CRITICAL, 10.0, H)
    assert critical.x_x == pytest.approx(np.expm1(-w * H) + w * H * np.exp(-w * H), rel=1e-11)
    assert critical.x_v == pytest.approx(H * np.exp(-w * H), rel=1e-14)


def motion(case: str, w: np.ndarray, t: np.ndarray) -> np.ndarray:
    """v(t) within a step, for every column of rates w = (v(0), a(0) / c, F' h / (m c)); shape (times, columns)."""
    mass, damping, stiffness, h = CASES[case]
    c = natural_rate(mass, stiffness, h)
    rates = np.array([[0, c, 0], [-stiffness / mass / c, -damping / mass, 1 / h], [0, 0, 0]])
    return np.stack([(expm(rates * at) @ w)[0] for at in t])


@pytest.mark.parametrize("case", [case for case in CASES if "stiff" not in case])
def test_heat_and_lag_are_what_quadrature_of_the_motion_gives(case):
    mass, damping, stiffness, h = CASES[case]
    square, lag = motion_integrals(mass, damping, stiffness, h)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    t, weights = h * (nodes + 1) / 2, h * weights / 2
    v = motion(case, np.eye(3), t)
    expected = np.einsum("t,ti,tj->ij", weights, v, v)
    assert np.abs(square - expected).max() <= 1e-13 * np.abs(expected).max()
    expected_lag = weights @ (v * ((t - h / 2) / h)[:, None])
    assert lag == pytest.approx(expected_lag, rel=1e-12, abs=1e-15 * h)


@pytest.mark.parametrize("case", ["stiff", "stiff and overdamped"])
def test_heat_of_a_stiff_step_is_what_adaptive_quadrature_gives(case):
    mass, damping, stiffness, h = CASES[case]
    square, _ = motion_integrals(mass, damping, stiffness, h)
    outer = lambda t: np.outer(*[motion(case, np.eye(3), np.array([t]))[0]] * 2)  # noqa: E731
    expected, _ = scipy.integrate.quad_vec(outer, 0, h, epsabs=0, epsrel=1e-12)
    assert np.abs(square - expected).max() <= 1e-11 * np.abs(expected).max()


@given(systems)
def test_the_heat_form_never_cools(system):
    """Its eigenvalues are not below 0, but for rounding."""
    square, _ = motion_integrals(*system)
    eigenvalues = np.linalg.eigvalsh(square.astype(float))
    assert eigenvalues.min() >= -1e-15 * eigenvalues.max()


def test_a_gramian_solves_its_lyapunov_equation():
    """A' W + W A = e^{A't} Q e^{At} - Q."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        a, q = rng.normal(size=(3, 3)) * 30, np.diag(rng.random(3))
        w = gramian(a, q, 0.05).astype(float)
        p = expm(a * 0.05)
        expected = p.T @ q @ p - q
        assert np.abs(a.T @ w + w @ a - expected).max() <= 1e-10 * np.abs(expected).max()


@pytest.mark.parametrize("fastest", [1e-3, 0.4, 30.0, 3000.0])
def test_all_halvings_of_a_step_at_once_have_the_bits_of_each_by_itself(fastest):
    rng, levels, duration = np.random.default_rng(5), np.array([7, 0, 3, 40]), np.longdouble(0.05)
    rates = rng.normal(size=(5, 5)).astype(np.longdouble) * fastest
    weights = np.stack([np.outer(row, row) for row in rng.normal(size=(2, 5))])
    moved, forms = (
        transition_minus_identity(rates, duration, levels),
        gramian(rates, weights, duration, levels),
    )
    assert np.array_equal(gramian(rates, weights[1], duration, levels), forms[:, 1])
    for level, of_this, form in zip(levels.tolist(), moved, forms, strict=True):
        lasts = duration / np.longdouble(2) ** level
        assert np.array_equal(of_this, transition_minus_identity(rates, lasts))
        assert np.array_equal(form, gramian(rates, weights, lasts))
