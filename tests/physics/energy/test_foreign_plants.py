"""The books as a judge of other people's solvers, and what they know of a hand that nobody has modelled."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from haploop.controller.controller import Controller
from haploop.logger.books import closing
from haploop.logger.books.balance import balance_words
from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from helpers.runs.captured import Captured, run
from helpers.runs.own_motion import booked, run_around
from helpers.scenes.least import KINDS, mistakes, scene
from oracles.own_plant import OnePart

PUSH = {"kind": "ramp", "value": -1.0, "rise_time": 0.1}
HAND = {"mass": 0.01, "damping": 0.2, "stiffness": 50.0, "force": PUSH}
TAP: dict[str, Any] = {
    "duration": 0.3,
    "clock": {"round_trip_delay": 0.0013},
    "device": {"mass": 0.01, "damping": 0.3},
    "wall": {"position": -0.005, "stiffness": 100.0},
    "dissipation": [{"kind": "damping", "damping": 0.1}],
}
# Thrown at a wall, so that its force is all that acts.
THROWN: dict[str, Any] = {
    "duration": 0.2,
    "clock": {"plant_rate": 1000},
    "device": {"mass": 0.02, "damping": 0.0, "velocity": -0.2},
    "wall": {"position": -0.002, "stiffness": 300.0},
}


def judged(method: str, of: Scene, share: float = 0.0) -> tuple[dict[str, np.ndarray], dict[str, Any], OnePart]:
    plant = OnePart(of.as_dict(), Timebase.from_scene(of).step_s, method, share)
    columns, summary = run_around(of, plant.step, plant.x, plant.v)
    return columns, summary["energy"], plant


def unexplained(energy: dict[str, Any]) -> float:
    """The residual with its sign: what was lost."""
    return math.copysign(energy["residual_J"], -1.0 if "invents" in energy["balance"] else 1.0)


def test_a_plant_of_somebody_elses_that_solves_the_scene_moves_as_ours_and_its_books_close():
    columns, energy, _ = judged("exact", scene(**TAP, hand=HAND))
    assert np.abs(columns["x"] - run(scene(**TAP, hand=HAND)).plant["x"]).max() < 1e-15
    assert energy["residual_J"] < 1e-14 * energy["moved_J"]
    assert "balance" not in energy


@pytest.mark.parametrize(("method", "sign", "does"), [("euler", -1.0, "invents"), ("semi", 1.0, "loses")])
def test_the_residual_of_an_euler_step_of_a_free_mass_is_that_of_its_closed_form(method, sign, does):
    """Under a held force f both make m/2 (v + h f/m)^2 of m v^2/2; their ways h v and h (v + h f/m) differ.

    So each step adds, or takes, h^2 f^2 / 2 m.
    """
    columns, energy, plant = judged(method, scene(**THROWN))
    expected = sign * math.fsum(columns["force"][:-1] ** 2) * 1e-6 / (2.0 * plant.mass)
    assert unexplained(energy) == pytest.approx(expected, rel=1e-9)
    assert abs(expected) > 0.05 * energy["moved_J"]
    percent = 100.0 * abs(expected) / energy["moved_J"]
    assert energy["balance"].startswith(f"This plant {does} {float(f'{percent:.2g}'):g} % of the energy: ")


def test_the_residual_of_euler_with_damping_is_what_its_steps_leave_of_the_exact_heat():
    """The heat of a step is that of the exact motion from its first state on: v goes to f/b as e^(-b t/m)."""
    columns, energy, plant = judged("euler", scene(**{**THROWN, "device": {**THROWN["device"], "damping": 0.5}}))
    v, f, dx = columns["v"], columns["force"][:-1], np.diff(columns["x"])
    b, m, h = plant.damping, plant.mass, 1e-3
    rest, swing, decay = f / b, v[:-1] - f / b, -math.expm1(-b * h / m)
    square = rest**2 * h + 2 * rest * swing * m / b * decay + swing**2 * m / (2 * b) * -math.expm1(-2 * b * h / m)
    left = f * dx - b * square - m / 2 * (v[1:] ** 2 - v[:-1] ** 2)
    assert unexplained(energy) == pytest.approx(math.fsum(left), rel=1e-9)


@pytest.mark.parametrize(("share", "does"), [(1e-3, "invents"), (-1e-3, "loses")])
def test_a_plant_that_makes_or_takes_energy_on_purpose_is_told_by_how_much(share, does):
    columns, energy, plant = judged("gain", scene(**TAP, hand=HAND), share)
    before = columns["v"][1:] / (1.0 + share)
    made = math.fsum(plant.mass / 2 * (columns["v"][1:] ** 2 - before**2))
    assert unexplained(energy) == pytest.approx(-made, rel=1e-9)
    assert f"This plant {does} " in energy["balance"]


def test_our_own_crude_integrator_is_told_too_and_the_exact_flow_never():
    crude = run(scene(**{**THROWN, "clock": {"plant_rate": 1000, "integrator": "euler"}}))
    assert crude.energy["balance"].startswith("This plant invents ")
    assert "balance" not in run(scene(**THROWN)).energy


def test_the_work_of_the_port_is_exact_whatever_plant_is_behind_it():
    """The wall's true book is its force times the way, though the plant invents energy."""
    columns, summary = around_euler()
    work = -math.fsum(columns["force"][:-1] * np.diff(columns["x"]))
    assert summary["energy"]["wall"]["true_J"] == pytest.approx(work, rel=1e-12)


