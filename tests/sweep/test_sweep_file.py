"""Sweep files: what they say, and every mistake in them at once."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from haploop.launch.scene.file import load as scene_of
from haploop.launch.scene.mistakes import SceneError
from haploop.launch.scene.toml_writer import to_toml
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import ElementTable
from haploop.tools.sweep.cells import Extra
from haploop.tools.sweep.sweep_file import load
from haploop.tools.sweep.table import Column
from helpers.scenes.least import KINDS
from helpers.scenes.sweep_files import GRID, PRESS, loaded, mistakes, sweep_file


def test_axes_hold_si_numbers_with_both_ends(tmp_path: Path) -> None:
    made = loaded(
        tmp_path,
        """
[axes]
"wall.stiffness" = { from = "0.1 N/mm", to = "400 N/m", step = "0.1 N/mm" }
"dissipation.0.damping" = { from = 0.01, to = 1.0, count = 3, scale = "log" }
"clock.round_trip_delay" = ["0 ms", "1 ms", 0.002]
""",
    )
    stiffness, damping, delay = made.axes
    assert stiffness.values == (100.0, 200.0, 300.0, 400.0)
    assert damping.values == (0.01, pytest.approx(0.1), 1.0)
    assert delay.values == (0.0, 0.001, 0.002)
    assert [axis.unit for axis in made.axes] == ["N/m", "N s/m", "s"]


def test_even_steps_are_the_numbers_that_a_person_would_write(tmp_path: Path) -> None:
    text = '[axes]\n"hand.mass" = { from = 0.1, to = 0.8, step = 0.1 }\n'
    assert loaded(tmp_path, text).axes[0].values == (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
    text = '[axes]\n"hand.mass" = { from = 0.3, to = 0.1, count = 3 }\n'
    assert loaded(tmp_path, text).axes[0].values == (0.3, 0.2, 0.1)


def test_every_combination_is_a_cell_once_with_the_seeds_after_that_of_the_scene(tmp_path: Path) -> None:
    made = loaded(tmp_path, "repeat = 3\n" + GRID)
    assert made.count == 4 * 5 * 3
    seen = {(tuple(values.values()), seed) for values, seed in map(made.values, range(made.count))}
    assert len(seen) == made.count
    assert {seed for _, seed in seen} == {7, 8, 9}


def test_seeds_that_an_axis_gives_are_not_drawn_again(tmp_path: Path) -> None:
    axes = "[axes]\nseed = [1, 2]\n"
    assert loaded(tmp_path, axes).count == 2
    with pytest.raises(SceneError, match=r"repeat is 3\. It draws seeds, and so does the axis seed; leave one"):
        loaded(tmp_path, "repeat = 3\n" + axes)


def test_the_scene_of_a_cell_is_the_base_but_for_its_values_and_seed(tmp_path: Path) -> None:
    made = loaded(tmp_path, "repeat = 2\n" + GRID)
    cell = made.number({"wall.stiffness": 2, "dissipation.0.damping": 4}, 1)
    scene = made.scene(cell)
    assert value_at(scene, "wall.stiffness") == 300.0
    assert value_at(scene, "dissipation.0.damping") == 1.0
    assert scene.seed == 8
    assert scene == replace(made.base, wall=scene.wall, dissipation=scene.dissipation, seed=8)
    assert value_at(made.base, "wall.stiffness") == 150.0


def test_a_cell_is_the_scene_with_its_values_set_and_its_text_too_though_it_shares_tables(tmp_path: Path) -> None:
    """Every cell, one after the other: none leaves anything in the base or in those after it."""
    made = loaded(tmp_path, GRID)
    before = to_toml(made.base.as_dict())
    for cell in range(made.count):
        scene, (values, seed) = made.scene(cell), made.values(cell)
        by_itself = scene_of(tmp_path / "press.toml", [f"{key}={value!r}" for key, value in values.items()], KINDS)
        assert to_toml(scene.as_dict()) == to_toml(replace(by_itself, seed=seed).as_dict())
        assert made.row(cell, scene, {"ended": "done"})["scene"] == to_toml(scene.as_dict())
        assert scene.hand is made.base.hand
    assert to_toml(made.base.as_dict()) == before


def test_cells_that_differ_in_structure_are_apart_and_their_columns_in_the_order_of_the_file(tmp_path: Path) -> None:
    made = loaded(
        tmp_path,
        '[axes]\n"wall.stiffness" = [1, 2, 3]\n"clock.round_trip_delay" = [0, 0.001]\n"hand.mass" = [0.01, 0.02]\n',
    )
    groups = [group.items for group in made.groups()]
    assert groups == [range(6), range(6, 12)]
    delays = [{made.values(cell)[0]["clock.round_trip_delay"] for cell in group} for group in groups]
    assert delays == [{0.0}, {0.001}]
    assert [column.name for column in made.columns()][:4] == ["cell", *made.values(0)[0]]


def test_names_and_whole_tables_can_be_an_axis(tmp_path: Path) -> None:
    made = loaded(
        tmp_path,
        """
