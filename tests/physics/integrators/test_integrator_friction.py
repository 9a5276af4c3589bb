"""Every integrator with dry friction and all other effects: what holds still does so exactly; how well it goes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import haploop.launch.runs.start as start
from haploop.launch.plan.effects import notes
from haploop.plant.integrators.stepwise import growth
from haploop.protocol.scene.scene import Scene
from haploop.tools.cli.app import app
from helpers.runs.captured import in_blocks, run, summarise
from helpers.scenes.effect_tables import EFFECTS, tap
from helpers.scenes.every_effect import EVERYTHING, METHODS
from helpers.scenes.least import mistakes, scene
from helpers.slowly import first_and_slowly

SCENES = Path(__file__).parents[3] / "launch/scenes"
ONE_STEP = METHODS[:-1]
MASS, KINETIC = 0.05, 0.0487


def made(method: str, duration: float, plant_rate: int = 10_000, **tables: Any) -> Scene:
    return scene(**tables, duration=duration, clock={"integrator": method, "plant_rate": plant_rate})


def sliding(method: str, plant_rate: int = 10_000) -> np.ndarray:
    """x of a body that slides until friction stops it, as part of its way m v^2 / (2 f); and v."""
    device = {"mass": MASS, "damping": 0.0, "velocity": 0.1}
    plant = run(made(method, 0.2, plant_rate, device=device, friction={"kinetic": KINETIC})).plant
    return np.stack([plant["x"] / (MASS * 0.1**2 / (2 * KINETIC)), plant["v"]])


@pytest.mark.parametrize("method", METHODS)
def test_friction_stops_a_body_dead(method):
    """v is 0.0 from one step on, and x the same to the last bit."""
    x, v = sliding(method)
    at = int(np.flatnonzero(v == 0.0)[0])
    assert 1020 <= at <= 1030
    assert not v[at:].any()
    assert np.all(x[at:] == x[at])
    assert np.all(v[:at] > 0.0)


@pytest.mark.parametrize("method", METHODS)
def test_friction_holds_a_load_below_breakaway_and_lets_go_at_the_first_step_above(method):
    """The load passes the breakaway force between two steps, at 0.123456 s."""
    ramp = {"kind": "ramp", "value": 0.1 / 0.123456, "rise_time": 1.0}
    friction = {"kinetic": 0.05, "breakaway": 0.1}
    held = run(made(method, 0.2, hand={"force": ramp}, friction=friction)).plant
    assert not held["x"][:1235].any()
    assert not held["v"][:1235].any()
    assert np.all(held["v"][1236:] > 0.0)
    assert np.all(held["stuck"][:1234] == 1.0)
    assert not held["stuck"][1236:].any()


@pytest.mark.parametrize("method", METHODS)
def test_a_motor_that_friction_holds_stays_to_the_bit_while_its_tip_swings(method):
    cable = {"motor_mass": 0.02, "stiffness": 3000.0, "motor_damping": 0.1}
    push = {"kind": "step", "value": 0.02, "at": 0.01}
    tables = {"device": {"mass": 0.05, "damping": 0.0}, "hand": {"force": push}, "transmission": cable}
    plant = run(made(method, 0.04, **tables, friction={"kinetic": 0.05})).plant
    assert not plant["x"].any()
    assert not plant["v"].any()
    assert np.all(plant["stuck"] == 1.0)
    # The tip alone on its cable: 2 F / k.
    assert plant["cable.stretch"].max() == pytest.approx(2 * 0.02 / 3000, rel=0.15 if method == "euler" else 0.02)


@pytest.mark.parametrize("method", ONE_STEP)
def test_a_one_step_method_stops_at_the_end_of_a_step_and_so_too_early_or_late(method):
    """Friction makes every one of them a method of low order, Runge-Kutta's too: it is worth less than its stages."""
    coarse, fine = (abs(sliding(method, rate)[0, -1] - 1) for rate in (1000, 8000))
    assert fine > 1e-9
    assert fine > coarse / 8**3
    assert fine < coarse / 4


def test_dop853_stops_where_friction_stops_a_body():
    assert sliding("dop853", 1000)[0, -1] == pytest.approx(1, rel=1e-12)


def pressed(method: str, **more: Any) -> Scene:
    """Every part of a chain, friction and a wall, without anything that rounds."""
    push = {"kind": "ramp", "value": -1.5, "rise_time": 0.1}
    return scene(
        duration=0.3,
        clock={"round_trip_delay": 0.0013, "integrator": method},
        device={"mass": 0.05, "damping": 0.3, "velocity": -0.1},
        transmission=EFFECTS["transmission"]["transmission"],
        hand={"mass": 0.1, "damping": 2.0, "stiffness": 80.0, "rest": 1e-3, "force": push}
        | {"grip": {"stiffness": 600.0, "damping": 2.0}},
        wall={"position": -0.002, "stiffness": 300.0},
        dissipation=[{"kind": "damping", "damping": 0.2}],
        actuator={"bandwidth": 250.0},
        **more,
    )


STRIBECK = {"kinetic": 0.04, "breakaway": 0.05, "stribeck_velocity": 0.05}