def around_euler() -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    plant = OnePart(scene(**THROWN).as_dict(), 1e-3, "euler")
    return run_around(scene(**THROWN), plant.step, plant.x, plant.v)


@pytest.mark.parametrize(
    ("unexplained_J", "moved_J", "foreign", "told"),
    [
        (None, 1.0, ("plant",), ""),
        (0.0, 0.0, (), ""),
        (1e-3, 1.0, ("plant",), ""),
        (-0.27, 1.0, ("plant",),
         "This plant invents 27 % of the energy: 0.27 J of the 1 J that moved came from nowhere, "
         "if its device and hand are those of the scene."),
        (2e-3, 1.0, (), "This plant loses 0.2 % of the energy: 0.002 J of the 1 J that moved went nowhere."),
        (math.inf, 1.0, (), ""),
        (math.nan, 1.0, (), ""),
        (1.0, math.nan, (), ""),
    ],
)  # fmt: skip
def test_a_residual_beyond_a_thousandth_of_what_moved_is_told_in_words(unexplained_J, moved_J, foreign, told):
    assert balance_words(unexplained_J, moved_J, foreign) == told


def test_a_residual_is_not_laid_at_the_door_of_a_plant_that_is_ours_where_the_controller_is_not():
    whose = {roles: balance_words(-1.0, 2.0, roles).partition(" invents")[0] for roles in ((), ("controller",))}
    assert whose[()] == "This plant"
    assert whose[("controller",)].startswith("This controller")
    assert balance_words(1.0, 2.0, ("plant", "controller")).startswith("The pair of plant and controller")


def test_a_controller_that_tells_other_forces_than_it_sent_is_what_the_books_of_our_plant_complain_of():
    known = scene(**TAP, hand=HAND)
    ran, told = run(known), with_value(known, "wall.stiffness", 110.0)
    controller = Controller(told, Timebase.from_scene(told), KINDS)
    controller.answer([(float(x),) for x in ran.plant["x"][:-1:10]])
    energy = booked(known, ran.plant, controller, ("controller",))["energy"]
    assert energy["balance"].startswith("This controller, by the forces that it reports, ")
    crude = with_value(known, "clock.integrator", "euler")
    controller = Controller(told, Timebase.from_scene(told), KINDS)
    controller.answer([(float(x),) for x in ran.plant["x"][:-1:10]])
    energy = booked(crude, ran.plant, controller, ("controller",))["energy"]
    assert energy["balance"].startswith("The pair of plant and controller, by what both report, ")


def unmodelled(**more: Any) -> Scene:
    return scene(**TAP, hand={"kind": "unmodelled"}, **more)


def seen_with(hand: dict[str, Any]) -> tuple[Captured, dict[str, Any]]:
    """A run with a hand, and its books where the scene does not say which hand it was."""
    known, hidden = scene(**TAP, hand=hand), unmodelled()
    plant, controller = run(known), Controller(hidden, Timebase.from_scene(hidden), KINDS)
    controller.answer([(float(x),) for x in plant.plant["x"][:-1:10]])
    return plant, booked(hidden, plant.plant, controller, ("plant",))["energy"]


def test_an_unmodelled_hand_is_booked_with_all_that_the_device_does_not_explain():
    ran, energy = seen_with(HAND)
    v, x, of = ran.plant["v"], ran.plant["x"], ran.energy
    spring = 25.0 * (x[-1] ** 2 - x[0] ** 2)
    given = of["hand_work_J"] - of["hand_heat_J"] - spring - 0.005 * (v[-1] ** 2 - v[0] ** 2)
    assert energy["unmodelled_work_J"] == pytest.approx(given, rel=1e-9)
    assert energy["device_heat_J"] == pytest.approx(of["device_heat_J"], rel=1e-9)
    assert energy["wall"] == of["wall"]
    assert energy["residual_J"] is None
    assert "balance" not in energy
    assert "hand_work_J" not in energy


