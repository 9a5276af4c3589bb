"""Another package adds an effect, an estimator, an integrator and a wall: they are checked, planned, run, booked.

The package is that of ``tests/helpers/outside``; haploop finds it by its entry points alone.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import haploop.logger

OUTSIDE = Path(__file__).parent / "helpers/outside"
# Free fall from rest for a second, then a scene with all of them, then bodies in a row.
FALL = "duration = 1.0\ndiverged_beyond = 10.0\n[device]\nmass = 0.2\ndamping = 0.0\n[gravity]\n"
ALL = """
duration = 0.5
[clock]
integrator = "kutta-3-8"
[device]
mass = 0.1
damping = 0.2
[hand]
mass = 0.05
damping = 1.0
stiffness = 50.0
force = { kind = "ramp", value = -0.5, rise_time = 0.1 }
[wall]
kind = "bumper"
position = -0.005
stiffness = 500.0
hardens_at = "4 mm"
[velocity]
estimator = "alpha-beta"
alpha = 0.4
beta = 0.1
[gravity]
acceleration = "3.7 m/s^2"
[[dissipation]]
kind = "damping"
damping = 0.5
"""
CABLE = "[transmission]\nmotor_mass = 0.05\nstiffness = 5000.0\ndamping = 0.5\n"


def outside(*arguments: object) -> subprocess.CompletedProcess[str]:
    """A command of haploop where the package is installed."""
    return started("-m", "haploop.tools.cli", *map(str, arguments))


def started(*arguments: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(OUTSIDE), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, "PYTHONPATH": path}
    return subprocess.run(
        [sys.executable, *arguments], env=environment, capture_output=True, text=True, check=False, timeout=120
    )


def found(code: str, scene: Path) -> Any:
    """What some code prints of a scene, as JSON."""
    begin = f"import json; from haploop.launch.scene.file import load; scene = load({str(scene)!r})\n"
    done = started("-c", begin + code)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A scene with all of them."""
    (tmp_path / "all.toml").write_text(ALL, encoding="utf-8")
    return tmp_path / "all.toml"


WINDOW = ("--set", "run.verdict=window")


def ran(path: Path, text: str, *options: str) -> tuple[dict[str, Any], Any]:
    """Summary and log of a run of this scene."""
    path.mkdir()
    (path / "scene.toml").write_text(text, encoding="utf-8")
    done = outside("run", path / "scene.toml", "--out", path / "run", "--json", *options)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), haploop.logger.read(path / "run")


@pytest.mark.slow
def test_a_scene_that_names_them_is_checked_with_units_bounds_and_rules_of_their_own(scene: Path) -> None:
    done = outside("check", scene, "--json")
    assert done.returncode == 0, done.stderr
    resolved = json.loads(done.stdout)
    assert resolved["gravity"] == {"acceleration": 3.7}
    assert resolved["wall"]["hardens_at"] == 0.004
    assert resolved["velocity"] == {"estimator": "alpha-beta", "alpha": 0.4, "beta": 0.1}
    wrong = outside("check", scene, "--set", "gravity.acceleration=-1", "--set", "velocity.beta=3")
    assert wrong.returncode == 2
    assert "gravity.acceleration is -1. It must be above 0 m/s^2." in wrong.stderr
    assert "velocity.beta is 3. It must be at most 2." in wrong.stderr


@pytest.mark.slow
def test_their_rules_hold_among_other_tables_and_another_estimator_drops_the_keys_of_one(scene: Path) -> None:
    held = outside("check", scene, "--set", "hand.grip.stiffness=100")
    assert "gravity pulls on the hand. It pulls on the device, so hand.grip must be left out." in held.stderr
    strange = outside("check", scene, "--set", "velocity.estimator=window", "--set", "velocity.ticks=3")
    assert strange.returncode == 0, strange.stderr


