"""Dry friction stops, holds and lets go where its closed forms say, to the last bits of a plant step."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from haploop.plant.friction import motion, substeps
from helpers.runs.captured import run
from helpers.scenes.effect_tables import creeping, slowly
from helpers.scenes.least import scene

RATE = 10_000


def sliding(mass: float, speed: float, kinetic: float, damping: float = 0.0, **more: Any):
    device = {"mass": mass, "damping": damping, "position": 0.01, "velocity": speed}
    return run(scene(duration=0.5, device=device, friction={"kinetic": kinetic}, **more))


def stop_time_s(ran, deceleration: float) -> float:
    """From the last state in motion, which slows at a constant rate."""
    last = int(np.flatnonzero(ran.plant["v"])[-1])
    return last / RATE + abs(float(ran.plant["v"][last])) / deceleration


def friction_heat_J(ran) -> float:
    return ran.energy["friction_heat_J"]


# Stopping


@pytest.mark.parametrize("mass", [1e-3, 0.05, 10.0])
@pytest.mark.parametrize("seconds", [7.3e-5, 0.0211, 0.3])
@pytest.mark.parametrize("speed", [-0.37])
def test_coulomb_friction_stops_a_mass_at_m_v_over_f_after_half_m_v_squared_over_f(mass, seconds, speed):
    kinetic = mass * abs(speed) / seconds
    ran = sliding(mass, speed, kinetic)
    assert stop_time_s(ran, kinetic / mass) == pytest.approx(seconds, rel=1e-9)
    assert ran.plant["x"][-1] - 0.01 == pytest.approx(math.copysign(mass * speed**2 / 2 / kinetic, speed), rel=1e-9)
    assert friction_heat_J(ran) == pytest.approx(mass * speed**2 / 2, rel=1e-9)
    assert ran.relative_residual < 1e-12


def test_with_a_damper_it_stops_where_both_together_do():
    """m v' = -b v - f: t = m/b ln(1 + b v/f), way m v/b - m f/b^2 ln(1 + b v/f)."""
    m, b, v, f = 0.05, 0.7, 0.4, 0.048
    ran = sliding(m, v, f, damping=b)
    log = math.log1p(b * v / f)
    assert ran.plant["x"][-1] - 0.01 == pytest.approx(m * v / b - m * f / b**2 * log, rel=1e-9)
    stopped = int(np.flatnonzero(ran.plant["v"])[-1]) + 1
    assert stopped == math.ceil(m / b * log * RATE)


@pytest.mark.parametrize("damping", [2.0, *slowly([5.0])])
def test_a_friction_of_zero_neither_holds_nor_takes_anything(damping: float):
    """A mass on a spring swings through rest again and again; a loop once failed as it switched there for ever."""
    swinging = {
        "duration": 1.5,
        "device": {"mass": 0.1, "damping": damping, "position": 0.01},
        "hand": {"mass": 0.0, "damping": 0.0, "stiffness": 500.0},
    }
    free, rubbed = run(scene(**swinging)), run(scene(**swinging, friction={"kinetic": 0.0}))
    assert np.abs(rubbed.plant["x"] - free.plant["x"]).max() < 1e-17
    assert friction_heat_J(rubbed) == 0.0


def test_a_stopped_mass_stays_stopped_bit_by_bit():
    ran = sliding(0.05, 0.1, 0.48)
    at_rest = ran.plant["v"] == 0.0
    first = int(np.argmax(at_rest))
    assert at_rest[first:].all()
    assert len(np.unique(ran.plant["x"][first:])) == 1


def test_a_mass_that_creeps_to_rest_under_friction_sticks_and_stays_bit_by_bit():
    """A loop once hunted for ever for the instant of a stop, as v was rounding, and changed its sign with it."""
    ran = run(creeping())
    last = int(np.flatnonzero(ran.plant["v"])[-1])
    assert 1e-17 < abs(ran.plant["v"][last]) < 1e-15  # rounding is 1e-19
    assert ran.plant["stuck"][last + 1 :].all()
    assert len(np.unique(ran.plant["x"][last + 1 :])) == 1
    assert ran.relative_residual < 1e-12


