"""Replay of a run of which one half was somebody else's program: ours is repeated, and it says which that is."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from haploop.launch.runs.half_replay import beside_own
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.runs.replay import Replay, ReplayError, logged_run, repeatable, replay
from haploop.launch.scene.toml_writer import to_toml
from haploop.launch.spec import PROGRAMS, SCENE
from haploop.logger.log import LogError
from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import Scene
from haploop.tools.cli.app import app
from helpers.scenes.least import KINDS, scene

OWN = {"name": "haploop", "version": "1", "command": "", "own": True}
OTHER = {"name": "Bench", "version": "2.1", "command": "./bench --fast", "own": False}
TAP: dict[str, Any] = {
    "duration": 0.2,
    "clock": {"round_trip_delay": 0.0013},
    "device": {"mass": 0.01, "damping": 0.3},
    "hand": {"mass": 0.01, "stiffness": 50.0, "force": {"kind": "ramp", "value": -1.0, "rise_time": 0.1}},
    "encoder": {"resolution": 1e-5},
    "wall": {"position": -0.001, "stiffness": 100.0},
    "dissipation": [{"kind": "damping", "damping": 0.1}],
    "event": [
        {"at": 0.1, "swap": {"kind": "unidirectional-inertia", "mass": 0.002}},
        {"at": 0.12, "set": {"wall.stiffness": 150.0, "clock.round_trip_delay": 0.0022}},
    ],
}


def left(out: Path, ran: Scene, *foreign: str, told: Scene | None = None, programs: str | None = None) -> Path:
    """The directory of a run in which these roles were told to be somebody else's; its log tells of a scene."""
    by_role = {role: OTHER if role in foreign else OWN for role in ("plant", "controller")}
    text = to_toml((told or ran).as_dict())
    out.mkdir()
    run_in_process(ran, KINDS, out=out, attachments={SCENE: text, PROGRAMS: programs or json.dumps(by_role)})
    (out / SCENE).write_text(text, encoding="utf-8")
    return out


def test_where_the_plant_was_somebody_elses_the_controller_is_repeated_from_its_samples_to_the_bit(tmp_path: Path):
    found = replay(left(tmp_path / "run", scene(**TAP), "plant"))
    assert found == Replay({"ticks": 200}, [], "", found.half, found.other)
    assert found.half == ("The controller was repeated from its samples; the plant was Bench 2.1 (./bench --fast).")


def test_where_the_controller_was_somebody_elses_the_plant_is_repeated_from_its_commands_to_the_bit(tmp_path: Path):
    found = replay(left(tmp_path / "run", scene(**TAP), "controller"))
    assert found.differences == []
    assert found.summary["ticks"] == 200
    assert len(found.summary["trajectory_sha256"]) == 64
    assert found.half == ("The plant was repeated from its commands; the controller was Bench 2.1 (./bench --fast).")


@pytest.mark.parametrize(
    ("key", "value", "foreign", "differs"),
    [
        ("wall.stiffness", 101.0, "plant", "/controller wall differs"),
        ("wall.stiffness", 101.0, "controller", ""),
        ("device.mass", 0.011, "plant", ""),
        ("device.mass", 0.011, "controller", "/plant x differs"),
        ("encoder.resolution", 2e-5, "plant", ""),
        ("encoder.resolution", 2e-5, "controller", "/controller x differs"),
    ],
)
def test_only_the_half_that_is_ours_is_held_against_what_it_did(tmp_path, key, value, foreign, differs):
    ran = scene(**TAP)
    found = replay(left(tmp_path / "run", ran, foreign, told=with_value(ran, key, value)))
    assert any(sentence.startswith(differs) for sentence in found.differences) if differs else not found.differences


@pytest.mark.parametrize(
    ("key", "value", "foreign", "says"),
    [
        ("wall.stiffness", 101.0, "controller", "Haploop's own controller would have answered the same samples with f"),
        ("device.mass", 0.011, "plant", "Haploop's own plant would have deviated by up to "),
        ("device.mass", 0.011, "controller", "Either the log was changed, or the controller sent other forces than"),
    ],
)
def test_the_half_of_somebody_elses_is_held_against_what_our_own_would_have_done(tmp_path, key, value, foreign, says):
    ran = scene(**TAP)
    same = replay(left(tmp_path / "same", ran, foreign)).other
    assert same == f"Haploop's own {foreign} would have done the same in its place, bit for bit."
    assert replay(left(tmp_path / "other", ran, foreign, told=with_value(ran, key, value))).other.startswith(says)


def test_a_force_that_is_no_number_is_as_far_from_our_own_as_can_be(tmp_path: Path):
    recorded = logged_run(left(tmp_path / "run", scene(**TAP), "controller"))
    recorded["/controller"]["total"] = np.append(recorded["/controller"]["total"][:-1], np.nan)
    said = beside_own("controller", *repeatable(tmp_path / "run", recorded), recorded)
    assert said.endswith("with forces that differ by up to inf N, first at 0.199 s.")


