"""Every integrator on the same scenes: order, stability and energy are those of its theory, what it lacks included."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from haploop.logger.log.channels import motion_columns
from haploop.protocol.scene.scene import Scene
from helpers.runs.captured import Captured, run
from helpers.scenes.least import scene
from helpers.slowly import first_and_slowly
from oracles.effects_run import follow

ORDERS = {"euler": 1, "semi-implicit-euler": 1, "implicit-midpoint": 2, "rk4": 4}
ONE_STEP = tuple(ORDERS)
METHODS = ("exact", *ONE_STEP, "dop853")
# Corners fall on whole milliseconds, so that the same problem is posed at every plant rate.
CORNERS = {"kind": "trace", "time": [0.0, 0.02, 0.05, 0.06, 0.1], "force": [0.0, 0.4, -0.3, 0.2, 0.0]}
SMOOTH: dict[str, dict[str, Any]] = {
    "free oscillator": {
        "device": {"mass": 0.1, "damping": 0.0, "position": 0.01},
        "hand": {"stiffness": 1000.0},
    },
    "damped": {
        "device": {"mass": 0.1, "damping": 4.0, "position": 0.01},
        "hand": {"stiffness": 1000.0, "rest": 0.002},
    },
    "driven chain": {
        "device": {"mass": 0.05, "damping": 0.5, "velocity": 0.05},
        "transmission": {"motor_mass": 0.04, "stiffness": 1500.0, "damping": 0.3, "motor_damping": 0.2},
        "hand": {
            "mass": 0.2,
            "damping": 1.0,
            "stiffness": 200.0,
            "grip": {"stiffness": 800.0, "damping": 0.5},
            "force": CORNERS,
        },
    },
    "cable mode": {
        "device": {"mass": 0.05, "damping": 0.0},
        "transmission": {"motor_mass": 0.05, "stiffness": 2000.0},
        "hand": {"force": {"kind": "constant", "value": 0.5}},
    },
}


def made(method: str, plant_rate: int, duration: float = 0.1, **tables: Any) -> Scene:
    return scene(**tables, duration=duration, clock={"integrator": method, "plant_rate": plant_rate})


def of_all_bodies(columns: dict[str, np.ndarray]) -> np.ndarray:
    """Positions and velocities against ground at every tick and at the end, shape (states, ticks + 1)."""
    moving = [name for name in motion_columns(columns) if name.rpartition("_")[2] in ("x", "v")]
    every = (len(columns["x"]) - 1) // 100
    return np.array([motion_columns(columns)[name][::every] for name in moving])


def error(method: str, plant_rate: int, name: str) -> float:
    """Largest error of any position or velocity, as part of its largest value, against an independent integration."""
    tables = SMOOTH[name]
    truth = follow(made("exact", 1000, **tables), [0.0] * 100)
    expected = np.stack([truth.x, truth.v], axis=2).reshape(101, -1).T  # x, v of body 0, of body 1, ...
    found = of_all_bodies(run(made(method, plant_rate, **tables)).plant)
    return float((np.abs(found - expected).max(axis=1) / np.abs(expected).max(axis=1)).max())


@pytest.mark.parametrize("name", first_and_slowly(*SMOOTH))
@pytest.mark.parametrize("method", ONE_STEP)
def test_the_error_falls_with_the_step_by_the_order_of_the_method(method, name):
    coarse, fine = (error(method, rate, name) for rate in (8000, 16000))
    assert math.log2(coarse / fine) == pytest.approx(ORDERS[method], abs=0.2)


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize(("method", "most"), [("exact", 1e-11), ("dop853", 1e-8)])
@pytest.mark.parametrize("plant_rate", first_and_slowly(1000, 8000))
def test_what_has_no_step_of_its_own_is_right_at_every_plant_rate(plant_rate, method, most, name):
    assert error(method, plant_rate, name) <= most


# Stability and energy: one undamped oscillator, w h = y. What a step multiplies its energy by:
FACTORS = {
    "exact": lambda y: 1.0,
    "euler": lambda y: 1 + y**2,
    "implicit-midpoint": lambda y: 1.0,
    "rk4": lambda y: 1 - y**6 / 72 + y**8 / 576,
}
LIMITS = {"semi-implicit-euler": 2.0, "rk4": 2.0 * math.sqrt(2.0)}


def swinging(method: str, y: float, steps: int) -> Captured:
    """A swing of 1 mm about 0 with w h = y."""
    mass, rate = 0.1, 1000
    oscillator = {
        "device": {"mass": mass, "damping": 0.0, "position": 1e-3},
        "hand": {"stiffness": mass * (y * rate) ** 2},
        "diverged_beyond": 1e40,
    }
    return run(made(method, rate, steps / rate, **oscillator))


def energies(swung: Captured, y: float) -> np.ndarray:
    """At every step, over that at the start."""
    x, v = swung.plant["x"], swung.plant["v"]
    return (v**2 + (y * 1000 * x) ** 2) / (y * 1000 * 1e-3) ** 2


@pytest.mark.parametrize("y", [0.05, 0.7, 1.9, 2.7, 2.9, 30.0])
@pytest.mark.parametrize("method", FACTORS)
def test_a_step_multiplies_the_energy_of_a_swing_by_what_theory_says(method, y):
    """Euler gains at every step; Runge-Kutta loses below 2 sqrt(2) and gains above; midpoint and exact flow keep it."""
    factor = FACTORS[method](y)
    steps = 40 if factor < 10 else 10
    found = energies(swinging(method, y, steps), y)
    assert found == pytest.approx(factor ** np.arange(steps + 1), rel=1e-10)


@pytest.mark.parametrize("method", LIMITS)
def test_a_swing_stays_up_to_the_limit_of_the_method_and_grows_without_bound_beyond(method):
    below, beyond = 0.998 * LIMITS[method], 1.002 * LIMITS[method]
    stays = energies(swinging(method, below, 1000), below)
    assert max(stays) < 2 / (1 - below / 2) if method == "semi-implicit-euler" else max(stays) <= 1.0
    grows = energies(swinging(method, beyond, 1000), beyond)
    assert grows[-1] > 1e5
    assert grows[-1] > 1e2 * grows[500]


@pytest.mark.parametrize(("method", "limit"), [("euler", 2.0), ("semi-implicit-euler", 2.0), ("rk4", 2.7852935634)])
def test_a_damper_alone_must_not_take_more_than_the_limit_of_the_method_in_a_step(method, limit):
    """b h / m on the negative real axis; the implicit midpoint rule and the exact flow brake at any."""

    def last_v(method: str, y: float) -> float:
        device = {"mass": 0.1, "damping": 0.1 * y * 1000, "velocity": 1e-3}
        return abs(run(made(method, 1000, 0.5, device=device, diverged_beyond=1e40)).plant["v"][-1]) / 1e-3

    assert last_v(method, 0.99 * limit) < 0.02
    assert last_v(method, 1.01 * limit) > 50.0
    for unlimited in ("implicit-midpoint", "exact"):
        assert last_v(unlimited, 1.01 * limit) < 1e-3


@pytest.mark.parametrize("y", [0.1, 1.0, 1.9])
def test_the_semi_implicit_method_keeps_a_quantity_near_the_energy_and_lets_the_energy_swing(y):
    """v^2 + w^2 x^2 - w^2 h x v is kept, so that the energy stays between 1/(1 + y/2) and 1/(1 - y/2) of it."""
    swung = swinging("semi-implicit-euler", y, 1000)
    x, v, w = swung.plant["x"], swung.plant["v"], y * 1000
    kept = v**2 + (w * x) ** 2 - w**2 * 1e-3 * x * v
    assert kept == pytest.approx(np.full(len(x), kept[0]), rel=1e-10)
    found = energies(swung, y)
    assert found.min() >= 1 / (1 + y / 2) - 1e-9
    assert found.max() <= 1 / (1 - y / 2) + 1e-9
    assert np.ptp(found) > y / 2


MASS, FAST = 0.05, 4e4


def of_a_chain(stiffness: float) -> dict[str, Any]:
    """Motor, tip and hand without any damper fly into the hand's spring; all springs are alike."""
    return {
        "device": {"mass": MASS, "damping": 0.0, "velocity": 0.1},
        "transmission": {"motor_mass": MASS, "stiffness": stiffness},
        "hand": {"mass": MASS, "stiffness": stiffness, "grip": {"stiffness": stiffness}},
        "diverged_beyond": 1e40,
    }