def test_without_the_package_its_table_is_no_key_of_a_scene(scene: Path) -> None:
    command = [sys.executable, "-m", "haploop.tools.cli", "check", str(scene)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "gravity is not a key of a scene" in done.stderr
    assert 'velocity.estimator is "alpha-beta"' in done.stderr
    assert 'clock.integrator is "kutta-3-8"' in done.stderr
    assert 'wall.kind is "bumper"' in done.stderr


@pytest.mark.slow
def test_the_schema_for_editors_has_their_keys() -> None:
    schema = json.loads(outside("check", "--schema").stdout)
    assert "gravity" in schema["properties"]
    assert "m/s^2" in schema["$defs"]["Gravity"]["properties"]["acceleration"]["description"]
    assert "alpha-beta" in schema["$defs"]["Velocity"]["properties"]["estimator"]["enum"]
    assert "kutta-3-8" in schema["$defs"]["Clock"]["properties"]["integrator"]["enum"]


@pytest.mark.slow
def test_the_plan_and_explain_say_what_they_do_and_cost(scene: Path) -> None:
    told = json.loads(outside("explain", "--cost", scene, "--json").stdout)
    effects = {effect["name"]: effect for effect in told["effects"]}
    assert set(effects) == {"gravity", "velocity.estimator = alpha-beta", "clock.integrator = kutta-3-8"}
    assert {effect["modules"][0] for effect in effects.values()} == {"haploop_outside"}
    assert told["memory"] == {"velocity.estimator = alpha-beta": 2}
    assert any(step["what"].startswith("gravity pulls the device down") for step in told["plant_step"])
    assert any(step["what"] == "v is that of an alpha-beta filter" for step in told["tick"])
    assert effects["velocity.estimator = alpha-beta"]["instructions_per_tick"] > 0


def test_each_is_taken_out_and_the_scene_without_all_is_the_one_that_never_named_them(scene: Path) -> None:
    code = """
from haploop.tools.operations import NONE, ablations
print(json.dumps({name: without.as_dict() for name, without in ablations(scene).items()}))
"""
    left = found(code, scene)
    assert "gravity" not in left["gravity"]
    assert left["velocity.estimator = alpha-beta"]["velocity"] == {}
    assert left["clock.integrator = kutta-3-8"]["clock"]["integrator"] == "exact"
    assert not {"gravity", "kutta-3-8", "alpha-beta"} & set(json.dumps(left["no effect"]).split('"'))


def test_the_linear_map_and_batches_ask_them(scene: Path) -> None:
    code = """
from haploop.launch.batch.stacking import is_batchable
from haploop.protocol.scene.paths import without
from haploop.tools.linear.linearity import why_not_linear
exact = without(scene, "clock.integrator")
print(json.dumps([why_not_linear(scene), is_batchable(exact), is_batchable(without(exact, "gravity"))]))
"""
    assert found(code, scene) == [['clock.integrator = "kutta-3-8"', "a wall of the kind bumper"], False, True]


def test_a_device_falls_as_it_should_and_gravity_is_in_the_books(tmp_path: Path) -> None:
    """x = -g t^2 / 2; its work m g^2 t^2 / 2 is the kinetic energy at the end, and the hand gives nothing."""
    summary, log = ran(tmp_path / "fall", FALL, "--in-process")
    t = log["/plant"]["t"]
    np.testing.assert_allclose(log["/plant"]["x"], -9.81 * t * t / 2.0, rtol=0.0, atol=1e-14)
    energy = summary["energy"]
    assert energy["gravity_work_J"] == pytest.approx(0.2 * 9.81**2 / 2.0, rel=1e-12)
    assert energy["stored_J"] == pytest.approx(energy["gravity_work_J"], rel=1e-12)
    assert abs(energy["hand_work_J"]) < 1e-14
    assert energy["residual_J"] < 1e-12
    booked = log["/energy"]
    np.testing.assert_allclose(booked["gravity_work"], 0.1 * (9.81 * booked["timestamp"]) ** 2, rtol=1e-12, atol=1e-15)


@pytest.mark.slow
def test_the_residual_stays_below_the_last_bits_also_for_bodies_in_a_row(tmp_path: Path) -> None:
    exact = ALL.replace('integrator = "kutta-3-8"', "")
    for name, text in (
        ("one", exact),
        ("row", exact + CABLE),
        ("rubbing", exact + CABLE + "[friction]\nkinetic = 0.1"),
    ):
        summary, _ = ran(tmp_path / name, text, "--in-process", *WINDOW)
        assert summary["energy"]["residual_J"] < 1e-12
        assert summary["energy"]["gravity_work_J"] > 1e-3


@pytest.mark.slow
def test_processes_find_them_too_and_have_the_same_bits(tmp_path: Path) -> None:
    (one, _), (many, _) = ran(tmp_path / "one", ALL, "--in-process"), ran(tmp_path / "many", ALL)
    assert one["trajectory_sha256"] == many["trajectory_sha256"]
    assert one["energy"] == many["energy"]


@pytest.mark.slow
def test_the_integrator_is_of_order_4(scene: Path) -> None:
    """Half the step leaves a sixteenth of the error."""
    code = f"""
from haploop.launch.runs.in_process import run_in_process
def x_m(method, rate):
    sets = ["clock.integrator=" + method, "clock.plant_rate=" + str(rate), "duration=0.02", "run.verdict=window"]
    return run_in_process(load({str(scene)!r}, sets), {{}})["final"]["x_m"]
print(json.dumps([abs(x_m("kutta-3-8", rate) - x_m("exact", rate)) for rate in (1000, 2000)]))
"""
    text = scene.read_text(encoding="utf-8")
    scene.write_text(text.partition("[[dissipation]]")[0], encoding="utf-8")
    coarse, fine = found(code, scene)
    assert coarse / fine == pytest.approx(16.0, rel=0.1)


def test_the_estimator_follows_a_constant_acceleration_with_its_known_lag(tmp_path: Path) -> None:
    """The error of v is constant then, so that v rises as fast as the device falls."""
    text = FALL + '[velocity]\nestimator = "alpha-beta"\nalpha = 0.5\nbeta = 0.2\n'
    _, log = ran(tmp_path / "fall", text, "--in-process", *WINDOW)
    v = log["/controller"]["v"]
    assert np.diff(v)[-100:] == pytest.approx(np.full(100, -9.81e-3), rel=1e-9)
