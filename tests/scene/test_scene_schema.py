"""The JSON Schema that editors use agrees with what the loader takes."""

import tomllib
from pathlib import Path

import jsonschema
import pytest

from haploop.controller.dissipation import Element
from haploop.launch.scene.file import load
from haploop.launch.scene.schema import json_schema
from helpers.scenes.least import KINDS, LEAST, WALL

SCENES = sorted((Path(__file__).parents[2] / "launch/scenes").glob("*.toml"))
SCHEMA = json_schema(KINDS)
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


def test_it_is_a_schema_of_the_2020_12_draft():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["$schema"] == "https://json-schema.org/draft/2020-12/schema"


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_every_example_scene_loads_and_fits_the_schema(path):
    VALIDATOR.validate(tomllib.loads(path.read_text()))
    VALIDATOR.validate(load(path).as_dict())


@pytest.mark.parametrize(
    "tables",
    [
        {"wall": WALL | {"stiffness": "0.15 N/mm"}},
        {"hand": {"force": {"kind": "trace", "file": "push.csv"}}},
        {"event": [{"at": 0.5, "swap": {"kind": "none"}}]},
    ],
)
def test_what_the_loader_takes_fits(tables):
    VALIDATOR.validate({**LEAST, **tables})


@pytest.mark.parametrize(
    "tables",
    [
        {"wall": WALL | {"stifness": 1}},
        {"wall": WALL | {"stiffness": -1}},
        {"device": {"mass": 0}},
        {"encoder": {"rounding": "up"}},
        {"dissipation": [{"kind": "dampin"}]},
        {"dissipation": [{"kind": "damping"}]},
        {"dissipation": [{"kind": "damping", "mass": 1}]},
        {"hand": {"force": {"kind": "ramp", "frequency": 1}}},
        {"clock": {"plant_rate": 1.5}},
        {"event": [{"pause": True}]},
        {"run": {"pin": None}},
    ],
)
def test_what_the_loader_refuses_does_not_fit(tables):
    assert not VALIDATOR.is_valid({**LEAST, **tables})


def test_only_a_scene_that_extends_another_may_leave_out_the_device():
    assert VALIDATOR.is_valid({"extends": "base.toml"})
    assert not VALIDATOR.is_valid({"title": "no device", "duration": 1.0})


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_each_kind_of_element_shows_its_parameters_with_their_units(kind):
    element: type[Element] = KINDS[kind]
    keys = SCHEMA["$defs"][kind]["properties"]
    assert all(quantity.unit in keys[name]["description"] for name, (quantity, _) in element.parameters().items())
