"""Stops, slips and reversals of drawn chains, however short, are those an independent integration finds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from haploop.protocol.scene.scene import Scene
from helpers.runs.captured import bodies, run
from helpers.scenes.least import scene
from helpers.scenes.random_scenes import log_uniform
from helpers.slowly import first_and_slowly
from oracles.effects_run import follow
from oracles.friction_heats import friction_heats


def drawn(seed: int, fastest: float) -> Scene:
    """A chain with friction whose modes and dampers reach to about so many radians a plant step."""
    rng = np.random.default_rng(seed)
    rate, n = int(rng.choice([1000, 2000, 10000])), int(rng.choice([1, 2, 5]))
    mass = log_uniform(rng, 0.01, 0.3)
    has = lambda p=0.6: bool(rng.random() < p)  # noqa: E731
    stiffness = lambda: log_uniform(rng, 10, mass * (fastest * rate) ** 2)  # noqa: E731
    damping = lambda: mass * log_uniform(rng, 0.1, 3 * fastest * rate) if has() else 0.0  # noqa: E731
    push = log_uniform(rng, 0.1, 3)
    steps = 60 * n if rate < 10_000 else 200 * n
    delay = int(rng.integers(12))
    tables: dict[str, Any] = {
        "duration": steps / rate,
        "diverged_beyond": 10.0,
        "clock": {"plant_rate": rate, "control_rate": rate // n, "round_trip_delay": delay / rate},
        "device": {"mass": mass, "damping": damping(), "velocity": rng.choice([-1, 0, 1]) * rng.uniform(0, 0.3)},
        "wall": {"position": -5e-4, "stiffness": log_uniform(rng, 10, 2000)},
        "hand": {
            "mass": mass * log_uniform(rng, 0.1, 10),
            "damping": damping(),
            "stiffness": stiffness(),
            "rest": rng.uniform(-2e-3, 2e-3),
            "force": {"kind": "sine", "amplitude": push, "frequency": rng.uniform(2, 200)},
        },
    }
    if has():
        tables["hand"]["grip"] = {"stiffness": stiffness(), "damping": damping()}
    if has():
        motor = {"motor_mass": mass * log_uniform(rng, 0.1, 10), "motor_damping": damping()}
        tables["transmission"] = motor | {"stiffness": stiffness(), "damping": damping()}
    tables["friction"] = {"kinetic": push * rng.uniform(0.05, 1)}
    if has():
        tables["friction"]["breakaway"] = tables["friction"]["kinetic"] * rng.uniform(1, 2)
    if has(0.3):
        tables["actuator"] = {"bandwidth": log_uniform(rng, 10, rate)}
    return scene(**tables)


# Fast ones take four times as long, and are a third as many.
DRAWN = [*((seed, 0.3) for seed in range(36)), *((seed, 3.0) for seed in range(0, 36, 3))]


@pytest.mark.parametrize(("seed", "fastest"), first_and_slowly(*DRAWN))
def test_a_drawn_chain_with_friction_moves_and_sticks_as_in_an_independent_integration(seed, fastest):
    chain = drawn(seed, fastest)
    ran = run(chain)
    truth = follow(chain, ran.plant["force"][:-1].tolist())
    for x, expected in zip(bodies(ran).values(), truth.x.T, strict=True):
        assert x == pytest.approx(expected, rel=0, abs=3e-9 * np.abs(expected).max())
    assert np.array_equal(ran.plant["v"] == 0.0, truth.v[:, 0] == 0.0)
    assert ran.relative_residual < 1e-12


def jolted(velocity: float, first: float, then: float, **tables: Any) -> Scene:
    """Pushed one way at the start of a plant step and as hard the other way at its end."""
    force = {"kind": "trace", "time": [0.0, 1e-3, 2e-3], "force": [first, then, 0.0]}
    clock = {"plant_rate": 1_000, "control_rate": 1_000}
    device = {"mass": 0.05, "damping": 0.0, "velocity": velocity}
    return scene(duration=0.004, clock=clock, device=device, hand={"force": force}, **tables)


def test_a_mass_that_turns_back_within_a_plant_step_and_goes_on_by_its_end_is_braked_both_ways():
    """At both ends it moves forwards, so that nothing seems to switch; friction must not drive it in between."""
    jolt = jolted(5e-4, -1.0, 1.0, friction={"kinetic": 0.02})
    ran, truth = run(jolt), follow(jolt, [0.0] * 4)
    assert friction_heats(ran).min() >= 0.0
    assert ran.plant["x"] == pytest.approx(truth.x[:, 0], rel=1e-9, abs=1e-14)


def test_a_slip_within_a_plant_step_that_sticks_again_by_its_end_is_not_overlooked():
    """The tip is jolted to and fro, and the cable's damper pulls at the motor most in the middle of the step."""
    drive = {"motor_mass": 0.05, "stiffness": 5e3, "damping": 10.0}
    jolt = jolted(0.0, 1.0, -1.0, transmission=drive, friction={"kinetic": 0.03})
    ran, truth = run(jolt), follow(jolt, [0.0] * 4)
    assert truth.x[1, 0] != 0.0
    assert ran.plant["x"] == pytest.approx(truth.x[:, 0], rel=1e-9, abs=1e-14)
