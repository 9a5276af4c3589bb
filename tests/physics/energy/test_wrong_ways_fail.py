"""The checks of these tests can fail: with the physics or a book made wrong on purpose, they do."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from haploop.logger.books import balance, one_mass
from haploop.plant.motion import one_mass as of_plant
from haploop.plant.motion.transition import FohTransition
from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import ElementTable, Scene
from helpers.runs.captured import run
from helpers.scenes.least import scene
from helpers.scenes.random_scenes import is_comparable
from oracles.reference_run import simulate


def busy() -> Scene:
    """A tap on a wall with an element, by a hand: every book has something in it."""
    push = {"kind": "ramp", "value": -1.0, "rise_time": 0.1}
    return scene(
        duration=0.3,
        clock={"round_trip_delay": 0.0013},
        device={"mass": 0.01, "damping": 0.3},
        hand={"mass": 0.01, "damping": 0.2, "stiffness": 50.0, "force": push},
        encoder={"resolution": 1e-5},
        wall={"position": -0.005, "stiffness": 100.0},
        dissipation=[{"kind": "damping", "damping": 0.1}, {"kind": "unidirectional-inertia", "mass": 0.002}],
    )


def test_the_books_of_the_busy_scene_close_as_they_are():
    assert run(busy()).relative_residual < 1e-15


BOOKS = ["hand_work", "device_heat", "hand_heat", "kinetic", "spring", "wall.true", "0.true", "1.true"]


@pytest.mark.parametrize("book", BOOKS)
def test_a_flipped_sign_in_any_book_leaves_a_huge_residual(book, monkeypatch):
    sign = balance.balance_sign
    monkeypatch.setattr(balance, "balance_sign", lambda name: sign(name) * (-1.0 if name == book else 1.0))
    assert run(busy()).relative_residual > 1e-5


@pytest.mark.parametrize("book", BOOKS)
def test_a_book_left_out_leaves_a_huge_residual(book, monkeypatch):
    sign = balance.balance_sign
    monkeypatch.setattr(balance, "balance_sign", lambda name: 0.0 if name == book else sign(name))
    assert run(busy()).relative_residual > 1e-5


def test_a_part_in_a_billion_missing_from_the_hand_work_is_seen(monkeypatch):
    sign = balance.balance_sign
    monkeypatch.setattr(balance, "balance_sign", lambda name: sign(name) * (1 - 1e-9 * (name == "hand_work")))
    assert run(busy()).relative_residual > 1e-11


@pytest.mark.parametrize(("rule", "residual"), [("left", 1e-8), ("trapezoid", 1e-9)])
def test_heat_by_a_rule_instead_of_the_exact_integral_does_not_close_the_books(rule, residual, monkeypatch):
    """b v0^2 h, and b (v0^2 + v1^2) h / 2: in smooth motion nearly right, and thousands of times too far off."""

    def by_rule(mass, damping, stiffness, step_s):
        _, lag = exact(mass, damping, stiffness, step_s)
        start = np.array([1.0, 0.0, 0.0])
        rates = np.array([[0, c := one_mass.natural_rate(mass, stiffness, step_s), 0]] + [[0.0] * 3] * 2)
        rates[1] = -stiffness / mass / c, -damping / mass, 1 / step_s
        end = np.linalg.matrix_power(np.eye(3) + rates * step_s / 4096, 4096)[0]
        weight = {"left": (1.0, 0.0), "trapezoid": (0.5, 0.5)}[rule]
        return step_s * (weight[0] * np.outer(start, start) + weight[1] * np.outer(end, end)), lag

    exact = one_mass.motion_integrals
    monkeypatch.setattr(one_mass, "motion_integrals", by_rule)
    assert run(busy()).relative_residual > residual


def test_the_work_of_a_straight_line_force_is_not_its_mean_times_the_way(monkeypatch):
    """The hand pulls harder at one end of the step, where the device is faster or slower."""
    exact = one_mass.motion_integrals
    monkeypatch.setattr(one_mass, "motion_integrals", lambda *of: (exact(*of)[0], 0.0 * exact(*of)[1]))
    assert run(busy()).relative_residual > 1e-12


def euler(mass: float, damping: float, stiffness: float, step_s: float) -> FohTransition:
    """x+ = x + h v, v+ = v + h a: explicit Euler."""
    h, m = step_s, mass
    return FohTransition(0.0, h, 0.0, 0.0, -stiffness / m * h, -damping / m * h, h / m, 0.0)


def semi_implicit_euler(mass: float, damping: float, stiffness: float, step_s: float) -> FohTransition:
    """v+ = v + h a, x+ = x + h v+."""
    e = euler(mass, damping, stiffness, step_s)
    h = step_s
    return FohTransition(h * e.v_x, h * (1 + e.v_v), h * e.v_force, 0.0, e.v_x, e.v_v, e.v_force, 0.0)


def step_by(method: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the plant step by another method, over any number of steps."""

    def held(mass: float, damping: float, stiffness: float, step_s: float, steps: int) -> np.ndarray:
        s = method(mass, damping, stiffness, step_s)
        one = np.array([[s.x_x, s.x_v, s.x_force], [s.v_x, s.v_v, s.v_force], [0.0, 0.0, 0.0]])
        powers = [np.linalg.matrix_power(np.eye(3) + one, count) - np.eye(3) for count in range(steps + 1)]
        return np.array([power[:2].ravel() for power in powers])

    monkeypatch.setattr(of_plant, "make_foh_transition", method)
    monkeypatch.setattr(of_plant, "make_zoh_transitions", held)


def swinging() -> Scene:
    device = {"mass": 0.02, "damping": 0.0, "position": 0.01}
    return scene(duration=2.0, device=device, hand={"stiffness": 10.0})


def test_explicit_euler_gains_energy_and_the_books_say_so(monkeypatch):
    """A factor 1 + (w h)^2 every step: e^{N (w h)^2} - 1 over the run."""
    step_by(euler, monkeypatch)
    ran = run(swinging())
    start = 10.0 * 0.01**2 / 2
    assert ran.energy["stored_J"] / start == pytest.approx(math.exp(20_000 * 500.0 * 1e-8), rel=1e-4)
    assert ran.energy["residual_J"] == pytest.approx(ran.energy["stored_J"] - start, rel=1e-9)
    assert ran.relative_residual > 1e-4


@pytest.mark.parametrize("method", [euler, semi_implicit_euler])
def test_an_approximate_step_does_not_close_the_books_of_the_busy_scene(method, monkeypatch):
    step_by(method, monkeypatch)
    assert run(busy()).relative_residual > 1e-7


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("clock.round_trip_delay", 0.0012),
        ("encoder.rounding", "floor"),
        ("wall.stiffness", 100.01),
        ("dissipation", (ElementTable(name="damping", acts="always", parameters={"damping": 0.1}),)),
    ],
    ids=["clock", "encoder", "wall", "dissipation"],
)
def test_the_comparison_with_the_reference_sees_a_step_of_delay_a_rounding_a_gain_and_a_gate(key, value):
    ours, other = run(busy()).plant["x"], simulate(with_value(busy(), key, value)).x
    assert np.abs(ours - other).max() > 1e-6 * np.abs(ours).max()


def test_the_comparison_with_the_reference_refuses_a_scene_that_hangs_on_the_last_bit():
    """A device that rests just between two counts of the encoder reads the one or the other."""
    count = 2.0**-13
    device = {"mass": 0.01, "damping": 0.1, "position": -61.5 * count}
    between = scene(device=device, wall={"position": -0.006, "stiffness": 50.0}, encoder={"resolution": count})
    assert not is_comparable(between, simulate(between))
