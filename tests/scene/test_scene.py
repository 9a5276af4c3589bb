"""The tables of a scene: defaults, and every mistake in one pass."""

import re
from typing import Annotated

import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.controller.dissipation import Element, Quantity
from haploop.launch.runs.loaded_scene import load as loaded_in_python
from haploop.launch.scene.check import resolve
from haploop.launch.scene.mistakes import SceneError
from haploop.launch.scene.reading.layers import Layers
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import Clock, ElementTable, Encoder, Hand, Scene, Wall
from haploop.protocol.ticks import Timebase, TimebaseError
from helpers.scenes.least import KINDS, LEAST, WALL, mistakes, scene


def test_defaults_are_filled_in_and_absent_tables_stay_absent():
    assert scene(run={"verdict": "pushed"}).as_dict() == {
        "title": "least",
        "duration": 1.0,
        "seed": 0,
        "diverged_beyond": 1.0,
        "clock": {"plant_rate": 10_000, "control_rate": 1_000, "round_trip_delay": 0.0, "integrator": "exact"},
        "device": {"mass": 0.01, "damping": 0.1, "position": 0.0, "velocity": 0.0},
        "run": {"log": "steps", "pin": True, "block_ticks": 1000, "window_blocks": 2, "deadline": 5.0}
        | {"verdict": "pushed", "faulty_swap": "restore"},
    }
    assert scene(wall=WALL).wall == Wall(position=-0.06, stiffness=150.0, occupies="below")
    assert scene(encoder={"resolution": 1e-5}).encoder == Encoder(resolution=1e-5, rounding="nearest")
    assert scene(hand={}).hand == Hand(mass=0.0, damping=0.0, stiffness=0.0, rest=0.0)
    assert scene(dissipation=[{"kind": "damping", "damping": 1}]).dissipation[0].acts == "in-contact"


def test_whole_numbers_become_floats_where_a_float_is_meant():
    assert isinstance(value_at(scene(wall={"position": 0, "stiffness": 150}), "wall.stiffness"), float)


def test_an_empty_list_of_elements_is_no_list():
    assert "dissipation" not in scene(dissipation=[]).as_dict()


def test_a_resolved_scene_resolves_to_itself():
    first = scene(wall=WALL, hand={"force": {"kind": "ramp", "value": -1, "rise_time": 1}}, velocity={"cutoff": 50})
    assert scene(**first.as_dict()) == first


def test_every_mistake_is_reported_at_once():
    found = mistakes(
        duration=1.00005,
        clock={"round_trip_delay": 0.00205},
        device={"mas": 0.01, "damping": "2 ms"},
        wall={"position": True, "stifness": 150.0, "occupies": "belo"},
        hand={"force": {"kind": "rampp"}},
        encoder={"resolution": float("nan")},
        dissipation=[{"kind": "dampin"}, {"kind": "damping", "damping": -1.0}],
        event=[{"at": 0.5, "swap": {"kind": "nne"}, "pause": True}],
        walls={},
        run={"pin": 1},
    )
    starts = [
        'device.damping is "2 ms". ms is a time; a damping was expected, such as N s/m.',
        "device.mas is not a key of [device]; did you mean mass? Allowed: mass, damping, position, velocity.",
        'hand.force.kind is "rampp"; did you mean ramp? Allowed: constant, ramp, step, sine, minimum-jerk, trace.',
        "encoder.resolution is nan. It must be a finite number of m.",
        "wall.position is true. It must be a number in m",
        'wall.occupies is "belo"; did you mean below? Allowed: below, above.',
        "wall.stifness is not a key of [wall]; did you mean stiffness? Allowed: kind, position, stiffness,",
        'dissipation.0.kind is "dampin"; did you mean damping? Allowed: adaptive-inertia, bidirectional-inertia,',
        "dissipation.1.damping is -1.0. It must be at least 0 N s/m.",
        'event.0.swap.kind is "nne"; did you mean none? Allowed:',
        "run.pin is 1. It must be true or false.",
        "walls is not a key of a scene; did you mean wall? Allowed:",
        "clock.round_trip_delay is 0.00205. The round_trip_delay must be a whole number of plant steps",
        "duration is 1.00005. The duration must be a whole number of control ticks at 1000 Hz",
        "event.0 has swap and pause. An event has exactly one of swap, set, pause and stop.",
    ]
    assert [start for start in starts if not any(line.startswith(start) for line in found)] == []
    assert len(found) == len(starts)