def chain_energies(method: str, stiffness: float) -> tuple[np.ndarray, Captured]:
    """At every step, over that at the start; for ``FAST`` the modes have w h = 0.4, 1.1 and 1.6."""
    ran = run(made(method, 1000, **of_a_chain(stiffness)))
    p = motion_columns(ran.plant)
    speeds = [p["v"], p["tip_v"], p["hand_v"]]
    stretches = [ran.plant["cable.stretch"], ran.plant["grip.stretch"], p["hand_x"]]
    energy = (MASS * np.square(speeds).sum(axis=0) + stiffness * np.square(stretches).sum(axis=0)) / 2
    return energy / (3 * MASS * 0.1**2 / 2), ran


@pytest.mark.parametrize("stiffness", [4e2, FAST, 4e8])
@pytest.mark.parametrize("method", ["implicit-midpoint", "exact"])
def test_the_midpoint_rule_keeps_the_energy_of_an_undamped_chain_to_rounding_however_stiff(method, stiffness):
    found, ran = chain_energies(method, stiffness)
    assert found == pytest.approx(np.ones(101), rel=1e-11)
    assert ran.relative_residual < 1e-11


def test_euler_gains_energy_on_an_undamped_chain_runge_kutta_loses_it_and_the_semi_implicit_lets_it_swing():
    gained, lost, swings = (chain_energies(method, FAST)[0] for method in ("euler", "rk4", "semi-implicit-euler"))
    assert np.all(np.diff(gained) > 0.0)
    assert gained[-1] > 1e6
    assert np.all(np.diff(lost) < 0.0)
    assert lost[-1] < 0.95
    assert 1 / 1.8 <= swings.min() < 0.9
    assert 1.1 < swings.max() <= 1 / 0.2


@pytest.mark.parametrize("method", ["euler", "semi-implicit-euler", "rk4"])
def test_the_residual_of_the_books_is_the_energy_the_method_made_or_lost(method):
    found, ran = chain_energies(method, FAST)
    made_J = abs(found[-1] - 1) * 3 * MASS * 0.1**2 / 2
    assert ran.energy["residual_J"] == pytest.approx(made_J, rel=1e-9)
    assert ran.relative_residual > 1e-3


@pytest.mark.parametrize("method", ONE_STEP)
def test_a_body_that_nothing_holds_drifts_on_and_stands_as_it_stood(method):
    drifting = run(made(method, 1000, device={"mass": 0.1, "damping": 0.0, "velocity": 0.01}))
    assert np.all(drifting.plant["v"] == 0.01)
    assert drifting.plant["x"][-1] == pytest.approx(0.001, rel=1e-13)
    assert not run(made(method, 1000)).plant["x"].any()