[axes]
"encoder.rounding" = ["nearest", "floor"]
"dissipation" = [[], [{ kind = "unidirectional-inertia", mass = 0.01 }]]
""",
    )
    kinds = [[element.name for element in made.scene(cell).dissipation] for cell in range(4)]
    assert kinds == [[], ["unidirectional-inertia"], [], ["unidirectional-inertia"]]
    assert made.axes[1].entry(made.axes[1].values[1]) == '[{ kind = "unidirectional-inertia", mass = 0.01 }]'


def test_a_name_may_bring_the_key_of_another_axis(tmp_path: Path) -> None:
    text = """
[axes]
"dissipation.0.kind" = ["bidirectional-inertia", "unidirectional-inertia"]
"dissipation.0.mass" = [0.01, 0.02]
"""
    made = loaded(tmp_path, text)
    assert made.axes[1].unit == "kg"
    assert made.scene(3).dissipation == (ElementTable(name="unidirectional-inertia", parameters={"mass": 0.02}),)


def test_the_resolved_sweep_reads_back_to_itself_without_the_scene_file(tmp_path: Path) -> None:
    text = 'title = "t"\nrepeat = 2\n[set]\n"wall.position" = "-2 mm"\n' + GRID
    text += '[bisect]\naxis = "wall.stiffness"\ntolerance = "1 N/m"\nholds = "no-contact"\n'
    made = loaded(tmp_path, text, ["hand.mass=0.02"])
    assert (value_at(made.base, "wall.position"), value_at(made.base, "hand.mass")) == (-0.002, 0.02)
    alone = tmp_path / "alone"
    alone.mkdir()
    (alone / "resolved.toml").write_text(made.toml())
    again = load(alone / "resolved.toml")
    assert again.toml() == made.toml()
    assert again == made
    assert tomllib.loads(made.toml())["axes"]["wall.stiffness"] == [100.0, 200.0, 300.0, 400.0]


def test_a_cell_between_the_values_has_its_own_value_and_the_others_of_its_neighbour(tmp_path: Path) -> None:
    made = loaded(tmp_path, GRID + '[bisect]\naxis = "wall.stiffness"\nrelative = 0.1\n')
    values, seed = made.values(Extra(99, 7, 123.0))
    assert values == {**made.values(7)[0], "wall.stiffness": 123.0}
    assert seed == 7


def test_every_mistake_is_told_at_once_with_file_key_and_nearest_name(tmp_path: Path) -> None:
    text = """