def test_keys_below_a_heading_that_was_dropped_are_told_with_the_heading():
    force = {"kind": "constant", "value": -0.5}
    found = mistakes(hand={"mass": 0.1, "force": {**force, **WALL}})
    assert len(found) == 2
    assert all(line.endswith("Allowed: kind, value. Is the heading [wall] missing above it?") for line in found)
    there = mistakes(hand={"mass": 0.1, "force": {**force, **WALL}}, wall=WALL)
    of_none = mistakes(hand={"mass": 0.1, "force": {**force, **WALL, "colour": 1}})
    alone = mistakes(hand={"mass": 0.1, "force": {**force, "position": 1.0}})
    assert not any("heading" in line for line in (*there, *of_none, *alone))


def test_a_required_key_that_is_misspelt_is_one_mistake_and_one_that_is_misspelt_elsewhere_two():
    (one,) = mistakes(device={"mas": 0.01, "damping": 0.0})
    assert one.startswith("device.mas is not a key of [device]; did you mean mass?")
    found = mistakes(device={"damping": 0.0}, hand={"mas": 0.01})
    assert sum("device.mass is missing" in line for line in found) == 1


@pytest.mark.parametrize("key", ["device", "duration"])
def test_what_must_be_there_is_asked_for(key):
    with pytest.raises(SceneError, match=f"scene.toml: {key} is missing"):
        resolve(Layers("scene.toml", {k: v for k, v in LEAST.items() if k != key}), KINDS)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("tables", "sentence"),
    [
        ({"device": 3}, "device is 3. It must be a table."),
        ({"title": 3}, "title is 3. It must be text in quotes."),
        ({"dissipation": {"kind": "damping"}}, "dissipation is one table. It must be a list of tables: [["),
        ({"dissipation": [{"damping": 1}]}, "dissipation.0.kind is missing. Allowed: "),
        ({"wall": [WALL]}, "wall is a list of tables. It must be one table: [wall], one pair of brackets."),
        ({"dissipation": [3]}, "dissipation.0 is 3. It must be a table."),
        ({"dissipation": [{"kind": "none"}]}, 'dissipation.0.kind is "none". Allowed: '),
        ({"hand": {"force": 1.0}}, "hand.force is 1.0. It must be a table."),
        (
            {"hand": {"force": {"kind": "trace", "time": [0.0]}}},
            'hand.force.force is missing. It must be a list of numbers. A text file may hold both: file = "push.csv".',
        ),
        (
            {"clock": {"plant_rate": 1500}},
            "clock.control_rate is 1000. The control_rate must divide plant_rate, but 1500 Hz is 1.5 times 1000 Hz; "
            "the nearest legal values are a control_rate of 750 Hz or 1500 Hz, or a plant_rate of 1000 Hz or 2000 Hz.",
        ),
        ({"run": {"log": "ticcs"}}, 'run.log is "ticcs"; did you mean ticks? Allowed: steps, ticks, none.'),
    ],
)
def test_a_wrong_shape_is_one_sentence(tables, sentence):
    [mistake] = mistakes(**tables)
    assert mistake.startswith(sentence)


@pytest.mark.parametrize("kind", [{}, {"kind": "dampping"}])
def test_a_table_without_a_known_kind_has_its_misspelt_keys_told_at_once(kind):
    told = mistakes(dissipation=[{**kind, "dampin": 2.0, "mass": 1.0}])
    assert [line.split()[0] for line in told] == ["dissipation.0.kind", "dissipation.0.dampin"]
    assert "is a key of no kind; did you mean damping?" in told[1]