def test_a_change_that_a_controller_refused_is_not_asked_of_our_own_either(tmp_path: Path):
    out = left(tmp_path / "run", scene(**{**TAP, "event": []}), "controller", told=scene(**{**TAP, "event": []}))
    recorded = logged_run(out)
    made, kinds, events = repeatable(out, recorded)
    change = {"set": {"wall.stiffness": 150.0}}
    refused = (130, {"refused": "No.", "change": {"tick": 120, **change}})
    same = "Haploop's own controller would have done the same in its place, bit for bit."
    assert beside_own("controller", made, kinds, [(120, change), refused, *events], recorded) == same
    assert beside_own("controller", made, kinds, [(120, change), *events], recorded).endswith("first at 0.12 s.")


def test_a_run_that_was_logged_at_its_ticks_alone_is_held_against_its_trajectory(tmp_path: Path):
    ran = scene(**TAP, run={"log": "ticks"})
    assert replay(left(tmp_path / "one", ran, "controller")).differences == []
    other = with_value(ran, "device.mass", 0.011)
    differences = replay(left(tmp_path / "two", ran, "controller", told=other)).differences
    assert "trajectory_sha256 of the summary differs." in differences


READ = {"acceleration": {"source": "accelerometer"}}


def test_readings_of_an_accelerometer_are_fed_back_where_they_are_in_the_log(tmp_path: Path):
    assert replay(left(tmp_path / "run", scene(**TAP, **READ), "plant")).differences == []
    filtered = scene(**TAP, acceleration={"source": "accelerometer", "cutoff": 50})
    with pytest.raises(ReplayError, match="the accelerometer samples sent to it are not in the log"):
        replay(left(tmp_path / "other", filtered, "plant"))


def test_a_run_that_diverged_is_repeated_too(tmp_path: Path):
    ran = scene(**TAP, diverged_beyond=0.002, run={"block_ticks": 7})
    for foreign in ("plant", "controller"):
        found = replay(left(tmp_path / foreign, ran, foreign))
        assert found.differences == []
        assert 0 < found.summary["ticks"] < 200


def test_a_run_of_which_nothing_was_ours_cannot_be_repeated_and_names_both(tmp_path: Path):
    with pytest.raises(ReplayError, match=r"Neither half .* the plant was Bench 2\.1 .* the controller was Bench 2\.1"):
        replay(left(tmp_path / "run", scene(**TAP), "plant", "controller"))


@pytest.mark.parametrize("programs", ["nonsense", "[]", '{"plant": {}}', '{"plant": {"own": 0}}'])
def test_a_log_that_holds_something_else_for_its_programs_is_refused(tmp_path: Path, programs: str):
    with pytest.raises(LogError, match=r"programs\.json in the log is not that of a run"):
        replay(left(tmp_path / "run", scene(**TAP), programs=programs))


def test_the_command_says_which_half_was_repeated_and_whose_the_other_was(tmp_path: Path):
    answer = CliRunner().invoke(app, ["replay", str(left(tmp_path / "run", scene(**TAP), "plant"))])
    assert answer.exit_code == 0
    assert answer.stdout == (
        "Every bit of 200 ticks agreed. The controller was repeated from its samples; "
        "the plant was Bench 2.1 (./bench --fast). "
        "Haploop's own plant would have done the same in its place, bit for bit.\n"
    )
    wrong = left(tmp_path / "wrong", scene(**TAP), "plant", told=with_value(scene(**TAP), "wall.stiffness", 101.0))
    answer = CliRunner().invoke(app, ["replay", str(wrong), "--json"])
    assert answer.exit_code == 1
    assert json.loads(answer.stdout)["half"].startswith("The controller was repeated")


@pytest.mark.parametrize("foreign", ["plant", "controller"])
def test_judge_says_that_it_cannot_say(tmp_path: Path, foreign: str):
    answer = CliRunner().invoke(app, ["judge", str(left(tmp_path / "run", scene(**TAP), foreign))])
    assert answer.exit_code == 2
    assert f"the {foreign} was Bench 2.1" in answer.stderr
    assert answer.stdout == ""


def test_a_plant_whose_hand_nobody_has_modelled_was_not_ours_though_the_log_names_no_program(tmp_path: Path):
    hidden = scene(**{**TAP, "hand": {"kind": "unmodelled"}})
    out = left(tmp_path / "run", scene(**TAP), told=hidden, programs="{}")
    found = replay(out)
    assert found.differences == []
    assert found.half.endswith("the plant was a program without a name.")
    assert CliRunner().invoke(app, ["judge", str(out)]).exit_code == 2
