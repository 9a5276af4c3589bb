"""A loop in its builder's terms, against closed forms."""

import math

import pytest

from haploop.tools.linear.terms import limits_of, modes, one_count
from helpers.scenes.least import KINDS, scene

M, B, K, Q, T = 0.02, 0.3, 400.0, 1e-5, 1e-3
DEVICE = {"mass": M, "damping": B}
WALL = {"position": -0.01, "stiffness": K}
ENCODER = {"resolution": Q}


def limit(name: str, **tables):
    return next(found for found in limits_of(scene(**tables), KINDS) if found.name == name)


@pytest.mark.parametrize("hand", [{}, {"hand": {"mass": 0.1, "damping": 1.0, "stiffness": 80.0}}])
def test_one_mass_swings_at_the_root_of_stiffness_over_mass(hand):
    more = hand.get("hand", {"mass": 0.0, "damping": 0.0, "stiffness": 0.0})
    mass, damping, stiffness = M + more["mass"], B + more["damping"], K + more["stiffness"]
    [mode] = modes(scene(device=DEVICE, wall=WALL, **hand))
    assert mode.frequency_Hz == pytest.approx(math.sqrt(stiffness / mass) / (2.0 * math.pi), rel=1e-12)
    assert mode.damping_ratio == pytest.approx(damping / (2.0 * math.sqrt(stiffness * mass)), rel=1e-12)


def test_what_is_damped_beyond_its_critical_damping_does_not_swing():
    critical = 2.0 * math.sqrt(K * M)
    assert len(modes(scene(device={"mass": M, "damping": 0.99 * critical}, wall=WALL))) == 1
    assert modes(scene(device={"mass": M, "damping": 1.01 * critical}, wall=WALL)) == []
    assert modes(scene(device=DEVICE)) == []


def test_two_bodies_of_which_one_holds_the_other_swing_as_one_on_the_wall_and_against_each_other():
    stiff = {"motor_mass": M, "stiffness": 1e6}
    slow, fast = modes(scene(device={"mass": M, "damping": 0.0}, transmission=stiff, wall=WALL))
    assert slow.frequency_Hz == pytest.approx(math.sqrt(K / (2.0 * M)) / (2.0 * math.pi), rel=1e-3)
    assert fast.frequency_Hz == pytest.approx(math.sqrt(1e6 * 2.0 / M) / (2.0 * math.pi), rel=1e-3)


@pytest.mark.parametrize("occupies", ["below", "above"])
def test_one_count_is_q_and_its_differences_over_the_period(occupies):
    elements = [{"kind": "damping", "damping": 0.7}, {"kind": "unidirectional-inertia", "mass": 0.004}]
    found = one_count(scene(encoder=ENCODER, wall={**WALL, "occupies": occupies}, dissipation=elements), KINDS)
    assert found
    assert found.x_m == pytest.approx(Q, rel=1e-9)
    assert found.v_m_s == pytest.approx(Q / T, rel=1e-9)
    assert found.a_m_s2 == pytest.approx(Q / T**2, rel=1e-9)
    assert found.wall_N == pytest.approx(K * Q, rel=1e-9)
    assert found.elements_N == pytest.approx((0.7 * Q / T, 0.004 * Q / T**2), rel=1e-9)
    # Way out: the wall's force falls, and unidirectional inertia pushes while the device brakes.
    assert found.total_N >= K * Q + 0.7 * Q / T


@pytest.mark.parametrize(
    ("element", "total_N"),
    [
        (None, K * Q),
        ({"kind": "damping", "damping": 0.7}, K * Q + 0.7 * Q / T),
        ({"kind": "bidirectional-inertia", "mass": 0.004}, 2.0 * 0.004 * Q / T**2),
    ],
)
def test_the_forces_about_one_count_are_a_step_of_the_wall_and_what_elements_add_peak_to_peak(element, total_N):
    """A wall steps by K q; a damper adds b q / T for a tick; an inertia pushes by m q / T², then back by as much."""
    found = one_count(scene(encoder=ENCODER, wall=WALL, dissipation=[element] if element else []), KINDS)
    assert found
    assert found.total_N == pytest.approx(total_N, rel=1e-9)


def test_one_count_over_a_window_is_spread_over_it():
    ticks = 5
    found = one_count(scene(encoder=ENCODER, velocity={"estimator": "window", "ticks": ticks}), KINDS)
    assert found
    assert found.v_m_s == pytest.approx(Q / (ticks * T), rel=1e-9)
    assert one_count(scene(), KINDS) is None


def test_limits_are_those_of_their_formulas_and_a_reason_stands_where_one_does_not_speak():
    bare = {"device": DEVICE, "wall": WALL, "encoder": ENCODER}
    assert limit("Colgate & Schenkel 1997", **bare).stiffness_N_m == pytest.approx(2.0 * B / T, rel=1e-6)
    assert limit("Abbott & Okamura 2005", **bare, friction={"kinetic": 1e-3}).stiffness_N_m == pytest.approx(
        min(2.0 * B / T, 2.0 * 1e-3 / Q), rel=1e-12
    )
    exact = limit("rho(M) = 1", **bare)
    assert exact.stiffness_N_m == pytest.approx(limit("Exact, no delay", **bare).stiffness_N_m, rel=1e-9)
    assert [found.name for found in limits_of(scene(**bare), KINDS)][-1] == "rho(M) = 1"
    curved = {**bare, "dissipation": [{"kind": "unidirectional-inertia", "mass": 0.004}]}
    assert limit("rho(M) = 1", **curved).why_not == "The scene has the element unidirectional-inertia."
    assert limit("rho(M) = 1, wall alone", **curved).stiffness_N_m == exact.stiffness_N_m
    foaw = {**curved, "velocity": {"estimator": "foaw", "ticks": 16}}
    assert limit("rho(M) = 1, wall alone", **foaw).stiffness_N_m == exact.stiffness_N_m
    rough = limit("rho(M) = 1, no friction", **bare, friction={"kinetic": 1e-3})
    assert "rho(M) = 1" not in [found.name for found in limits_of(scene(**bare, friction={"kinetic": 1e-3}), KINDS)]
    assert (rough.stiffness_N_m, rough.why_not) == (exact.stiffness_N_m, "of the loop without [friction]")
    undamped = limit("rho(M) = 1", **bare | {"device": {"mass": M, "damping": 0.0}})
    assert undamped.stiffness_N_m is None
    assert "it needs damping" in undamped.why_not