@pytest.mark.parametrize(("plant", "control"), [(1_000_003, 1000), (999_999_937, 2), (3, 10), (10_000, 3000)])
def test_a_rate_that_does_not_divide_is_told_ones_that_do(plant, control):
    with pytest.raises(TimebaseError) as error:
        Timebase.from_clock(Clock(plant_rate=plant, control_rate=control), 1.0)
    controls, plants = (
        str(error.value).splitlines()[0].partition("the nearest legal values")[2].split("a plant_rate of")
    )
    assert all(plant % int(rate) == 0 for rate in re.findall(r"\d+", controls))
    assert all(int(rate) % control == 0 for rate in re.findall(r"\d+", plants))
    assert "control_rate of" in controls


def test_the_mistake_carries_its_parts():
    with pytest.raises(SceneError) as error:
        scene(wall=WALL | {"stifness": 1})
    [mistake] = error.value.mistakes
    assert (mistake.file, mistake.key, mistake.nearest) == ("scene.toml", "wall.stifness", "stiffness")


@pytest.mark.parametrize("samples", [([0.0, 0.0], [1.0, 2.0]), ([0.0, 1.0], [1.0]), ([], [])])
def test_a_trace_whose_samples_are_no_function_of_time_is_refused(samples):
    [mistake] = mistakes(hand={"force": {"kind": "trace", "time": samples[0], "force": samples[1]}})
    assert mistake.startswith("hand.force does not fit together. Sample ")


def test_samples_given_in_python_that_do_not_fit_together_are_told_as_values_not_as_the_file_they_replace():
    trace = {"kind": "trace", "time": [0.0, 1.0, 0.5], "force": [0.0, 0.0, 0.0]}
    with pytest.raises(SceneError, match=r"^values: hand\.force does not fit together\. Sample 2:"):
        loaded_in_python("demo", {"hand.force": trace})


def test_a_value_of_a_type_that_no_scene_holds_is_told_with_its_key():
    with pytest.raises(TypeError, match=r"^values: wall\.stiffness: A scene holds text, .* but not None\.$"):
        loaded_in_python("demo", {"wall.stiffness": None})


def test_a_plugin_brings_its_own_parameters_units_and_defaults():
    class Brake(Element):
        kind = "limit"  # the name of its parameter, to make sure that the two are told apart
        limit: Annotated[float, Quantity("N", above=0)] = 1.0

        def force(self, motion):
            return -self.limit * motion.v

    def read(kinds, **parameters):
        data = {**LEAST, "dissipation": [{"kind": "limit", **parameters}]}
        return resolve(Layers("scene.toml", data), kinds).dissipation[0]  # pyright: ignore[reportArgumentType]

    for kinds in ({"limit": Brake}, KINDS | {"limit": Brake}):
        assert read(kinds) == ElementTable(name="limit", acts="in-contact", parameters={"limit": 1.0})
        assert read(kinds, limit="2 kN").parameters == {"limit": 2000.0}
        with pytest.raises(SceneError, match=r"dissipation\.0\.limit is 0\. It must be above 0 N\."):
            read(kinds, limit=0)


# Any value at all, with the names of a scene made likely so that the inner checks are reached.
_NAMES = st.sampled_from(
    [*(field.name for field in Scene.fields()), "kind", "at", "swap", "set", "force", "time", "element"]
) | st.text(max_size=3)
_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.sampled_from([*KINDS, "none", "trace", "1 mm"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(_NAMES, inner, max_size=4),
    max_leaves=12,
)


@given(st.dictionaries(_NAMES, _VALUES, max_size=5))
def test_anything_at_all_is_a_scene_or_a_list_of_mistakes(tables):
    try:
        read = scene(**tables)
    except SceneError as error:
        read = error.mistakes
    assert read