@pytest.mark.slow
@pytest.mark.parametrize("more", [{}, {"friction": EFFECTS["friction"]["friction"]}], ids=["smooth", "friction"])
def test_dop853_agrees_with_the_exact_flow_to_eight_digits(more):
    """With friction through several stops and starts."""
    exact, found = (run(pressed(method, **more)).plant for method in ("exact", "dop853"))
    for name in ("x", "v", "cable.stretch", "grip.stretch", "actuator"):
        assert np.abs(found[name] - exact[name]).max() <= 1e-8 * np.abs(exact[name]).max(), name
    if more:
        assert np.count_nonzero(np.diff(found["stuck"])) >= 2


def test_dop853_follows_a_friction_that_depends_on_the_speed_better_than_the_exact_flow_of_its_pieces():
    """The latter holds friction over a piece, which is of order 2: its error falls by 16 with a fourth of the step."""

    def x(method: str, rate: int) -> np.ndarray:
        device = {"mass": MASS, "damping": 0.0, "velocity": 0.2}
        slide = made(method, 0.2, rate, device=device, hand={"stiffness": 20.0}, friction=STRIBECK)
        return run(slide).plant["x"][:: rate // 1000]

    truth = x("dop853", 1000)
    assert np.abs(x("dop853", 4000) - truth).max() <= 1e-9 * np.abs(truth).max()
    coarse, fine = (np.abs(x("exact", rate) - truth).max() for rate in (1000, 4000))
    assert 1e-9 * np.abs(truth).max() < fine < coarse / 8


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_all_effects_at_once_run_by_every_method_and_blocks_change_no_bit(method):
    resolved = tap(EFFECTS, duration=0.1, clock={"integrator": method, "round_trip_delay": 0.0013})
    one, many = (in_blocks(resolved, ticks) for ticks in (1, 40))
    assert one["trajectory_sha256"] == many["trajectory_sha256"]
    assert one["energy"] == many["energy"]
    assert one["verdict"] in ("no-swing-seen", "swinging")


@pytest.mark.slow
@pytest.mark.parametrize("method", first_and_slowly("rk4", "dop853"))
def test_processes_give_the_bits_of_one_process(method, tmp_path):
    sets = [f"clock.integrator={method}", "duration=0.05"]
    digests = [
        start.run(start.prepare(SCENES / "premium_tap.toml", sets, out=tmp_path / name), in_process=name == "one")
        for name in ("one", "many")
    ]
    assert digests[0]["trajectory_sha256"] == digests[1]["trajectory_sha256"]


def test_a_method_that_diverges_says_so_and_the_run_ends_in_order(tmp_path):
    (tmp_path / "stiff.toml").write_text(
        'title = "stiff"\nduration = 0.1\nclock.integrator = "euler"\ndevice = { mass = 0.05, damping = 0 }\n'
        "transmission = { motor_mass = 1e-3, stiffness = 1e7 }\n"
        'hand.force = { kind = "constant", value = 0.1 }\n'
    )
    ran = CliRunner().invoke(app, ["run", str(tmp_path / "stiff.toml"), "--in-process", "--out", str(tmp_path / "out")])
    assert ran.exit_code == 0
    assert 'clock.integrator = "euler" is unstable by itself at 10000 Hz' in ran.stderr
    assert "diverged" in ran.stdout + ran.stderr


STIFF: dict[str, Any] = {
    "device": {"mass": 0.05, "damping": 0.0},
    "transmission": {"motor_mass": 1e-3, "stiffness": 1e7},
}


@pytest.mark.parametrize("method", METHODS)
def test_only_what_is_unstable_by_itself_is_noted(method):
    y = 1e-4 * np.sqrt(1e7 * (1 / 1e-3 + 1 / 0.05))

    def unstable(**tables) -> list[str]:
        return [note for note in notes(made(method, 0.1, **tables)) if "plant step" in note]

    noted = unstable(**STIFF)
    assert bool(noted) == (method in ("euler", "semi-implicit-euler", "rk4"))
    if method == "euler":
        assert f"by {np.sqrt(1 + y**2):.7g} in every plant step" in noted[0]
    assert not unstable()
    assert not unstable(hand={"mass": 0.2, "grip": {"stiffness": 500, "damping": 5}})
    if method in ONE_STEP:
        assert growth(made(method, 0.1, device={"mass": 0.05, "damping": 0})) == pytest.approx(1, abs=1e-12)


def test_friction_that_a_method_cannot_apply_is_a_mistake():
    """Near its limit Runge-Kutta moves a body backwards under a push; at w h = sqrt(6) it does not move it at all."""

    def at(y: float) -> list[str]:
        cable = {"motor_mass": 1e-3, "stiffness": 1e-3 * (y * 1e4) ** 2}
        tables = {"device": {"mass": 1e6, "damping": 0}, "transmission": cable, "friction": {"kinetic": 1}}
        return mistakes(**tables, clock={"integrator": "rk4"})

    assert at(2.44) == []
    assert len(at(2.46)) == 1
    assert "With rk4, friction does not brake" in at(2.46)[0]


def test_a_method_that_is_not_there_is_a_mistake_that_names_the_nearest():
    found = mistakes(clock={"integrator": "rk5"})
    assert len(found) == 1
    assert "rk4" in found[0]
    assert "implicit-midpoint" in found[0]


@pytest.mark.parametrize("method", METHODS)
def test_a_scene_with_everything_runs_by_every_method(method):
    assert summarise(scene(**EVERYTHING | {"clock": {"integrator": method}}, duration=0.02))["ticks"] == 20
