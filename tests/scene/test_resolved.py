"""A resolved scene written as TOML reads back to the same values, bit for bit."""

import tomllib
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.launch.scene.file import load
from haploop.launch.scene.toml_writer import to_toml
from helpers.scenes.least import KINDS, LEAST, scene

_TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
_SCALARS = st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | _TEXT
_VALUES = st.recursive(
    _SCALARS, lambda v: st.lists(v, max_size=4) | st.dictionaries(_TEXT, v, max_size=4), max_leaves=20
)


def same(a: Any, b: Any) -> bool:
    """Equal in value and type, and floats in every bit."""
    return repr(a) == repr(b) if not isinstance(a, (dict, list)) else a == b and sorted_repr(a) == sorted_repr(b)


def sorted_repr(value: Any) -> str:
    if isinstance(value, dict):
        return repr([(k, sorted_repr(v)) for k, v in sorted(value.items())])
    return repr([sorted_repr(v) for v in value]) if isinstance(value, list) else repr(value)


@given(st.dictionaries(_TEXT, _VALUES, max_size=5))
def test_whatever_a_scene_can_hold_survives_the_way_through_toml(tables):
    assert same(tomllib.loads(to_toml(tables)), tables)


@pytest.mark.parametrize("value", [None, {1, 2}, b"x"])
def test_what_a_scene_cannot_hold_is_refused(value):
    with pytest.raises(TypeError, match="A scene holds text, numbers"):
        to_toml({"a": {"b": [value]}})


_NUMBER = st.floats(-1e6, 1e6)
_POSITIVE = st.floats(1e-6, 1e6)
_ELEMENT = st.sampled_from(sorted(KINDS)).map(
    lambda kind: {
        "kind": kind,
        **{name: 2 if quantity.whole else 0.1 for name, (quantity, _) in KINDS[kind].parameters().items()},
        "acts": "always",
    }
)
_RAMP = st.fixed_dictionaries({"kind": st.just("ramp"), "value": _NUMBER, "rise_time": _POSITIVE})
_TRACE = st.fixed_dictionaries({"kind": st.just("trace"), "time": st.just([0.0, 0.1]), "force": st.just([-0.0, 1])})
_CHANGE = st.sampled_from([{"pause": True}, {"stop": True}, {"swap": {"kind": "damping", "damping": 1}}])
_EVENTS = st.lists(st.tuples(st.floats(0, 0.9), _CHANGE).map(lambda event: {"at": event[0], **event[1]}), max_size=3)
_SCENES = st.fixed_dictionaries(
    {},
    optional={
        "title": st.text(st.characters(exclude_categories=["Cs", "Cc", "Zl", "Zp"]), max_size=12),
        "seed": st.integers(0, 2**63 - 1),
        "wall": st.fixed_dictionaries({"position": _NUMBER, "stiffness": _POSITIVE}),
        "hand": st.fixed_dictionaries({"rest": _NUMBER}, optional={"force": _RAMP | _TRACE}),
        "dissipation": st.lists(_ELEMENT, max_size=3),
        "event": _EVENTS.map(lambda events: sorted(events, key=lambda event: event["at"])),
    },
)


@pytest.mark.slow
@given(_SCENES)
def test_a_resolved_scene_runs_by_itself(tmp_path_factory, tables):
    """load(write(scene)) == scene: nothing is lost, converted twice or filled in anew."""
    resolved = scene(**tables)
    path = tmp_path_factory.mktemp("scene") / "scene.toml"
    path.write_text(to_toml(resolved.as_dict()), encoding="utf-8")
    assert same(load(path).as_dict(), resolved.as_dict())


def test_the_keys_of_a_table_stand_under_its_own_header():
    text = to_toml({"wall": {"inner": {"a": 1}, "position": -0.06}, "duration": 1.0})
    assert text == "duration = 1.0\n\n[wall]\nposition = -0.06\n\n[wall.inner]\na = 1\n"


def test_the_least_scene_is_readable():
    assert to_toml(LEAST).startswith('title = "least"\nduration = 1.0\n\n[device]\nmass = 0.01\n')
