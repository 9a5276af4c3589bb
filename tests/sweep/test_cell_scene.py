"""Cells that reuse what they share with their base: the scene, text and sentences of a whole file with their values."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import pytest
from pydantic_core import PydanticCustomError

from haploop.launch.scene.mistakes import SceneError
from haploop.launch.scene.reading.layers import Layers
from haploop.launch.scene.toml_writer import to_toml
from haploop.protocol.scene.scene import Scene
from haploop.tools.sweep.cell_scene import Base, Values, resolved
from haploop.tools.sweep.points import number_at
from helpers.scenes.every_effect import EVERYTHING, NAMING
from helpers.scenes.least import KINDS, scene

FACTORS = (0.0, 0.03, 0.5, 1.0, 1.0001, 2.0, 100.0)
EVENTS = [{"at": 0.02, "set": {"wall.stiffness": 20.0}}, {"at": 0.01, "swap": {"kind": "damping", "damping": 1.0}}]
BASES: dict[str, dict[str, Any]] = {
    "everything": EVERYTHING | {"accelerometer": EVERYTHING["accelerometer"] | {"resolution": 0.5}},
    "friction": {"friction": {"kinetic": 0.05, "breakaway": 0.1, "stribeck_velocity": 0.01}, "hand": {"mass": 0.1}},
    "filter": {"noise": {"deviation": 1e-5, "cutoff": 300}, "velocity": {"estimator": "kalman", "jerk_density": 10.0}},
    "events": {"wall": {"position": -0.001, "stiffness": 500}, "event": EVENTS},
    "integrator": NAMING["clock.integrator = rk4"] | NAMING["friction"],
}
NAMES: list[Values] = [
    {"encoder.rounding": "floor", "wall.stiffness": 3.0},
    {"encoder.rounding": "up"},
    {"dissipation.0.kind": "rate-limited", "wall.stiffness": 3.0},
    {"dissipation.0": {"kind": "inertia", "mass": 0.01}},
    {"dissipation": []},
    {"dissipation.5.kind": "damping"},
    {"velocity.estimator": "foaw", "velocity.ticks": 5},
    {"velocity.estimator": "foaw"},
    {"jitter": {"kind": "gamma", "mean": 0.001, "deviation": 0.001}, "seed": 3},
    {"wall.nothing": 1.0},
    {"device.mass.of": 1.0},
    {"nothing.at.all": 1.0},
    {"title": "another", "run.log": "none"},
]


def _outcome(make: Any) -> Any:
    try:
        return make()
    except SceneError as error:
        return str(error)


def _keys(value: Any, at: str = "") -> Iterator[tuple[str, float]]:
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for name, entry in inner:
        key = f"{at}.{name}".lstrip(".")
        if isinstance(entry, int | float) and not isinstance(entry, bool):
            yield key, entry
        else:
            yield from _keys(entry, key)


def _readable(base: Base, key: str, value: float) -> float | None:
    number = number_at(key.split("."), Layers(Path(), base.tables), KINDS)
    try:
        return number.read(value) if number else None
    except PydanticCustomError:
        return None


@pytest.mark.parametrize("name", BASES)
def test_other_numbers_make_the_scene_or_the_refusal_that_reading_all_of_it_makes(name: str) -> None:
    base, draw = Base(scene(**BASES[name]).in_order()), random.Random(name)
    given = [(key, value) for key, value in _keys(base.tables) if base.has_number(key)]
    made: list[bool] = []
    for _ in range(200):
        some = draw.sample(given, min(2, len(given)))
        values = {key: _readable(base, key, draw.choice(FACTORS) * value) for key, value in some}
        numbers = {key: value for key, value in values.items() if value is not None}
        expected = _outcome(lambda numbers=numbers: resolved(numbers, base.tables, KINDS))
        found = _outcome(lambda numbers=numbers: base.with_numbers(numbers, KINDS))
        assert found == expected, numbers
        made.append(isinstance(found, Scene))
        if isinstance(found, Scene):
            assert base.as_dict(found) == found.as_dict()
            assert base.text(found) == to_toml(found.as_dict())
    assert 10 < sum(made) < 200


def test_a_cell_reads_the_declarations_of_its_elements_only_where_events_may_set_them() -> None:
    class Unread(KINDS["damping"]):
        @classmethod
        def parameters(cls) -> NoReturn:
            raise LookupError

    numbers, kinds = {"dissipation.0.damping": 2.0}, {**KINDS, "damping": Unread}
    of = {"dissipation": [{"kind": "damping", "damping": 1.0}]}
    assert Base(scene(**of).in_order()).with_numbers(numbers, kinds).dissipation[0].parameters == {"damping": 2.0}
    with pytest.raises(LookupError):
        Base(scene(**of, **BASES["events"]).in_order()).with_numbers(numbers, kinds)


@pytest.mark.parametrize("values", NAMES, ids=str)
@pytest.mark.parametrize("name", BASES)
def test_other_values_of_any_kind_make_what_reading_all_of_it_makes_and_share_the_rest(
    name: str, values: Values
) -> None:
    base = Base(scene(**BASES[name]).in_order())
    found = _outcome(lambda: base.with_values(values, KINDS))
    assert found == _outcome(lambda: resolved(values, base.tables, KINDS))
    if isinstance(found, Scene):
        assert base.text(found) == to_toml(found.as_dict())
        assert found.device is base.scene.device


def test_a_number_of_a_list_or_of_no_table_yet_is_not_taken_for_one_without_rules_of_its_own() -> None:
    trace = {"kind": "trace", "time": [0.0, 0.1], "force": [0.0, 1.0]}
    base = Base(scene(hand={"force": trace}, wall={"position": 0.0, "stiffness": 1.0}))
    assert base.has_number("wall.stiffness")
    for key in ("hand.force.time.0", "friction.kinetic", "wall.occupies", "wall", "wall.nothing", "'wall'.stiffness"):
        assert not base.has_number(key), key
