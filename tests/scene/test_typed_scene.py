"""The typed scene: what a file resolves to, as frozen tables, and back without a loss."""

from dataclasses import FrozenInstanceError
from pathlib import Path

import pytest

from haploop.launch.scene.file import load
from haploop.launch.scene.models import scene_model
from haploop.protocol.scene.effects import GammaJitter, UniformJitter
from haploop.protocol.scene.hand_force import MinimumJerk
from haploop.protocol.scene.scene import Scene
from helpers.scenes.least import KINDS

SCENES = Path(__file__).parents[2] / "launch/scenes"
SHIPPED = sorted(SCENES.rglob("*.toml"))


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.stem)
def test_a_shipped_scene_comes_back_from_its_tables_with_every_key_value_and_order(file: Path):
    resolved = load(file)
    tables = resolved.as_dict()
    assert Scene.from_dict(tables) == resolved
    assert repr(Scene.from_dict(tables).as_dict()) == repr(tables)
    assert list(tables) == [field.name for field in Scene.fields() if field.name in tables]


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.stem)
def test_the_model_of_the_keys_that_are_there_reads_what_that_of_the_whole_scene_reads(file: Path):
    tables = {key: value for key, value in load(file).as_dict().items() if key not in ("clock", "run", "seed")}
    models = scene_model(KINDS, tables), scene_model(KINDS)
    few, all_ = (Scene.from_dict(model.model_validate(tables).model_dump(exclude_none=True)) for model in models)
    assert few == all_
    assert len(models[0].model_fields) < len(models[1].model_fields)


def test_an_absent_table_is_none_and_a_given_one_is_typed():
    scene = load(SCENES / "fig6a.toml")
    assert scene.friction is None
    assert scene.wall is not None
    assert scene.wall.stiffness > 0.0


def test_a_table_of_kinds_becomes_the_table_of_its_kind():
    plain = load(SCENES / "fig6a.toml").as_dict()
    for jitter, table in (
        ({"kind": "uniform", "most": 1e-3}, UniformJitter(most=1e-3)),
        ({"kind": "gamma", "mean": 1e-3, "deviation": 1e-4}, GammaJitter(mean=1e-3, deviation=1e-4)),
    ):
        assert Scene.from_dict(plain | {"jitter": jitter}).jitter == table
    force = {"kind": "minimum-jerk", "value": 1.0, "rise_time": 0.1}
    hand = Scene.from_dict(plain | {"hand": {"force": force}}).hand
    assert hand is not None
    assert hand.force == MinimumJerk(value=1.0, rise_time=0.1)


def test_a_scene_is_frozen():
    scene = load(SCENES / "fig6a.toml")
    with pytest.raises(FrozenInstanceError):
        scene.duration = 2.0  # pyright: ignore[reportAttributeAccessIssue]  the claim itself


def test_an_unknown_key_is_refused():
    with pytest.raises(TypeError, match="stiffnes"):
        Scene.from_dict(load(SCENES / "fig6a.toml").as_dict() | {"wall": {"position": 0.0, "stiffnes": 1.0}})
