"""The largest stable stiffness: against its closed form, an independent map, and what runs on either side come to."""

from __future__ import annotations

import math
from decimal import Decimal
from typing import Any

import pytest

from haploop.launch.runs.in_process import run_in_process
from haploop.tools.linear.one_tick import NeverStable, NotLinear, OneTickMap
from haploop.tools.linear.stiffness_limit import StiffnessLimit, pressed_deep, stiffness_limit
from helpers.scenes.least import KINDS, scene
from oracles.chain_map import ChainLoop
from oracles.one_tick_map import LinearLoop

CABLE = {"motor_mass": 0.01, "stiffness": 2e4, "damping": 0.5, "motor_damping": 0.05}
HAND = {"mass": 0.05, "damping": 0.4, "stiffness": 20.0, "grip": {"stiffness": 800.0, "damping": 3.0}}


def limit_of(**tables: Any) -> float:
    return OneTickMap.from_scene(scene(**tables)).stiffness_limit()


@pytest.mark.parametrize(("mass", "damping"), [(0.01, 0.1), (0.0525, 0.0114), (0.02, 5.0)])
@pytest.mark.parametrize("control_rate", [500, 1000, 10_000])
def test_without_delay_the_limit_is_its_closed_form(mass: float, damping: float, control_rate: int) -> None:
    """K = (1 - E) / g0, E = e^(-b T / m), g0 = ((m/b)(1 - E) - T E) / b, in decimals, since it cancels in floats."""
    m, b, period_s = Decimal(mass), Decimal(damping), 1 / Decimal(control_rate)
    e = (-b * period_s / m).exp()
    expected = float((1 - e) / (((m / b) * (1 - e) - period_s * e) / b))
    device = {"mass": mass, "damping": damping}
    assert limit_of(device=device, clock={"control_rate": control_rate}) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("delay_steps", [0, 3, 10, 13, 20, 50])
@pytest.mark.parametrize("virtual_damping", [0.0, 0.1])
def test_with_delay_the_limit_is_that_of_an_independent_map(delay_steps: int, virtual_damping: float) -> None:
    theirs = LinearLoop(0.02, 0.11, 10.0, delay_steps=delay_steps, virtual_damping=virtual_damping)
    ours = limit_of(
        clock={"round_trip_delay": delay_steps * 1e-4},
        hand={"mass": 0.01, "damping": 0.01, "stiffness": 10.0},
        dissipation=[{"kind": "damping", "damping": virtual_damping}],
    )
    assert ours == pytest.approx(theirs.critical_stiffness(), rel=1e-9)


@pytest.mark.parametrize("delay", [0.0, 0.0013, 0.002])
def test_bodies_in_a_row_with_a_slow_actuator_have_the_map_of_their_own_equations(delay: float) -> None:
    made = scene(clock={"round_trip_delay": delay}, transmission=CABLE, hand=HAND, actuator={"bandwidth": 400.0})
    ours, theirs = OneTickMap.from_scene(made), ChainLoop.of(made)
    for stiffness in (1.0, 100.0, 1e4):
        assert ours.growth(stiffness) == pytest.approx(theirs.growth(stiffness), abs=1e-11)


def test_the_limit_is_where_growth_begins() -> None:
    loop = OneTickMap.from_scene(scene())
    limit = loop.stiffness_limit()
    assert loop.growth(limit) < 1.0 <= loop.growth(math.nextafter(limit, math.inf))
    assert loop.growth(0.97 * limit) < 1.0 < loop.growth(1.03 * limit)


@pytest.mark.parametrize("delay", [0.0, 0.0013, 0.005])
def test_a_swing_is_seen_in_runs_just_above_the_limit_and_none_just_below(delay: float) -> None:
    found = stiffness_limit(scene(clock={"round_trip_delay": delay}, device={"mass": 0.02, "damping": 0.4}), KINDS)
    assert found.confirmed
    assert (found.below, found.above) == ("no-swing-seen", "swinging")


def test_a_wrong_limit_would_not_be_confirmed() -> None:
    made = scene(device={"mass": 0.02, "damping": 0.4})
    limit = OneTickMap.from_scene(made).stiffness_limit()
    verdicts = [run_in_process(pressed_deep(made, share * limit), KINDS)["verdict"] for share in (1.05, 1.12)]
    assert not StiffnessLimit(1.08 * limit, *verdicts).confirmed


@pytest.mark.parametrize(
    ("tables", "culprit"),
    [
        ({"friction": {"kinetic": 0.1}}, r"\[friction\]"),
        ({"loss": {"probability": 0.1}}, r"\[loss\]"),
        ({"dissipation": [{"kind": "unidirectional-inertia", "mass": 0.01}]}, "the element unidirectional-inertia"),
    ],
)
def test_a_loop_that_is_no_linear_map_has_no_limit_and_says_why(tables: dict[str, Any], culprit: str) -> None:
    with pytest.raises(NotLinear, match=culprit):
        OneTickMap.from_scene(scene(**tables))


def test_a_loop_without_damping_is_never_stable() -> None:
    with pytest.raises(NeverStable, match="it needs damping"):
        limit_of(device={"mass": 0.01, "damping": 0.0})
