"""The usual ways of stepping fail where haploop does not: on the same stiff cables and the same friction."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Scene
from helpers.runs.captured import run
from helpers.scenes.least import scene
from helpers.slowly import first_and_slowly
from oracles.effects_reference import Bodies

Rates = Callable[[np.ndarray], np.ndarray]
Method = Callable[[Rates, np.ndarray, float], np.ndarray]


def euler(rates: Rates, z: np.ndarray, h: float) -> np.ndarray:
    """z + h z'."""
    return z + h * rates(z)


def runge_kutta_4(rates: Rates, z: np.ndarray, h: float) -> np.ndarray:
    """The classical one, of fourth order; stable up to w h = 2 sqrt(2)."""
    k1 = rates(z)
    k2 = rates(z + h / 2 * k1)
    k3 = rates(z + h / 2 * k2)
    k4 = rates(z + h * k3)
    return z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def stepped(
    resolved: Scene,
    method: Method,
    steps: int,
    h: float,
    creep: float | None = None,
    speeds: list[float] | None = None,
) -> Bodies:
    """The plant of a scene by a fixed step, under its constant push.

    Friction is f sign(v), or f tanh(v / creep). ``speeds`` is given v of body 0 at every step.
    """
    bodies = Bodies(resolved)
    push = value_at(resolved, "hand.force.value") or 0.0
    friction = value_at(resolved, "friction.kinetic") or 0.0
    bodies.friction = None
    speed = bodies.count

    def rates(z: np.ndarray) -> np.ndarray:
        change = bodies.rates(0.0, z, 0.0, push, 0.0)
        law = math.tanh(z[speed] / creep) if creep else np.sign(z[speed])
        change[speed] -= friction / bodies.m[0] * law
        return change

    for _ in range(steps):
        bodies.z = method(rates, bodies.z, h)
        if speeds is not None:
            speeds.append(float(bodies.z[speed]))
    return bodies


def swinging_cable(motor_mass: float, stiffness: float) -> Scene:
    """A tip of 50 g pushed, without any loss."""
    return scene(
        duration=0.1,
        device={"mass": 0.05, "damping": 0.0},
        hand={"force": {"kind": "constant", "value": 0.1}},
        transmission={"motor_mass": motor_mass, "stiffness": stiffness},
    )


def mode_energy_J(bodies: Bodies) -> float:
    """Of the swing about the stretch under the push."""
    (x, y), (v, u) = bodies.z[:2], bodies.z[2:4]
    both = bodies.m.sum()
    reduced, k = bodies.m.prod() / both, float(bodies.link_k[0])
    return reduced * (u - v) ** 2 / 2 + k * (y - x - 0.1 / k * bodies.m[0] / both) ** 2 / 2


def test_explicit_euler_gains_energy_on_a_cable_that_haploop_swings_for_ever():
    """By 1 + (w h)^2 every step; haploop's books show the push's work and nothing else."""
    swinging = swinging_cable(0.02, 2e3)
    w = math.sqrt(2e3 * (1 / 0.02 + 1 / 0.05))
    start = mode_energy_J(Bodies(swinging))
    assert mode_energy_J(stepped(swinging, euler, 1000, 1e-4)) / start == pytest.approx(
        (1 + (w * 1e-4) ** 2) ** 1000, rel=1e-6
    )
    ran = run(swinging)
    assert ran.energy["stored_J"] == pytest.approx(ran.energy["hand_work_J"], rel=1e-12)


@pytest.mark.filterwarnings("ignore:(overflow|invalid)")
def test_runge_kutta_leaves_its_region_of_stability_on_a_stiff_cable_and_haploop_has_none():
    stiff = swinging_cable(1e-3, 1e7)
    lost = stepped(stiff, runge_kutta_4, 100, 1e-4)
    assert not math.isfinite(mode_energy_J(lost)) or mode_energy_J(lost) > 1e50
    ran = run(stiff)
    w = math.sqrt(1e7 * (1 / 1e-3 + 1 / 0.05))
    stretch = 0.1 / 1e7 * 1e-3 / 0.051 * (1 - np.cos(w * np.arange(1001) / 10_000))
    assert ran.plant["cable.stretch"] == pytest.approx(stretch, rel=0, abs=1e-9 * stretch.max())


def test_runge_kutta_within_its_region_still_loses_energy_that_no_damper_took():
    swinging = swinging_cable(0.02, 1e6)  # w h = 0.84
    start = mode_energy_J(Bodies(swinging))
    assert mode_energy_J(stepped(swinging, runge_kutta_4, 1000, 1e-4)) < 0.5 * start
    assert run(swinging).relative_residual < 1e-14


LOADED = {"kinetic": 0.05}


@pytest.mark.parametrize("creep", first_and_slowly(1e-2, 1e-4))
def test_friction_by_tanh_creeps_under_a_load_that_haploop_holds_without_moving_a_bit(creep):
    """It never sticks: it slides on at creep atanh(load / f)."""
    push = {"kind": "constant", "value": 0.03}
    held = scene(duration=1.0, device={"mass": 0.05, "damping": 0.0}, hand={"force": push}, friction=LOADED)
    crept = stepped(held, runge_kutta_4, 10_000, 1e-4, creep)
    assert crept.z[1] == pytest.approx(creep * math.atanh(0.6), rel=1e-9)
    assert not run(held).plant["x"].any()


def swing_with_friction() -> tuple[Scene, float]:
    """A swing of 1 cm that sticks, and where: it loses 2 f / k every half swing."""
    k, f, end = 40.0, 0.039, 0.0101
    device = {"mass": 0.05, "damping": 0.0, "position": end}
    while k * abs(end) > f:
        end = math.copysign(1.0, end) * (2 * f / k - abs(end))
    return scene(duration=1.0, device=device, hand={"stiffness": k}, friction={"kinetic": f}), end


@pytest.mark.slow
def test_friction_by_tanh_has_an_error_that_no_smaller_step_takes_away():
    swing, end = swing_with_friction()
    errors = [abs(stepped(swing, runge_kutta_4, 1000 * fold, 1e-3 / fold, 1e-3).z[0] - end) for fold in (2, 4, 8)]
    assert min(errors) > 1e-5
    assert errors[2] > 0.9 * errors[1]
    assert abs(run(swing).plant["x"][-1] - end) < 1e-12


def test_friction_by_the_sign_of_v_trembles_where_it_should_stick():
    """Its force jumps at every step, and v with it, round zero."""
    swing, _ = swing_with_friction()
    speeds: list[float] = []
    stepped(swing, euler, 10_000, 1e-4, speeds=speeds)
    assert np.count_nonzero(np.diff(np.sign(speeds[-100:]))) >= 30
    assert min(np.abs(speeds[-100:])) > 0.0
    assert not run(swing).plant["v"][-2000:].any()


def test_a_stop_set_at_the_end_of_its_step_is_off_by_a_part_in_a_million_and_haploop_by_none():
    """v = 0 where it has changed its sign at the end of a step: x then lies beyond, or short of, where it stops."""
    mass, v, f, h = 0.05, 0.1, 0.0487, 1e-4
    x, left = 0.0, v
    while left > 0.0:
        x, left = x + left * h - f / mass * h * h / 2, left - f / mass * h
    way = mass * v * v / (2 * f)
    assert abs(x - way) > 1e-8 * way
    ran = run(scene(device={"mass": mass, "damping": 0.0, "velocity": v}, friction={"kinetic": f}, duration=0.5))
    assert ran.plant["x"][-1] == pytest.approx(way, rel=1e-13)
