"""Stability of a wall: its limit, the growth beyond it, and the place where a steady contact rests."""

from __future__ import annotations

from decimal import Decimal
from types import SimpleNamespace

import numpy as np
import pytest

from helpers.runs.captured import run
from helpers.scenes.effect_tables import slowly
from helpers.scenes.least import scene
from oracles.one_tick_map import LinearLoop, growth_of

SURFACE_M = 0.1


def pressed_deep(loop: LinearLoop, stiffness: float, duration: float = 0.8):
    """A run of the loop around x = 0, held 0.1 m deep in the wall, so that it never leaves it.

    The push starts with the first command, so that what sets the loop swinging is small.
    """
    push = {"kind": "step", "value": -stiffness * SURFACE_M, "at": loop.delay_steps * loop.step_s}
    elements = [{"kind": "damping", "damping": loop.virtual_damping}] if loop.virtual_damping else []
    return run(
        scene(
            duration=duration,
            clock={"round_trip_delay": loop.delay_steps * loop.step_s},
            device={"mass": loop.mass_kg / 2, "damping": loop.damping, "position": 1e-5},
            hand={"mass": loop.mass_kg / 2, "stiffness": loop.hand_stiffness, "force": push},
            wall={"position": SURFACE_M, "stiffness": stiffness},
            dissipation=elements,
        )
    )


LOOPS = [LinearLoop(0.02, 0.11, 10.0, delay_steps=delay) for delay in (0, 3, 10, 13, 20, 50)]
LOOPS += [LinearLoop(0.02, 0.11, 10.0, delay_steps=delay, virtual_damping=0.1) for delay in (0, 13)]


@pytest.mark.parametrize("loop", LOOPS, ids=lambda p: f"delay {p.delay_steps} steps, B {p.virtual_damping}")
@pytest.mark.parametrize("of_critical", [0.97, 1.03, *slowly([1.0])])
def test_a_deep_contact_grows_every_tick_by_the_spectral_radius_of_its_one_tick_map(loop, of_critical):
    stiffness = of_critical * loop.critical_stiffness()
    growth = growth_of(pressed_deep(loop, stiffness))
    assert growth == pytest.approx(loop.growth(stiffness), abs=1e-9)
    assert abs(growth - 1.0) < 1e-9 if of_critical == 1.0 else (growth > 1.0) == (of_critical > 1.0)


def exact_critical_stiffness(mass_kg: float, damping: float) -> float:
    """K_crit = (1 - E) / g0, E = exp(-b T / m), g0 = ((m/b)(1 - E) - T E) / b: no hand spring, no delay.

    In decimals, since little damping cancels what floats hold.
    """
    m, b, period_s = Decimal(mass_kg), Decimal(damping), Decimal("0.001")
    e = (-b * period_s / m).exp()
    return float((1 - e) / (((m / b) * (1 - e) - period_s * e) / b))


@pytest.mark.parametrize(("mass", "damping"), [(0.01, 0.1), (0.0525, 0.0114), (0.02, 5.0)])
def test_without_delay_the_critical_stiffness_has_its_closed_form(mass, damping):
    expected = exact_critical_stiffness(mass, damping)
    loop = LinearLoop(mass, damping, 0.0, delay_steps=0)
    assert loop.critical_stiffness() == pytest.approx(expected, rel=1e-9)
    for of_critical in (0.99, 1.0, 1.01):
        growth = growth_of(pressed_deep(loop, of_critical * expected))
        assert growth == pytest.approx(loop.growth(of_critical * expected), abs=1e-9)
        assert abs(growth - 1.0) < 1e-9 if of_critical == 1.0 else (growth > 1.0) == (of_critical > 1.0)


@pytest.mark.parametrize("delay", [0, 3, 10, 50])
def test_a_soft_wall_is_stable_up_to_damping_over_half_a_period_plus_delay(delay):
    """K < (b + B) / (T/2 + td) for small K (Gil et al.): the smaller the damping, the closer."""
    errors = []
    for b in (4e-3, 2e-3, 1e-3):
        loop = LinearLoop(0.02, b, 0.0, delay_steps=delay, virtual_damping=b / 2)
        errors.append(loop.critical_stiffness() / (1.5 * b / (0.5e-3 + delay * 1e-4)) - 1.0)
    assert abs(errors[2]) < abs(errors[1]) < abs(errors[0]) < 0.1
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("delay", [0.0, 0.0003, 0.002])
def test_a_steady_contact_rests_at_force_over_both_stiffnesses(side, delay):
    force, hand, wall = side * 0.6, 10.0, 60.0
    ran = run(
        scene(
            duration=3.0,
            clock={"round_trip_delay": delay},
            device={"mass": 0.01, "damping": 1.0},
            hand={"mass": 0.01, "stiffness": hand, "force": {"kind": "constant", "value": force}},
            wall={"position": 0.0, "stiffness": wall, "occupies": "above" if side > 0 else "below"},
        )
    )
    rest = force / (hand + wall)
    assert ran.summary["final"]["x_m"] == pytest.approx(rest, rel=1e-12)
    assert abs(ran.summary["final"]["v_m_s"]) < 1e-15
    assert ran.summary["verdict"] == "no-swing-seen"
    assert ran.summary["window"]["displayed_stiffness_N_m"] == pytest.approx(wall, rel=1e-12)
    assert ran.energy["stored_J"] == pytest.approx(hand * rest**2 / 2, rel=1e-11)
    assert ran.energy["wall"]["ideal_J"] == pytest.approx(wall * rest**2 / 2, rel=1e-11)


def test_the_measure_of_growth_is_right_on_a_motion_of_known_growth():
    k = np.arange(800)

    known = SimpleNamespace(controller={"x": 1.001**k * np.cos(0.07 * k + 0.2), "in_contact": np.ones(800)})
    assert growth_of(known) == pytest.approx(1.001, abs=1e-13)
