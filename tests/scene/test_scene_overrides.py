"""--set KEY=VALUE: single keys from the command line."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.launch.scene.file import load
from haploop.launch.scene.mistakes import SceneError
from haploop.launch.scene.reading.layers import Layers, lay_overrides
from haploop.protocol.scene.hand_force import Constant
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Encoder, EventTable
from helpers.scenes.least import LEAST_TOML, file_mistakes

SCENE = (
    LEAST_TOML
    + """
[wall]
position = -0.06
stiffness = 150.0
[[dissipation]]
kind = "unidirectional-inertia"
mass = 0.01
"""
)


@pytest.fixture
def path(tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path / "scene.toml"


@pytest.mark.parametrize(
    ("override", "key", "value"),
    [
        ("dissipation.0.mass=0.02", "dissipation.0.mass", 0.02),
        ("wall.stiffness=0.15 N/mm", "wall.stiffness", 150.0),
        ('wall.stiffness = "0.2 N/mm"', "wall.stiffness", 200.0),
        ("wall.occupies=above", "wall.occupies", "above"),
        ("title=a = b", "title", "a = b"),
        ("seed=7", "seed", 7),
        ("run.pin=false", "run.pin", False),
        ("encoder.resolution=1e-5", "encoder", Encoder(resolution=1e-5)),
        ('hand.force={kind="constant", value=1}', "hand.force", Constant(value=1.0)),
        ('dissipation.1={kind="damping", damping=1}', "dissipation.1.damping", 1.0),
        ("dissipation=[]", "wall.position", -0.06),
    ],
)
def test_a_key_is_set(path, override, key, value):
    assert value_at(load(path, [override]), key) == value


def test_one_past_the_end_of_a_list_adds_to_it(path):
    scene = load(path, ["dissipation.1.kind=damping", "dissipation.1.damping=0.8"])
    assert [element.name for element in scene.dissipation] == ["unidirectional-inertia", "damping"]


def test_a_list_that_is_absent_is_made(path):
    scene = load(path, ["event.0.at=0.5", "event.0.pause=true"])
    assert scene.event == (EventTable(at=0.5, pause=True),)


def test_a_quoted_part_of_a_key_may_hold_dots(path):
    scene = load(path, ["event.0.at=0.5", 'event.0.set."wall.stiffness"=1'])
    assert scene.event[0].set == {"wall.stiffness": 1.0}


@pytest.mark.parametrize(
    ("override", "sentence"),
    [
        ("wall.stifness=1", "wall.stifness is not a key of [wall]; did you mean stiffness?"),
        ("wall.stiffness=-1", "wall.stiffness is -1. It must be at least 0 N/m."),
        ("wall.stiffness=", 'wall.stiffness is "". It must be a number and its unit'),
        ("wall.stiffness", "wall.stiffness cannot be read. It must have the form KEY=VALUE"),
        ("=3", "=3 cannot be read. It must have the form KEY=VALUE"),
        ("wall..x=3", "wall..x=3 cannot be read. It must have the form KEY=VALUE"),
        ("dissipation.2.mass=1", "dissipation.2.mass cannot be set. dissipation has 1 element, counted from 0"),
        ("dissipation.mass=1", "dissipation.mass cannot be set. dissipation has 1 element, counted from 0"),
        ("wall.stiffness.x=1", "wall.stiffness.x cannot be set. wall.stiffness holds a value, not a table."),
        ("extends=x.toml", "extends is not a key of a scene."),
        ("dissipation.0.kind=damping", "dissipation.0.damping is missing."),
    ],
)
def test_a_bad_override_is_a_mistake_like_the_others(path, override, sentence):
    [mistake] = file_mistakes(path, override)
    assert mistake.startswith(f"--set: {sentence}")


def test_overrides_and_files_are_judged_together(path):
    path.write_text(SCENE + "[encoder]\nresolution = 0\n")
    found = file_mistakes(path, "seed=-1", "nonsense", "wall.x=1")
    assert len(found) == 4
    assert sum(line.startswith("--set: ") for line in found) == 3


@given(st.lists(st.text(max_size=20) | st.from_regex(r"[a-z0-9.\"]{1,8}=[ -~]{0,8}", fullmatch=True), max_size=3))
def test_any_text_is_laid_on_or_refused(overrides):
    layers = Layers("scene.toml", {"a": {"b": 1}, "c": [{"d": 1}], "e": [1, 2]})  # pyright: ignore[reportArgumentType]
    try:
        lay_overrides(layers, overrides)
    except SceneError:
        pytest.fail("mistakes are collected, not raised")
    assert isinstance(layers.data, dict)
