"""All that is wrong with a sweep file is told at once, whatever else is; and the name that was meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from haploop.launch.scene.mistakes import SceneError
from haploop.tools.advise.subject import InvalidRequest, make_subject
from haploop.tools.sweep.sweep_file import load
from helpers.scenes.sweep_files import PRESS, mistakes, sweep_file

AXES = '[axes]\n"wall.stiffness" = [100, 200]\n'
WRONG_AXIS = '[axes]\n"wall.stiffness" = [100, 200]\n"dissipation.0.damping" = [1, -2]\n'


@pytest.mark.parametrize(
    ("before", "after"),
    [("repeat = 0\n" + AXES, ""), (WRONG_AXIS, ""), (AXES, 'holds = "stedy"\n'), (AXES + "[set]\n'wall.x' = 1\n", "")],
)
def test_the_axis_and_the_tolerance_of_a_bisection_are_told_beside_any_other_mistake(
    before: str, after: str, tmp_path: Path
) -> None:
    found = mistakes(tmp_path, f'{before}[bisect]\naxis = "wall.stifness"\ntolerance = 0\n{after}')
    assert len(found) == 3, found
    assert any(one.startswith('bisect.axis is "wall.stifness"; did you mean wall.stiffness?') for one in found)
    assert "bisect.tolerance is 0. It must be above 0 N/m." in found


def test_what_is_wrong_with_an_axis_is_told_beside_what_is_wrong_with_the_scene_and_with_its_line(
    tmp_path: Path,
) -> None:
    text = (
        '[axes]\n"wall.stiffness" = [100, -2]\n"hand.mas" = [1, 2]\n[bisect]\naxis = "wall.stiffness"\ntolerance = 0\n'
    )
    path = sweep_file(tmp_path, text, PRESS.replace("0.05", "-0.05"))
    with pytest.raises(SceneError) as caught:
        load(path)
    assert {one.key: one.line for one in caught.value.mistakes} == {
        "duration": 2,
        "axes.wall.stiffness.1": 3,
        "axes.hand.mas": 4,
        "bisect.tolerance": 7,
    }


def test_a_sweep_of_a_scenes_name_is_told_the_sweep_that_begins_so_and_that_it_is_a_scene(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SceneError, match=r"did you mean demo_damping.* demo is a scene: haploop run demo"):
        load(Path("demo"))
    (tmp_path / "my_sweep.toml").touch()
    with pytest.raises(SceneError, match=r"did you mean my_sweep\.toml\?"):
        load(Path("my_swep"))


def test_an_advice_on_a_name_that_is_none_names_the_file_or_the_device_that_was_meant(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mydev.toml").touch()
    for given, meant in (("mydevv", r"mydev\.toml"), ("premium", "premium15"), ("omega", "omega3")):
        with pytest.raises(InvalidRequest, match=rf"did you mean {meant}\?"):
            make_subject(given)
