"""Runs with a half of somebody else's: their books, their word, and the part of them that can be repeated."""

from __future__ import annotations

import math
import shlex
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import haploop.logger
from haploop.launch.foreign import read_programs
from haploop.launch.runs.replay import replay
from haploop.launch.runs.start import prepare, run
from haploop.logger.foreign import complaint, plant_columns
from haploop.logger.summary import awaits_verdict, read
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.transport.wire import Frame
from haploop.tools.render.report import summary_table
from helpers.runs.captured import run as run_captured
from helpers.scenes.every_effect import EVERYTHING
from helpers.scenes.least import scene
from helpers.shown import shown
from helpers.slowly import first_and_slowly

HOUSE = Path(__file__).parents[2]
FIG6B, FIG6C = (HOUSE / f"launch/scenes/fig6{letter}.toml" for letter in "bc")
UNMODELLED = ("hand.kind=unmodelled", "device.position=-0.055", "device.velocity=-0.3")


class Ran(NamedTuple):
    scene: Scene
    out: Path
    summary: dict[str, Any]


def ran(out: Path, file: Path, role: str, oracle: str, *overrides: str) -> Ran:
    """A run judged as scenes ask for, with an oracle in the place of this role."""
    script, *options = oracle.split()
    words = [sys.executable, str(HOUSE / "tests/oracles" / script), *options]
    spec = prepare(file, overrides, out=out, any_hand=True)
    return Ran(spec.scene, out, run(spec, programs=read_programs([f"{role}={shlex.join(words)}"], [])))


@pytest.fixture(scope="module")
def inventing(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    """Figure 6(b), whose loop is steady, by a plant that makes each velocity a thousandth larger."""
    return ran(tmp_path_factory.mktemp("one") / "run", FIG6B, "plant", "own_plant.py gain 1e-3", "duration=1")


@pytest.fixture(scope="module")
def controlled(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    out = tmp_path_factory.mktemp("two") / "run"
    return ran(out, FIG6C, "controller", "plain_controller.py", "duration=1")


def test_a_plant_that_invents_energy_is_told_so_in_the_summary_and_on_the_terminal(inventing: Ran) -> None:
    energy = inventing.summary["energy"]
    percent = 100.0 * energy["residual_J"] / energy["moved_J"]
    assert percent > 1.0
    assert energy["balance"].startswith(f"This plant invents {percent:.2g} % of the energy: ")
    assert energy["balance"].endswith("if its device and hand are those of the scene.")
    for width in (80, 120):
        text = shown(summary_table(inventing.summary), width)
        assert energy["balance"] in " ".join(text.split())
        assert max(map(len, text.splitlines())) <= width


@pytest.mark.parametrize("which", first_and_slowly("inventing", "controlled"))
def test_the_word_of_a_run_with_a_half_of_somebody_elses_is_that_of_its_window_and_says_why(
    which: str, request: pytest.FixtureRequest
) -> None:
    of: Ran = request.getfixturevalue(which)
    assert of.scene.run.verdict == "pushed"
    assert "stability" not in of.summary
    role = "plant" if which == "inventing" else "controller"
    assert of.summary["verdict_rule"].startswith(f"By its window alone, since the {role} was not haploop's own")
    assert read(of.out / "summary.json")["verdict_rule"] == of.summary["verdict_rule"]
    assert not awaits_verdict(of.scene, of.summary)
    text = " ".join(shown(summary_table(of.summary), 100).split())
    assert not text.startswith("steady")
    assert f"Only the {role} itself says that it does what the scene says; haploop replay checks it against" in text
    of.summary["programs"][role] |= {"name": "", "version": "", "command": ""}
    assert f"{role} not haploop's own a program without a name" in " ".join(
        shown(summary_table(of.summary), 80).split()
    )


def test_the_same_run_of_our_own_plant_is_pushed_and_awaited(inventing: Ran, tmp_path: Path) -> None:
    summary = run(prepare(FIG6B, ["duration=1"], out=tmp_path / "run"), in_process=True)
    assert summary["stability"]
    bare = {key: value for key, value in inventing.summary.items() if key != "programs"}
    assert awaits_verdict(inventing.scene, bare)


def test_the_controllers_half_of_a_run_with_a_plant_of_somebody_elses_is_repeated_to_the_bit(inventing: Ran) -> None:
    found = replay(inventing.out)
    assert found.differences == []
    assert found.summary == {"ticks": 1000}
    assert found.half.startswith("The controller was repeated from its samples; the plant was own plant 1 (")


@pytest.mark.slow
def test_the_plants_half_of_a_run_with_a_controller_of_somebody_elses_is_repeated_to_the_bit(controlled: Ran) -> None:
    found = replay(controlled.out)
    assert found.differences == []
    assert found.summary["trajectory_sha256"] == controlled.summary["trajectory_sha256"]
    assert found.half.startswith("The plant was repeated from its commands; the controller was ")


def test_an_unmodelled_hand_runs_with_a_plant_that_knows_it_and_claims_no_residual(tmp_path: Path) -> None:
    """The plant is that of the device alone; what its solver makes of the energy is booked as the hand's work."""
    of = ran(tmp_path / "run", FIG6B, "plant", "own_plant.py gain 1e-3", "duration=0.2", *UNMODELLED)
    energy, plant = of.summary["energy"], haploop.logger.read(of.out)["/plant"]
    assert energy["residual_J"] is None
    assert "residual" not in haploop.logger.read(of.out)["/energy"]
    before = plant["v"][1:] / 1.001
    made = math.fsum(of.scene.device.mass / 2 * (plant["v"][1:] ** 2 - before**2))
    assert energy["unmodelled_work_J"] == pytest.approx(made, rel=1e-6)
    assert np.ptp(plant["x"]) > 1e-3
    assert "stability" not in of.summary
    text = shown(summary_table(of.summary), 80)
    assert "work of the hand, as the remainder" in " ".join(text.split())
    assert "residual" not in text
    assert replay(of.out).differences == []


def test_a_plant_that_leaves_out_what_its_scene_moves_is_not_booked_as_if_that_stood_still() -> None:
    """Every scene's own plant has all of the columns that are asked of one of somebody else's."""
    for tables in (EVERYTHING, {"friction": {"kinetic": 0.1}}, {}):
        made = scene(**{**tables, "duration": 0.01})
        columns = run_captured(made).plant
        assert set(plant_columns(made)) <= columns.keys()
        time = Timebase.from_scene(made)
        blocks = {name: column.tobytes() for name, column in columns.items()}
        assert complaint(Frame("PLANT_BLOCK", [0, time.ticks, blocks]), "plant", made, time) == ""
        for name in plant_columns(made):
            less = {other: data for other, data in blocks.items() if other != name}
            why = complaint(Frame("PLANT_BLOCK", [0, time.ticks, less]), "plant", made, time)
            assert why.endswith(f"it has no column {name}.")
