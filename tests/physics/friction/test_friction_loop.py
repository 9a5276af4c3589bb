"""Dry friction in slow motion and in the loop: stick-slip, limit cycles, the stiffness it allows, and what it heats."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import Scene
from helpers.runs.captured import run
from helpers.scenes.effect_tables import slowly
from helpers.scenes.least import scene
from oracles.effects_run import follow
from oracles.friction_heats import friction_heats

RATE = 10_000


def stick_slip(duration: float, **more: Any) -> tuple[Scene, float, float]:
    """A mass drawn by a spring at constant speed; the scene, the time of a cycle and of the first slip.

    Stuck while the spring gains 2 dF / k, then it slips for (2 pi - 2 atan(dF w / (k V))) / w, dF = F_b - f_k.
    """
    mass, k, speed, kinetic, breakaway = 0.2, 50.0, 0.02, 0.3, 0.5
    ramp = {"kind": "ramp", "value": k * speed * 100.0, "rise_time": 100.0}
    resolved = scene(
        duration=duration,
        diverged_beyond=10.0,
        device={"mass": mass, "damping": 0.0},
        hand={"stiffness": k, "force": ramp},
        friction={"kinetic": kinetic, "breakaway": breakaway},
        **more,
    )
    w, drop = math.sqrt(k / mass), breakaway - kinetic
    cycle = 2 * drop / (k * speed) + 2 * (math.pi - math.atan(drop * w / (k * speed))) / w
    return resolved, cycle, breakaway / (k * speed)


@pytest.mark.parametrize("duration", [5.0, pytest.param(60.0, marks=pytest.mark.slow)])
def test_stick_slip_keeps_its_closed_form_cycle_by_cycle(duration):
    """Every slip starts at the plant step it should, and ends V times a cycle further, to 1e-9."""
    resolved, cycle, first = stick_slip(duration)
    ran = run(resolved)
    moving = ran.plant["v"] != 0.0
    begins = np.flatnonzero(np.diff(moving.astype(int)) == 1)  # the last step at rest
    due = first + cycle * np.arange(len(begins))
    assert len(begins) == math.floor((duration - first) / cycle) + 1 >= 8
    assert np.array_equal(begins, np.floor(due * RATE))
    assert ran.plant["x"][begins] == pytest.approx(0.02 * cycle * np.arange(len(begins)), rel=1e-9, abs=1e-12)
    assert ran.relative_residual < 1e-12


LOOP = {"mass": 0.05, "stiffness": 300.0, "damping": 0.05, "kinetic": 0.01}


def push_from_step(delay_steps: int, force: float) -> dict[str, Any]:
    """A force that is there when the first command acts, and whose rise before moves nothing."""
    if delay_steps == 0:
        return {"kind": "constant", "value": force}
    steps = [delay_steps - 2, delay_steps - 1, delay_steps]
    return {"kind": "trace", "time": [step / RATE for step in steps], "force": [0.0, -force / 2, force]}


def swing_in_the_wall(amplitude: float, delay_steps: int, virtual: float) -> np.ndarray:
    """Distance from rest, at the steps, of a device held 0.1 m deep in the wall and let go so far from rest."""
    k = LOOP["stiffness"]
    ran = run(
        scene(
            duration=1.5,
            clock={"round_trip_delay": delay_steps / RATE},
            device={"mass": LOOP["mass"], "damping": LOOP["damping"], "position": amplitude},
            hand={"force": push_from_step(delay_steps, -k * 0.1)},
            wall={"position": 0.1, "stiffness": k},
            dissipation=[{"kind": "damping", "damping": virtual}] if virtual else [],
            friction={"kinetic": LOOP["kinetic"]},
        )
    )
    assert ran.controller["in_contact"].all()
    assert ran.relative_residual < 1e-12
    return np.abs(ran.plant["x"])


@pytest.mark.slow
@pytest.mark.parametrize(("delay", "virtual"), [(0, 0.0), (13, 0.3), (20, 0.5)])
def test_coulomb_friction_makes_a_limit_cycle_that_is_left_to_rest_inside_and_to_growth_outside(delay, virtual):
    """Amplitude 4 fc / (pi w (K T/2 + K td - b - B)) within 10 % (Abbott and Okamura 2005): it is unstable."""
    k, w = LOOP["stiffness"], math.sqrt(LOOP["stiffness"] / LOOP["mass"])
    generated = k * (0.5e-3 + delay / RATE) - LOOP["damping"] - virtual
    amplitude = 4 * LOOP["kinetic"] / (math.pi * w * generated)
    inside, outside = (swing_in_the_wall(factor * amplitude, delay, virtual) for factor in (0.9, 1.1))
    assert outside[-3000:].max() > 1.15 * amplitude
    assert inside[-3000:].max() < 0.85 * amplitude


def thrown_at_the_wall(seed: int, of_limit: float):
    """A device thrown at a wall of a stiffness so many times min(2b/T, 2 fc/q), nobody holding it."""
    rng = np.random.default_rng(seed)
    mass, damping, kinetic = rng.uniform(0.02, 0.2), rng.uniform(0.05, 0.5), rng.uniform(0.02, 0.2)
    resolution = rng.uniform(1e-5, 4e-4)
    stiffness = of_limit * min(2 * damping / 1e-3, 2 * kinetic / resolution)
    device = {"mass": mass, "damping": damping, "position": 2e-4, "velocity": -rng.uniform(0.05, 0.5)}
    wall = {"position": rng.uniform(-1e-4, 1e-4), "stiffness": stiffness}
    encoder = {"resolution": resolution, "rounding": str(rng.choice(["nearest", "floor"]))}
    return run(scene(duration=1.5, device=device, friction={"kinetic": kinetic}, encoder=encoder, wall=wall))


def kinetic_rise_J(ran, mass: float = 1.0) -> float:
    energy = mass * ran.plant["v"] ** 2 / 2
    return float((energy - energy[0]).max() / energy[0])


@pytest.mark.parametrize("seed", [*range(5), *slowly(range(5, 20))])
def test_a_wall_within_the_bound_of_damping_and_friction_never_throws_the_device_back_faster(seed):
    """K <= min(2b/T, 2 fc/q) (Abbott and Okamura 2005)."""
    ran = thrown_at_the_wall(seed, of_limit=0.99)
    assert kinetic_rise_J(ran) <= 0.0
    assert ran.energy["friction_heat_J"] + ran.energy["device_heat_J"] + ran.energy["wall"]["true_J"] > 0.0
    assert not ran.plant["v"][-1000:].any()


@pytest.mark.slow
def test_far_beyond_that_bound_a_device_is_thrown_back_faster_or_never_rests():
    thrown = [thrown_at_the_wall(seed, of_limit=60.0) for seed in range(6)]
    assert any(kinetic_rise_J(ran) > 0.01 or ran.plant["v"][-1000:].any() for ran in thrown)


SHAPES: dict[str, dict[str, float]] = {
    "kinetic": {"kinetic": 0.08},
    "breakaway": {"kinetic": 0.08, "breakaway": 0.1},
    "stribeck": {"kinetic": 0.08, "breakaway": 0.1, "stribeck_velocity": 0.02},
}


def pushed_to_and_fro(shape: str) -> Scene:
    """Stops, sticks and slips both ways."""
    return scene(
        duration=0.2,
        device={"mass": 0.05, "damping": 0.1},
        hand={"stiffness": 20.0, "force": {"kind": "sine", "amplitude": 0.14, "frequency": 15.0}},
        friction=SHAPES[shape],
    )


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["kinetic", "breakaway"])
def test_motion_with_stops_and_slips_is_that_of_the_reference(shape):
    pushed = pushed_to_and_fro(shape)
    ran, truth = run(pushed), follow(pushed, [0.0] * 2000)
    x, v = truth.x[:, 0], truth.v[:, 0]
    assert np.count_nonzero(np.diff((v == 0.0).astype(int))) >= 4
    assert ran.plant["x"] == pytest.approx(x, rel=0, abs=1e-9 * np.abs(x).max())
    assert np.array_equal(ran.plant["v"] == 0.0, v == 0.0)
    assert friction_heats(ran).sum() == pytest.approx(truth.energies["friction_heat"], rel=1e-9)


@pytest.mark.parametrize("shape", SHAPES)
def test_friction_gives_heat_in_every_step_and_never_takes_it_back(shape):
    ran = run(pushed_to_and_fro(shape))
    heats = friction_heats(ran)
    assert heats.sum() == pytest.approx(ran.energy["friction_heat_J"], rel=1e-12)
    assert heats.sum() > 1e-5
    assert heats.min() >= -1e-15 * heats.sum()
    assert ran.relative_residual < 1e-12


def swing_ends_at(plant_rate: int) -> tuple[float, float]:
    """Where a swing with Stribeck friction is after 0.3 s: as run, and truly."""
    swing = scene(
        duration=0.3,
        clock={"plant_rate": plant_rate, "control_rate": 100},
        device={"mass": 0.05, "damping": 0.0, "position": 0.02},
        hand={"stiffness": 20.0},
        friction={"kinetic": 0.02, "breakaway": 0.05, "stribeck_velocity": 0.2},
    )
    truth = follow(with_value(swing, "clock.plant_rate", 100), [0.0] * 30)
    return float(run(swing).plant["x"][-1]), float(truth.x[-1, 0])


def test_friction_that_falls_with_speed_is_followed_to_second_order_in_the_plant_step():
    errors = [abs(ran - truth) for ran, truth in (swing_ends_at(rate) for rate in (1_000, 2_000, 4_000, 8_000))]
    ratios = [coarse / fine for coarse, fine in pairwise(errors)]
    assert min(ratios) > 3.0, errors
    assert errors[-1] < 1e-6 * 0.02
