"""`haploop advise`: names, tasks, and that what it advises holds."""

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.protocol.scene.paths import value_at, with_value, without
from haploop.tools.advise.gains import COARSE, DAMPING, beside, first_choices
from haploop.tools.advise.margins import rounded_down
from haploop.tools.advise.subject import DEFAULT_HAND, InvalidRequest, apply_events, make_subject
from haploop.tools.advise.tasks import SEEDS, make_tasks
from haploop.tools.advise.variations import Change, corners, scale_quantities, single_changes
from haploop.tools.cli.main import app
from helpers.scenes.least import KINDS, scene

SCENES = Path(__file__).parents[2] / "launch" / "scenes"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("premum15", None, None, None), "did you mean premium15?"),
        (("touch", "choi", None, None), "did you mean choi2022?"),
        (("touch", None, None, "kalmann"), "did you mean kalman?"),
    ],
)
def test_a_wrong_name_is_answered_with_the_nearest(arguments, words):
    device, hand, delay, estimator = arguments
    with pytest.raises(InvalidRequest, match=words.replace("?", r"\?")):
        make_subject(device, hand, delay, estimator, (), KINDS)


@pytest.mark.parametrize("delay", ["2", "600 ms"])
def test_a_delay_that_no_task_outlasts_is_refused_and_a_forgotten_unit_is_suspected(delay):
    with pytest.raises(InvalidRequest, match=r'advice is given up to 0.5 s.*write "[0-9.]+ ms" for milliseconds'):
        make_subject("touch", None, delay, None, [], KINDS)


@given(delay_steps=st.integers(0, 5000))
def test_a_standard_task_lasts_for_twenty_round_trips_at_least(delay_steps):
    read = scene(clock={"round_trip_delay": delay_steps / 10_000}, wall={"position": 0.0, "stiffness": 1.0})
    for task in make_tasks(read, has_task=False).scenes:
        assert task.duration >= max(1.0, 20 * task.clock.round_trip_delay)


def test_a_scene_too_short_for_its_delay_is_judged_by_the_standard_tasks():
    fig6a = load(SCENES / "fig6a.toml")
    assert len(make_tasks(fig6a, has_task=True).scenes) == 1
    late = with_value(fig6a, "clock.round_trip_delay", 0.2)
    assert len(make_tasks(late, has_task=True).scenes) == 2


def test_a_hasty_look_takes_the_first_task_and_one_seed():
    noisy = scene(wall={"position": 0.0, "stiffness": 1.0}, noise={"deviation": 1e-6, "cutoff": 100.0})
    asked = make_tasks(noisy, has_task=False)
    [look] = asked.make_runs(100.0, [], thorough=False)
    assert look == asked.make_runs(100.0, [])[0]


def test_a_preset_gets_a_hand_and_standard_tasks_and_says_so():
    asked = make_subject("touch", None, "1 ms", None, [], KINDS)
    assert not asked.has_task
    assert DEFAULT_HAND in asked.notes[0]
    assert asked.scene.clock.round_trip_delay == 0.001
    made = make_tasks(asked.scene, asked.has_task)
    assert len(made.scenes) == 2
    assert "a tap at 0.2 m/s" in made.words


def test_another_hand_keeps_the_force_of_the_scene():
    asked = make_subject(str(SCENES / "fig6a.toml"), "fu_cavusoglu_x", None, None, [], KINDS)
    assert value_at(asked.scene, "hand.grip.stiffness") == 379.5
    assert value_at(asked.scene, "hand.force.value") == -0.65


def test_what_the_events_of_a_scene_change_is_changed_from_the_start():
    asked = load(SCENES / "swap.toml")
    assert asked.dissipation[0].name == "damping"
    done = apply_events(asked)
    assert [table.name for table in done.dissipation] == ["unidirectional-inertia"]
    assert not done.event


def test_a_scene_whose_force_comes_and_goes_is_not_judged_by_it():
    assert len(make_tasks(load(SCENES / "tap.toml"), True).scenes) == 2
    assert len(make_tasks(load(SCENES / "fig6a.toml"), True).scenes) == 1


def test_noise_is_judged_with_several_seeds():
    noisy = scene(wall={"position": 0.0, "stiffness": 1.0}, noise={"deviation": 1e-6, "cutoff": 100.0})
    runs = make_tasks(noisy, False).make_runs(100.0, [])
    assert len(runs) == 2 * SEEDS
    assert len({run.seed for run in runs}) == SEEDS


def test_a_delay_a_fifth_more_is_rounded_to_whole_steps_and_never_to_what_it_was():
    late = scene(clock={"round_trip_delay": 0.002}, wall={"position": 0.0, "stiffness": 1.0})
    assert scale_quantities(late, {"delay": 1.2}).clock.round_trip_delay == pytest.approx(0.0024)
    short = scene(clock={"round_trip_delay": 0.0001}, wall={"position": 0.0, "stiffness": 1.0})
    assert [scale_quantities(short, {"delay": f}).clock.round_trip_delay for f in (0.8, 1.2)] == [0.0, 0.0002]


def test_corners_take_every_quantity_both_ways():
    read = scene(
        clock={"round_trip_delay": 0.002}, hand={"mass": 0.1, "damping": 1.0, "stiffness": 10.0},
        wall={"position": 0.0, "stiffness": 1.0},
    )  # fmt: skip
    assert len(list(corners(read))) == 2**5
    assert len(single_changes(read)) == 10
    assert Change("delay", 1.2).words == "20 % more delay"


def test_beside_the_best_parameter_at_the_end_of_the_grid_the_search_goes_on():
    read = scene(wall={"position": 0.0, "stiffness": 1.0})
    tried = first_choices(DAMPING, read, COARSE)
    more = beside(DAMPING, tried[0], tried, COARSE, 0)
    assert max(more) > max(tried)
    assert all(choice not in tried for choice in more)


@pytest.mark.parametrize(("value", "down"), [(1969.7, 1900.0), (0.0, 0.0), (44.99, 44.0), (100.0, 100.0), (9.96, 9.9)])
def test_a_safe_gain_is_rounded_down(value, down):
    assert rounded_down(value) == pytest.approx(down)


@pytest.mark.slow
def test_the_advised_scene_is_steady_and_one_beyond_the_largest_is_not(tmp_path):
    done = CliRunner().invoke(
        app, ["advise", "choi2022_simulation", "--workers", "1", "--out", str(tmp_path / "a"), "--json"]
    )
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout.splitlines()[-1])
    advised = load(tmp_path / "a" / "advice.toml")
    assert value_at(advised, "wall.stiffness") == found["recommended"]["stiffness_N_m"]
    assert run_in_process(advised, KINDS)["verdict"] == "steady"
    nothing = found["elements"][0]
    assert nothing["largest"]["stiffness_N_m"] == pytest.approx(nothing["exact_N_m"], rel=0.03)
    beyond = with_value(without(advised, "dissipation"), "wall.stiffness", 1.3 * nothing["largest"]["stiffness_N_m"])
    assert run_in_process(beyond, KINDS)["verdict"] in ("limit-cycle", "diverged")
    assert (tmp_path / "a" / "figure.png").stat().st_size > 10_000
    assert found["why"]["because"].startswith("It buzzes")