def test_an_unmodelled_hand_that_is_not_there_is_found_to_have_given_nothing():
    thrown = {**TAP, "device": {"mass": 0.01, "damping": 0.3, "velocity": -0.3}}
    hidden = scene(**thrown, hand={"kind": "unmodelled"})
    plant = OnePart(scene(**thrown).as_dict(), 1e-4, "exact")
    _, summary = run_around(hidden, plant.step, plant.x, plant.v)
    assert abs(summary["energy"]["unmodelled_work_J"]) < 1e-12 * summary["energy"]["moved_J"]
    assert summary["energy"]["wall"]["true_J"]


def test_the_heat_of_a_device_in_an_unmodelled_hand_needs_the_parabola(monkeypatch):
    """Without the bend of the velocity, or with its first value alone, the heat is seen to be wrong."""
    ran, _ = seen_with(HAND)
    monkeypatch.setattr(closing, "sum_steps", lambda flow: flow[:, :1].sum(axis=1) * flow.shape[1])
    _, energy = seen_with(HAND)
    assert abs(energy["device_heat_J"] / ran.energy["device_heat_J"] - 1.0) > 1e-6


def test_an_unmodelled_hand_never_claims_a_residual_even_of_a_plant_that_invents_energy():
    _, energy, _ = judged("gain", scene(**TAP, hand=HAND), 1e-2)
    assert energy["balance"].startswith("This plant invents")
    plant = OnePart(scene(**TAP, hand=HAND).as_dict(), 1e-4, "gain", 1e-2)
    _, summary = run_around(unmodelled(), plant.step, plant.x, plant.v)
    assert summary["energy"]["residual_J"] is None
    assert "balance" not in summary["energy"]


def test_the_port_of_an_unmodelled_hand_balances_with_a_limited_actuator_too():
    """Hand = heat + change of kinetic energy + what the actuator kept back + true books, summed anew from the rows."""
    known = scene(**TAP, hand=HAND, actuator={"saturation": 0.3})
    ran = run(known)
    hidden = unmodelled(actuator={"saturation": 0.3})
    controller = Controller(hidden, Timebase.from_scene(hidden), KINDS)
    controller.answer([(float(x),) for x in ran.plant["x"][:-1:10]])
    energy = booked(hidden, ran.plant, controller)["energy"]
    port = -math.fsum(ran.plant["force"][:-1] * np.diff(ran.plant["x"]))
    kinetic = 0.005 * (ran.plant["v"][-1] ** 2 - ran.plant["v"][0] ** 2)
    assert energy["unmodelled_work_J"] == pytest.approx(port + kinetic + energy["device_heat_J"], rel=1e-9)
    assert energy["actuator_J"] == pytest.approx(ran.energy["actuator_J"], rel=1e-12)


@pytest.mark.parametrize(
    ("tables", "key"),
    [
        ({"hand": {"kind": "unmodelled", "mass": 0.1}}, "hand.mass is given."),
        ({"hand": {"kind": "unmodelled", "force": PUSH}}, "hand.force is given."),
        ({"hand": {"kind": "unmodelled", "mass": 0.1, "grip": {"stiffness": 100}}}, "hand.grip is given."),
        ({"friction": {"kinetic": 0.1}}, "friction is given with an unmodelled hand."),
        ({"transmission": {"motor_mass": 0.01, "stiffness": 1e3}}, "transmission is given with an unmodelled hand."),
        ({"actuator": {"bandwidth": 100}}, "actuator.bandwidth is given with an unmodelled hand."),
        ({"clock": {"integrator": "rk4"}}, "clock.integrator is given with an unmodelled hand."),
        ({"accelerometer": {"bandwidth": 100}}, "accelerometer.bandwidth is given with an unmodelled hand."),
        ({"hand": {"kind": "soft"}}, 'hand.kind is "soft". Allowed: unmodelled.'),
    ],
)
def test_what_would_have_to_be_modelled_cannot_stand_beside_an_unmodelled_hand(tables, key):
    found = mistakes(**{"hand": {"kind": "unmodelled"}, **tables})
    assert any(mistake.startswith(key) for mistake in found), found