def test_a_hunt_for_a_stop_ends_though_the_speed_is_rounding(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(motion.LOOPS, "pays", np.inf)
    for module in (motion, substeps):
        monkeypatch.setattr(module, "creeps", lambda _of, _mode, v: np.zeros(np.shape(v), bool))
    ran = run(creeping())
    assert ran.plant["v"][-1] == 0.0
    assert np.bincount(ran.plant["pieces.step"].astype(int)).max() < 70


def test_who_has_friction_switch_too_often_is_told_what_helps(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(motion.LOOPS, "pays", np.inf)
    monkeypatch.setattr(substeps, "_MOST_PIECES", 3)
    with pytest.raises(ArithmeticError, match=r"took 3 pieces. Raise clock.plant_rate where a body swings many times"):
        run(scene(duration=0.1, device={"mass": 0.05, "damping": 0.0, "velocity": 0.1234}, friction={"kinetic": 0.5}))


# Sticking


@pytest.mark.slow
@pytest.mark.parametrize("load", [0.06, *slowly([-0.06, 0.0, 1e-12, 0.0599999])])
@pytest.mark.parametrize("hand", [{"mass": 0.02, "damping": 0.3, "stiffness": 200.0, "rest": 0.01}, *slowly([{}])])
def test_what_is_loaded_by_no_more_than_the_breakaway_force_does_not_move_by_a_bit_for_ten_seconds(load, hand):
    force = {"kind": "constant", "value": load}
    device = {"mass": 0.05, "damping": 0.1, "position": 0.01}
    ran = run(
        scene(duration=10.0, device=device, hand=hand | {"force": force}, friction={"kinetic": 0.05, "breakaway": 0.06})
    )
    assert not ran.plant["v"].any()
    assert np.array_equal(np.unique(ran.plant["x"]), [0.01])
    assert friction_heat_J(ran) == 0.0
    assert ran.energy["residual_J"] == 0.0


def test_a_force_a_millionth_above_breakaway_sets_it_in_motion():
    device = {"mass": 0.05, "damping": 0.0}
    force = {"kind": "constant", "value": 0.06 * (1 + 1e-6)}
    ran = run(scene(duration=0.1, device=device, hand={"force": force}, friction={"kinetic": 0.06}))
    assert (ran.plant["v"][1:] > 0.0).all()
    assert ran.plant["x"][-1] == pytest.approx(0.06e-6 / 0.05 * 0.1**2 / 2, rel=1e-9)


def test_a_motor_that_sticks_holds_the_cable_while_the_tip_swings():
    """The tip swings against the held motor: sqrt(k/m), without loss."""
    drive = {"motor_mass": 0.02, "stiffness": 5e3}
    push = {"kind": "constant", "value": 0.5}
    ran = run(
        scene(
            duration=1.0,
            device={"mass": 0.05, "damping": 0.0},
            hand={"force": push},
            transmission=drive,
            friction={"kinetic": 1.01},
        )
    )
    assert not ran.plant["x"].any()
    energy = ran.energy
    w = math.sqrt(5e3 / 0.05)
    stretch = 0.5 / 5e3 * (1 - math.cos(w * 1.0))
    assert energy["hand_work_J"] == pytest.approx(0.5 * stretch, rel=1e-9)
    assert energy["stored_J"] == pytest.approx(0.5 * stretch, rel=1e-9)
    assert ran.relative_residual < 1e-12


# Breaking away


@pytest.mark.parametrize("breakaway", [0.05, 0.06])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_it_breaks_away_where_the_ramp_passes_the_breakaway_force_and_then_accelerates_as_it_should(breakaway, sign):
    """x = ((F_b - f_k) s^2 / 2 + r s^3 / 6) / m, s since the ramp of rate r passed F_b."""
    m, rate, kinetic = 0.05, 0.731, 0.05
    ramp = {"kind": "ramp", "value": sign * rate * 10.0, "rise_time": 10.0}
    friction = {"kinetic": kinetic, "breakaway": breakaway}
    ran = run(
        scene(duration=0.2, device={"mass": m, "damping": 0.0}, hand={"force": ramp}, friction=friction),
    )
    before = math.floor(breakaway / rate * RATE)
    assert not ran.plant["x"][: before + 1].any()
    assert (sign * ran.plant["v"][before + 1 :] > 0.0).all()
    s = 0.2 - breakaway / rate
    expected = ((breakaway - kinetic) * s**2 / 2 + rate * s**3 / 6) / m
    assert sign * ran.plant["x"][-1] == pytest.approx(expected, rel=1e-9)
    assert friction_heat_J(ran) == pytest.approx(kinetic * expected, rel=1e-9)
    assert ran.relative_residual < 1e-12


@pytest.mark.parametrize(
    ("start", "mass"), [(0.0101, 0.02), (-0.05, 0.02), (0.0101, 1.3), pytest.param(-0.05, 1.3, marks=pytest.mark.slow)]
)
def test_a_swing_loses_two_fc_over_k_every_half_swing_and_sticks_where_the_spring_holds_less(start, mass):
    k, fc, rest = 40.0, 0.039, 2e-3
    device = {"mass": mass, "damping": 0.0, "position": rest + start}
    half = math.pi / math.sqrt(k / mass)
    ends = [start]
    while k * abs(ends[-1]) > fc:
        ends.append(math.copysign(1.0, ends[-1]) * (2 * fc / k - abs(ends[-1])))
    until = math.ceil(len(ends) * half * 1000) / 1000  # as long again as a half swing takes it holds still
    ran = run(scene(duration=until, device=device, hand={"stiffness": k, "rest": rest}, friction={"kinetic": fc}))
    x, v = ran.plant["x"] - rest, ran.plant["v"]
    assert x[-1] == pytest.approx(ends[-1], abs=1e-9 * abs(start))
    stopped = int(np.flatnonzero(v)[-1]) + 1
    assert stopped == math.ceil((len(ends) - 1) * half * RATE)
    assert not v[stopped:].any()
    for index, end in enumerate(ends[1:-1], 1):  # between two steps: the flow is flat there
        at = round(index * half * RATE)
        assert x[at] == pytest.approx(end, abs=k / mass * abs(start) * 0.5e-4**2)
    assert friction_heat_J(ran) == pytest.approx(k / 2 * (start**2 - ends[-1] ** 2), rel=1e-9)
    assert ran.relative_residual < 1e-12
