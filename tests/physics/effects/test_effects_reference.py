"""The second writing of the effects gives what is known in closed form, and what the plain plant does without them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers.runs.captured import run
from helpers.scenes.least import scene
from oracles.chain_map import ChainLoop
from oracles.effects_run import follow, simulate
from oracles.one_tick_map import LinearLoop

EVERY_EFFECT = {
    "friction": {"kinetic": 0.048, "breakaway": 0.06, "stribeck_velocity": 0.01},
    "transmission": {"motor_mass": 0.02, "stiffness": 5e4, "damping": 0.5, "motor_damping": 0.01},
    "actuator": {"bandwidth": 300.0},
    "hand": {
        "mass": 0.2,
        "damping": 3.0,
        "stiffness": 100.0,
        "grip": {"stiffness": 500.0, "damping": 2.0},
        "force": {"kind": "sine", "amplitude": 1.0, "frequency": 5.0},
    },
    "wall": {"position": 1e-3, "stiffness": 300.0, "occupies": "above"},
}


@pytest.mark.slow
def test_the_reference_stops_a_sliding_mass_where_and_when_coulomb_friction_does():
    mass, speed, friction = 0.05, 0.1, 0.048
    sliding = scene(device={"mass": mass, "damping": 0.0, "velocity": speed}, friction={"kinetic": friction})
    truth = follow(sliding, [0.0] * 1200)
    assert truth.x[-1, 0] == pytest.approx(mass * speed**2 / (2 * friction), rel=1e-13)
    assert np.argmax(truth.v[:, 0] == 0.0) == math.ceil(mass * speed / friction * 10_000)
    assert truth.energies["friction_heat"] == pytest.approx(mass * speed**2 / 2, rel=1e-12)


@pytest.mark.slow
def test_the_reference_closes_its_own_books_with_every_effect_at_once():
    truth = simulate(scene(duration=0.1, device={"mass": 0.05, "damping": 0.0}, **EVERY_EFFECT))
    heats = {name: value for name, value in truth.energies.items() if "heat" in name}
    assert min(heats.values()) >= 0.0
    assert sum(value > 1e-9 for value in heats.values()) >= 5
    assert abs(truth.unexplained_J) < 1e-12 * sum(heats.values())


@pytest.mark.slow
def test_without_effects_the_reference_does_what_the_plain_plant_does():
    tap = scene(
        duration=0.2,
        clock={"round_trip_delay": 0.0013},
        device={"mass": 0.05, "damping": 0.2, "velocity": 0.1},
        hand={"mass": 0.01, "stiffness": 50.0, "force": {"kind": "constant", "value": 0.5}},
        wall={"position": 1e-3, "stiffness": 300.0, "occupies": "above"},
    )
    x = simulate(tap).x[:, 0]
    assert run(tap).plant["x"] == pytest.approx(x, rel=0, abs=1e-11 * np.abs(x).max())


@pytest.mark.parametrize("delay", [0, 3, 13])
def test_the_map_of_a_chain_of_one_body_is_the_map_of_the_plain_loop(delay):
    one = scene(
        clock={"round_trip_delay": delay / 10_000},
        device={"mass": 0.02, "damping": 0.11},
        hand={"stiffness": 10.0},
        dissipation=[{"kind": "damping", "damping": 0.1}],
    )
    plain = LinearLoop(0.02, 0.11, 10.0, delay_steps=delay, virtual_damping=0.1)
    assert ChainLoop.of(one).matrix(300.0) == pytest.approx(plain.matrix(300.0), rel=1e-12, abs=1e-15)


def test_the_modes_of_a_chain_are_those_of_two_masses_on_a_spring():
    drive = {"motor_mass": 0.02, "stiffness": 5e4}
    modes = ChainLoop.of(scene(device={"mass": 0.05, "damping": 0.0}, transmission=drive)).modes_Hz()
    assert modes == pytest.approx([math.sqrt(5e4 * (1 / 0.02 + 1 / 0.05)) / math.tau], rel=1e-12)
