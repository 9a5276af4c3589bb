"""A scene whose hand is unmodelled: read, checked, and refused by all that would have to move its device."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from haploop import api
from haploop.launch.runs.start import prepare
from haploop.launch.scene.file import load
from haploop.launch.scene.mistakes import SceneError
from haploop.plant.plant import Plant
from haploop.protocol.ticks import Timebase
from haploop.tools.cli.app import app

SCENES = Path(__file__).parents[2] / "launch/scenes"
FIG6B = SCENES / "fig6b.toml"
UNMODELLED = "hand.kind=unmodelled"
WHY = 'hand.kind is "unmodelled". No program here knows what such a hand does'


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A scene that extends one with a hand of 100 g and takes that hand out."""
    path = tmp_path / "mine.toml"
    path.write_text(f'extends = "{FIG6B}"\nhand.kind = "unmodelled"\n', encoding="utf-8")
    return path


def test_an_unmodelled_hand_takes_the_place_of_all_that_lay_below_it(file: Path):
    nothing = dict.fromkeys(("mass", "damping", "stiffness", "rest"), 0.0)
    for scene in (load(file, any_hand=True), load(FIG6B, [UNMODELLED], any_hand=True)):
        assert scene.as_dict()["hand"] == {"kind": "unmodelled", **nothing}
    assert "kind" not in load(FIG6B).as_dict()["hand"]


def test_a_resolved_scene_with_an_unmodelled_hand_can_be_read_again(file: Path, tmp_path: Path):
    spec = prepare(file, out=tmp_path / "run", any_hand=True)
    assert load(spec.out / "scene.toml", any_hand=True) == spec.scene


@pytest.mark.parametrize("command", ["run", "explain", "advise", "cost"])
def test_a_command_that_would_have_to_move_the_device_refuses_and_says_why(command: str, file: Path, tmp_path: Path):
    out = [] if command == "explain" else ["--out", str(tmp_path / "out")]
    answer = CliRunner().invoke(app, [command, str(file), *out])
    assert answer.exit_code == 2
    assert WHY in answer.stderr


def test_a_sweep_of_such_a_scene_is_refused_before_its_first_run(file: Path, tmp_path: Path):
    sweep = tmp_path / "sweep.toml"
    sweep.write_text(f'scene = "{file}"\n[axes]\n"wall.stiffness" = [100, 200]\n', encoding="utf-8")
    answer = CliRunner().invoke(app, ["sweep", str(sweep), "--out", str(tmp_path / "out")])
    assert answer.exit_code == 2
    assert WHY in answer.stderr


REFUSING: dict[str, Callable[[Path], object]] = {
    "load": load,
    "prepare": prepare,
    "the Python interface": api.load,
    "a change of a scene": lambda _: api.load(FIG6B).set({"hand.kind": "unmodelled"}),
}


@pytest.mark.parametrize("what", REFUSING)
def test_nothing_in_python_takes_such_a_scene_for_one_that_it_can_move(what: str, file: Path):
    with pytest.raises(SceneError, match="can be neither moved nor judged"):
        REFUSING[what](file)


def test_our_plant_does_not_take_an_unmodelled_hand_for_none(file: Path):
    scene = load(file, any_hand=True)
    with pytest.raises(ValueError, match="An unmodelled hand cannot be moved"):
        Plant(scene, Timebase.from_scene(scene))


def test_check_says_whose_plant_can_run_it(file: Path):
    answer = CliRunner().invoke(app, ["check", str(file)])
    assert answer.exit_code == 0
    assert "can be run with your own plant" in answer.stderr


def test_check_says_that_a_scene_has_no_wall_and_nothing_of_one_that_has(tmp_path: Path):
    said = []
    for name, wall in (("bare", ""), ("walled", "[wall]\nposition = 0.0\nstiffness = 100.0\n")):
        (tmp_path / f"{name}.toml").write_text(f"duration = 1.0\n[device]\nmass = 0.1\ndamping = 0.1\n{wall}")
        said.append(CliRunner().invoke(app, ["check", str(tmp_path / f"{name}.toml")]).stderr)
    assert "It has no [wall]: nothing pushes the device back." in said[0]
    assert "[wall]" not in said[1]
