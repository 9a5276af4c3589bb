"""The analytic bounds: their closed forms, how they stand to the exact limit, and where they do not apply."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from haploop.protocol.scene.paths import without
from haploop.protocol.scene.scene import ElementTable, Scene
from haploop.tools.linear.bounds import Bound, bounds_of
from haploop.tools.linear.one_tick import NeverStable, OneTickMap
from helpers.scenes.effect_tables import slowly
from helpers.scenes.least import scene
from helpers.scenes.linear_scenes import linear_scene

COLGATE, GIL, EXACT, ABBOTT = "Colgate & Schenkel 1997", "Gil et al. 2009", "Exact, no delay", "Abbott & Okamura 2005"
ENCODER = {"resolution": 1e-5}


def bound(made: Scene, name: str) -> Bound:
    return next(bound for bound in bounds_of(made) if bound.name == name)


def stiffness(name: str, **tables: Any) -> float:
    found = bound(scene(**tables), name)
    assert found.stiffness_N_m is not None, found.why_not
    return found.stiffness_N_m


def damped(b: float, virtual: float = 0.0, delay: float = 0.0, **tables: Any) -> dict[str, Any]:
    elements = [{"kind": "damping", "damping": virtual}] if virtual else []
    device = {"mass": 0.05, "damping": b}
    return {"device": device, "dissipation": elements, "clock": {"round_trip_delay": delay}, **tables}


@pytest.mark.parametrize(("b", "virtual"), [(0.1, 0.0), (0.3, 0.05), (0.3, 0.29), (2.0, 1.0)])
def test_a_spring_and_damper_is_passive_up_to_twice_what_damping_is_left_a_period(b: float, virtual: float) -> None:
    assert stiffness(COLGATE, **damped(b, virtual)) == pytest.approx(2.0 * (b - virtual) / 1e-3, rel=1e-7)


def test_more_virtual_damping_than_there_is_physical_is_not_passive_with_any_wall() -> None:
    assert stiffness(COLGATE, **damped(0.1, 0.11)) == 0.0


@pytest.mark.parametrize("ticks", [0, 1, 2, 5])
def test_a_delayed_spring_is_passive_up_to_the_damping_over_half_a_period_and_the_delay(ticks: int) -> None:
    """Re{...} is K (T/2) sin((L + 1/2) theta) / sin(theta / 2), greatest at theta = 0: K (T/2 + L T)."""
    expected = 0.2 / (0.5e-3 + ticks * 1e-3)
    assert stiffness(COLGATE, **damped(0.2, delay=ticks * 1e-3)) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("cutoff", [30.0, 150.0, 400.0])
def test_a_low_passed_damper_is_passive_by_its_own_closed_form(cutoff: float) -> None:
    """H = K + (B/T) g (1 - z^-1) / (1 - (1 - g) z^-1): the worst angle found on a grid of a million."""
    b, virtual, period_s = 0.3, 0.4, 1e-3
    gain = 1.0 - math.exp(-math.tau * cutoff * period_s)
    theta = np.linspace(1e-4, np.pi, 1_000_000)
    z = np.exp(1j * theta)
    h = virtual / period_s * gain * (1.0 - 1.0 / z) / (1.0 - (1.0 - gain) / z)
    left = b - (period_s / 2.0 / (1.0 - np.cos(theta)) * (1.0 - 1.0 / z) * h).real
    expected = max(0.0, 2.0 * left.min() / period_s)
    found = stiffness(COLGATE, **damped(b, virtual, velocity={"cutoff": cutoff}))
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_passivity_asks_nothing_of_the_hand_and_of_what_is_behind_the_motor() -> None:
    hand = {"mass": 0.1, "damping": 5.0, "stiffness": 300.0}
    cable = {"motor_mass": 0.01, "stiffness": 2e4, "damping": 0.5, "motor_damping": 0.3}
    assert stiffness(COLGATE, **damped(0.3, hand=hand)) == stiffness(COLGATE, **damped(0.3))
    assert stiffness(COLGATE, **damped(9.0, hand=hand, transmission=cable)) == stiffness(COLGATE, **damped(0.3))


@pytest.mark.parametrize("seed", [*range(15), *slowly(range(15, 40))])
def test_what_is_passive_is_stable_whatever_the_chain_behind_it(seed: int) -> None:
    made = without(linear_scene(seed), "actuator", "accelerometer", "velocity", "acceleration")
    delay = seed % 3 / made.clock.control_rate
    damping = ElementTable(name="damping", parameters={"damping": seed * 1e-3})
    made = replace(made, clock=replace(made.clock, round_trip_delay=delay), dissipation=(damping,))
    passive = bound(made, COLGATE).stiffness_N_m
    assert passive is not None
    assert passive > 0.0
    assert passive <= OneTickMap.from_scene(made).stiffness_limit() * (1.0 + 1e-6)


@pytest.mark.parametrize("ticks", [0, 2])
def test_passivity_is_tight_a_heavy_hand_makes_its_bound_the_limit(ticks: int) -> None:
    made = scene(**damped(0.3, delay=ticks * 1e-3, hand={"mass": 1000.0}))
    limit = OneTickMap.from_scene(made).stiffness_limit()
    assert bound(made, COLGATE).stiffness_N_m == pytest.approx(limit, rel=1e-4)


@pytest.mark.parametrize("virtual", [0.0, 0.02])
@pytest.mark.parametrize("delay_steps", [0, 3, 10, 25])
@pytest.mark.parametrize("b", [0.001, 0.01, 0.05, 0.2, 1.0])
def test_where_it_applies_the_bound_for_soft_walls_is_near_the_exact_limit(
    b: float, delay_steps: int, virtual: float
) -> None:
    made = scene(**damped(b, virtual, delay_steps * 1e-4, hand={"mass": 0.01, "damping": 0.01}))
    found = bound(made, GIL)
    simple = (b + 0.01 + virtual) / (0.5e-3 + delay_steps * 1e-4)
    limit = OneTickMap.from_scene(made).stiffness_limit()
    if found.applies:
        assert found.stiffness_N_m == pytest.approx(simple, rel=1e-12)
        assert found.stiffness_N_m == pytest.approx(limit, rel=0.1)
    else:
        assert "soft walls" in found.why_not


@pytest.mark.parametrize("b", [0.0, 1e-9, 1e-3, 0.0999, 0.1001, 0.5, 20.0, 60.0, 1e3])
@pytest.mark.parametrize("control_rate", [1000, 10_000])
def test_without_delay_the_exact_bound_is_the_limit_of_the_map(b: float, control_rate: int) -> None:
    made = scene(device={"mass": 0.01, "damping": b}, clock={"control_rate": control_rate})
    found = bound(made, EXACT).stiffness_N_m
    if b < 1e-6:
        assert found == pytest.approx(2.0 * b * control_rate, abs=1e-9)
        return
    try:
        assert found == pytest.approx(OneTickMap.from_scene(made).stiffness_limit(), rel=1e-8)
    except NeverStable:
        assert found is not None
        assert found < 1e-3


@pytest.mark.parametrize(
    ("b", "kinetic", "resolution", "expected"), [(0.1, 0.048, 28.7e-6, 200.0), (2.0, 0.01, 1e-5, 2000.0)]
)
def test_over_an_encoder_either_the_rate_or_the_friction_bounds(
    b: float, kinetic: float, resolution: float, expected: float
) -> None:
    encoder = {"resolution": resolution}
    found = stiffness(ABBOTT, **damped(b, encoder=encoder, friction={"kinetic": kinetic}))
    assert found == pytest.approx(expected, rel=1e-12)
    assert stiffness(ABBOTT, **damped(b, encoder=encoder)) == 0.0


@pytest.mark.parametrize(
    ("name", "tables", "why"),
    [
        (COLGATE, damped(0.1, delay=0.0013), "1.3 ms is not a whole number of ticks"),
        (COLGATE, damped(0.1, actuator={"bandwidth": 500.0}), "actuator lags"),
        (COLGATE, damped(0.1, acceleration={"source": "accelerometer"}), "accelerometer"),
        (COLGATE, {"dissipation": [{"kind": "unidirectional-inertia", "mass": 0.01}]}, "unidirectional-inertia"),
        (GIL, {"dissipation": [{"kind": "bidirectional-inertia", "mass": 0.01}]}, "bidirectional-inertia"),
        (GIL, damped(0.1, 0.1, velocity={"cutoff": 100.0}), "backward difference"),
        (GIL, damped(0.1, friction={"kinetic": 0.1}), "friction"),
        (GIL, {"device": {"mass": 0.01, "damping": 5.0}}, "soft walls"),
        (EXACT, damped(0.1, delay=0.001), "without delay"),
        (EXACT, damped(0.1, 0.1), "dissipation"),
        (EXACT, damped(0.1, hand={"stiffness": 1.0}), "spring"),
        (EXACT, damped(0.1, hand={"mass": 0.1, "grip": {"stiffness": 100.0}}), "single rigid mass"),
        (ABBOTT, damped(0.1), "encoder"),
        (ABBOTT, damped(0.1, encoder=ENCODER, noise={"deviation": 1e-6, "cutoff": 50.0}), "noisy"),
        (ABBOTT, damped(0.1, delay=0.001, encoder=ENCODER), "without delay"),
    ],
)
def test_outside_its_domain_a_bound_says_why_and_gives_no_number(name: str, tables: dict[str, Any], why: str) -> None:
    found = bound(scene(**tables), name)
    assert not found.applies
    assert found.stiffness_N_m is None
    assert why in found.why_not
    assert found.why_not.endswith(".")


def test_every_bound_names_its_source_formula_and_domain() -> None:
    for found in bounds_of(scene()):
        assert all((found.source, found.formula, found.domain))
        assert found.applies == (not found.why_not)