titel = "x"
repeat = 0
record = ["window.oscilation_m", "window", "verdict"]
[set]
"wall.position" = "3 kg"
[axes]
"wall.stifness" = { from = 500, to = 8000, step = 500 }
"dissipation.0.damping" = { from = 0.01, to = "10 kg", count = 30, scale = "log" }
"clock.round_trip_delay" = ["0 ms", nan, "2 m"]
[bisect]
axis = "wall.stifness"
holds = "stedy"
"""
    found = mistakes(tmp_path, text)
    expected = [
        "titel is not a key of a sweep; did you mean title?",
        "repeat is 0. It must be at least 1.",
        'record.0 is "window.oscilation_m"; did you mean window.oscillation_m?',
        'record.1 is "window". It is a table; name one of window.from_s',
        'set.wall.position is "3 kg". kg is a mass',
        "axes.wall.stifness is not a key of [wall]; did you mean stiffness?",
        'axes.dissipation.0.damping.to is "10 kg". kg is a mass',
        "axes.clock.round_trip_delay.1 is nan. It must be a finite number of s.",
        'bisect is { axis = "wall.stifness", holds = "stedy" }. It must have exactly one of tolerance and relative.',
        'bisect.holds is "stedy"; did you mean steady?',
    ]
    assert len(found) == len(expected)
    for sentence, begin in zip(found, expected, strict=True):
        assert sentence.startswith(begin)


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        ('"wall.stiffness" = { from = 500, to = 8050, step = 500 }', "such as 8000 or 8500."),
        ('"wall.stiffness" = { from = 500, to = 500, count = 2 }', "axes.wall.stiffness.to is 500. It must differ"),
        ('"wall.stiffness" = { from = 500, to = 800, step = -10 }', "stiffness.step is -10. It must be above 0"),
        ('"wall.stiffness" = { from = 500, to = 800, step = 1e-9 }', "an axis has at most 1000000."),
        ('"wall.stiffness" = { from = 500, to = 800 }', "exactly one of step and count."),
        ('"wall.stiffness" = { from = 0, to = 800, count = 3, scale = "log" }', "neither of them 0."),
        ('"wall.stiffness" = { from = 1, to = 800, step = 3, scale = "log" }', "a count in place of a step."),
        ('"wall.stiffness" = { from = 1, to = 800, count = 1 }', "stiffness.count is 1. It must be at least 2."),
        ('"wall.stiffness" = { to = 800, count = 2 }', "axes.wall.stiffness.from is missing."),
        ('"wall.stiffness" = [1, -2]', "axes.wall.stiffness.1 is -2. It must be at least 0 N/m."),
        ('"wall.stiffness" = [1, "1 N/m"]', "axes.wall.stiffness.1 is \"1 N/m\". Every value may be given only once."),
        ('"wall.stiffness" = []', "axes.wall.stiffness is []. It must have at least one value."),
        ('"wall.stiffness" = 7', "is 7. It must be a list, or a table with from, to"),
        ('wall.stiffness = [1]', "axes.wall is a table. Write the whole key in quotes"),
        ('"clock.integrator" = { from = 1, to = 2, count = 2 }', "It holds no number, so its values must be a list."),
        ('"clock.integrator" = ["exact", "exakt"]', 'axes.clock.integrator.1 is "exakt"; did you mean exact?'),
        ('"clock.plant_rate" = [10000, 10000.5]', "axes.clock.plant_rate.1 is 10000.5. It must be a whole number"),
        ('"dissipation.1.damping" = [1]', "[dissipation.1] of the base scene names no kind"),
        ('"dissipation.first.damping" = [1]', "dissipation is a list, counted from 0, so first is not a place in it."),
        ('"wall.stiffness.top" = [1]', "wall.stiffness holds a value, not a table."),
        ('"velocity.cutof" = [1]', "is not a key of [velocity]; did you mean cutoff?"),
        ('" " = [1]', "It must be a dotted key, such as wall.stiffness."),
        ("", "axes has 0. A sweep has one to 3 axes."),
    ],
)  # fmt: skip
def test_an_axis_that_cannot_be_used_is_one_mistake_that_says_why(axes: str, said: str, tmp_path: Path) -> None:
    found = mistakes(tmp_path, f"[axes]\n{axes}\n")
    assert len(found) == 1
    assert said in found[0]


def test_a_table_that_is_not_in_the_base_scene_can_be_swept_as_it_can_be_set(tmp_path: Path) -> None:
    made = loaded(tmp_path, '[axes]\n"velocity.cutoff" = ["100 Hz", "200 Hz"]\n')
    assert made.base.velocity is None
    assert value_at(made.scene(1), "velocity.cutoff") == 200.0


@pytest.mark.parametrize(
    ("bisect", "said"),
    [
        ('axis = "wall.stiffness"', "bisect is { axis"),
        ('axis = "wall.stiffness"\ntolerance = 1\nrelative = 0.1', "exactly one of tolerance and relative."),
        ('axis = "wall.stiffness"\ntolerance = "1 kg"', "kg is a mass"),
        ('axis = "wall.stiffness"\ntolerance = 0', "bisect.tolerance is 0. It must be above 0 N/m."),
        ('axis = "wall.stiffness"\nrelative = 1', "bisect.relative is 1. It must be below 1."),
        ('axis = "wall.stifness"\nrelative = 0.1', "did you mean wall.stiffness? It must be an axis: wall.stiffness"),
        ('axis = "clock.integrator"\nrelative = 0.1', "an axis of two or more numbers"),
    ],
)
def test_a_bisection_that_cannot_be_made_is_one_mistake_that_says_why(bisect: str, said: str, tmp_path: Path) -> None:
    axes = '[axes]\n"wall.stiffness" = [1, 2, 3]\n"clock.integrator" = ["exact", "rk4"]\n'
    found = mistakes(tmp_path, f"{axes}[bisect]\n{bisect}\n")
    assert len(found) == 1
    assert said in found[0]


def test_the_values_of_the_bisected_axis_go_one_way(tmp_path: Path) -> None:
    text = '[axes]\n"wall.stiffness" = [1, 3, 2]\n[bisect]\naxis = "wall.stiffness"\nrelative = 0.1\n'
    assert "must all increase or all decrease" in mistakes(tmp_path, text)[0]


def test_a_sweep_has_a_scene_or_holds_one(tmp_path: Path) -> None:
    path = tmp_path / "none.toml"
    path.write_text(GRID)
    with pytest.raises(SceneError, match=r"scene is missing\. A sweep has the path of a scene file"):
        load(path)
    path.write_text(f'scene = "press.toml"\n{GRID}[base]\nduration = 1\n')
    with pytest.raises(SceneError, match=r"scene is given beside \[base\]"):
        load(path)


def test_mistakes_of_the_scene_and_of_what_is_set_name_their_own_file(tmp_path: Path) -> None:
    path = sweep_file(tmp_path, '[set]\n"wall.stiffness" = -1\n' + GRID, PRESS.replace("0.05", "-0.05"))
    with pytest.raises(SceneError) as caught:
        load(path, ["hand.mass=heavy"])
    files = {mistake.key: mistake.file for mistake in caught.value.mistakes}
    assert files == {
        "duration": str(tmp_path / "press.toml"),
        "set.wall.stiffness": str(path),
        "hand.mass": "--set",
    }


@pytest.mark.parametrize("text", ["", "[axes", "scene = 3"])
def test_a_file_that_is_no_sweep_is_said_to_be_none(text: str, tmp_path: Path) -> None:
    path = tmp_path / "broken.toml"
    path.write_text(text)
    with pytest.raises(SceneError) as caught:
        load(path)
    assert all(mistake.file == str(path) for mistake in caught.value.mistakes)


def test_a_scene_given_as_a_sweep_is_said_to_be_one_and_a_sweep_without_its_axes_is_not(tmp_path: Path) -> None:
    path = tmp_path / "press.toml"
    path.write_text(PRESS)
    with pytest.raises(SceneError) as caught:
        load(path)
    [mistake] = caught.value.mistakes
    assert mistake.expected.startswith("This is a scene, for haploop run.")
    assert 'scene = "press.toml"' in mistake.expected
    [without_axes] = mistakes(tmp_path, "")
    assert without_axes.startswith("axes is missing.")


def test_what_is_recorded_may_come_from_any_corner_of_the_grid(tmp_path: Path) -> None:
    text = 'record = ["energy.elements.0.true_J", "energy.wall.leak.delay_J"]\n'
    text += '[axes]\n"dissipation" = [[], [{ kind = "damping", damping = 1 }]]\n'
    made = loaded(tmp_path, text)
    assert [column.name for column in made.record] == [
        "verdict",
        "energy.elements.0.true_J",
        "energy.wall.leak.delay_J",
    ]
    assert made.record[1].unit == "J"


def test_what_is_recorded_may_be_of_an_element_that_an_event_brings(tmp_path: Path) -> None:
    text = 'record = ["energy.elements.0.true_J"]\n[axes]\n"wall.stiffness" = [100, 200]\n[set]\ndissipation = []\n'
    swap = 'event = [{ at = 0.02, swap = { kind = "damping", damping = 1 }, element = 0 }]\n'
    with pytest.raises(SceneError, match="dotted key of a run's summary"):
        loaded(tmp_path, text)
    assert [column.name for column in loaded(tmp_path, text + swap).record] == ["verdict", "energy.elements.0.true_J"]


def test_what_a_verdict_rests_on_is_recorded_as_text_unless_the_verdict_is_the_cheap_one(tmp_path: Path) -> None:
    axes = '[axes]\n"wall.stiffness" = [100, 200]\n'
    pushed = loaded(tmp_path, '[set]\n"run.verdict" = "pushed"\n' + axes)
    assert pushed.record[-1] == Column("stability.provisos", "string")
    named = loaded(tmp_path, 'record = ["window.oscillation_m"]\n[set]\n"run.verdict" = "pushed"\n' + axes)
    assert [column.name for column in named.record] == ["verdict", "window.oscillation_m", "stability.provisos"]
    row = pushed.row(0, None, {"ended": "done", "verdict": "steady", "stability": {"provisos": ["a", "b"]}})
    assert row["stability.provisos"] == "a; b"
    cheap = loaded(tmp_path, '[set]\n"run.verdict" = "window"\n' + axes)
    assert "stability.provisos" not in [column.name for column in cheap.record]


def test_what_two_ticks_of_a_run_do_not_tell_is_recorded_as_it_is_declared(tmp_path: Path) -> None:
    record = 'record = ["stability.blown", "stability.chaotic", "stability.rate_1_s"]\n'
    axes = '[axes]\n"wall.stiffness" = [100, 200]\n[set]\n"run.verdict" = "pushed"\n'
    made = loaded(tmp_path, record + axes)
    assert [column.kind for column in made.record] == ["string", "string", "bool", "float64", "string"]
    row = made.row(0, None, {"ended": "done", "verdict": "steady", "stability": {"blown": "rests", "chaotic": None}})
    assert (row["stability.blown"], row["stability.chaotic"]) == ("rests", None)


def test_all_element_kinds_can_be_swept(tmp_path: Path) -> None:
    """The keys of every kind are found, whichever the base scene holds."""
    for kind, element in KINDS.items():
        for name, (quantity, _) in element.parameters().items():
            values = "[1, 2]" if quantity.whole else "[0.01, 0.02]"
            text = f'[axes]\n"dissipation.0.kind" = ["{kind}"]\n"dissipation.0.{name}" = {values}\n'
            assert loaded(tmp_path, text).axes[1].unit == quantity.unit
