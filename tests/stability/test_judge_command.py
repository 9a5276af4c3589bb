"""``haploop judge``: the end of a recorded run, whichever way it was run, and what cannot be judged."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from haploop.launch.runs.replay import logged_run, repeatable
from haploop.launch.stability.finding import OTHER_WIDTH
from haploop.launch.stability.judge import judge_scene
from haploop.tools.cli.app import app


def haploop(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


@pytest.fixture
def run(tmp_path):
    """Runs a shipped scene in one process; returns its directory."""

    def start(*arguments: str):
        result = haploop("run", *arguments, "--in-process", "--out", str(tmp_path / "run"))
        assert result.exit_code in (0, 1), result.output
        return tmp_path / "run"

    return start


@pytest.mark.slow
def test_a_recorded_run_is_judged_from_its_log_and_the_swap_in_it(run):
    """The damping of figure 6(b) holds the loop steady; the inertia that takes its place at 1.5 s does not."""
    directory = run("launch/scenes/swap.toml")
    result = haploop("judge", str(directory), "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    assert told["word"] == "limit-cycle"
    assert told["chaotic"]
    scene, kinds, events = repeatable(directory, logged_run(directory))
    assert judge_scene(scene, kinds, events).sentence() == told["sentence"]
    assert judge_scene(scene, kinds, [event for event in events if "swap" not in event[1]]).word == "steady"


def test_the_terminal_says_the_word_first_and_then_why(run):
    result = haploop("judge", str(run("launch/scenes/fig6a.toml")))
    lines = [line.strip() for line in result.stdout.splitlines()]
    assert lines[0] == "limit-cycle"
    assert lines[1].startswith("Pushes of 0.195 N and of a tenth of it end in the same swing")
    assert any(line.startswith("its commanded ripple") for line in lines)


def test_a_moving_hand_is_told_beside_the_word_as_it_is_in_the_runs_own_summary(run):
    directory = run("launch/scenes/premium_tap.toml")
    provisos = json.loads(haploop("judge", str(directory), "--json").stdout)["provisos"]
    assert provisos == ["only friction holds it", "tried at only some holds of its hand", "its force ripples"]
    assert provisos == json.loads((directory / "summary.json").read_text())["stability"]["provisos"]


TWO_SWINGS = """
duration = 3
device = { mass = 0.06308, damping = 0.1, velocity = -0.3, position = 0.0005 }
friction.kinetic = 0.02
encoder.resolution = 2e-5
hand = { mass = 0.0915, stiffness = 90, damping = 6, force = { kind = "constant", value = -1.59 } }
wall = { position = 0, stiffness = 20925 }
dissipation = [{ kind = "damping", damping = 4.56 }]
"""


@pytest.mark.slow
def test_what_is_told_of_the_runs_own_motion_is_told_by_judge_too_and_without_a_summary_left_out(run, tmp_path):
    """The run swings by 6.1 um, the pushed loop by 23 um."""
    (tmp_path / "two.toml").write_text(TWO_SWINGS)
    directory = run(str(tmp_path / "two.toml"))
    assert json.loads(haploop("judge", str(directory), "--json").stdout)["provisos"] == [OTHER_WIDTH]
    (directory / "summary.json").write_text("{")
    bare = haploop("judge", str(directory), "--json")
    assert (bare.exit_code, json.loads(bare.stdout)["provisos"]) == (0, [])


def test_a_run_out_of_contact_is_called_so(run):
    directory = run("launch/scenes/fig6a.toml", "--set", "wall.position=-0.5")
    assert json.loads(haploop("judge", str(directory), "--json").stdout)["word"] == "no-contact"
    stability = json.loads((directory / "summary.json").read_text())["stability"]
    of_a_push = ("push_N", "watched_s", "frequency_Hz", "width_m", "spread_m", "force_ripple_N")
    assert [stability[name] for name in of_a_push] == [None] * 6, "it was not pushed"


def test_a_run_that_diverged_is_called_so(run):
    directory = run("launch/scenes/fig6a.toml", "--set", "wall.stiffness=30 N/mm", "--set", "diverged_beyond=5 mm")
    told = json.loads(haploop("judge", str(directory), "--json").stdout)
    assert told["word"] == "diverged"
    assert "beyond the limit of 0.005 m" in told["sentence"]


def test_a_directory_without_a_log_is_refused_with_what_is_missing(tmp_path):
    result = haploop("judge", str(tmp_path))
    assert result.exit_code == 2
    assert "holds no log.mcap" in result.output
