"""`haploop advise`: names, loops and cases, what the first line says, and that an interrupted advice goes on."""

import json
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from haploop.launch.scene.bundled import bundled
from haploop.launch.scene.file import load
from haploop.launch.scene.mistakes import SceneError
from haploop.launch.spec import OutputError
from haploop.protocol.scene.paths import value_at, with_value
from haploop.tools.advise.advice import is_ideal
from haploop.tools.advise.families import DAMPING
from haploop.tools.advise.known import PUBLISHED, formulas
from haploop.tools.advise.report import assumes
from haploop.tools.advise.search import Best, rounded_down
from haploop.tools.advise.subject import (
    DEFAULT_HAND,
    Assumed,
    InvalidRequest,
    apply_events,
    assumptions,
    make_subject,
)  # fmt: skip
from haploop.tools.advise.walls.cases import (
    HOLDS,
    Case,
    attack,
    every_case,
    hold_N,
    make_loop,
    ranges,
    scale_quantities,
    slowness,
)  # fmt: skip
from haploop.tools.advise.walls.limit import Limit
from haploop.tools.advise.walls.trial import Failure, Store, Tried
from haploop.tools.cli.app import app
from helpers.scenes.least import KINDS, scene

SCENES = Path(__file__).parents[2] / "launch" / "scenes"


def loop_of(device: str, *overrides: str):
    asked = make_subject(device, None, None, None, overrides, KINDS)
    return make_loop(asked.scene, asked.has_task)


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


def test_a_preset_gets_a_hand_and_says_so():
    asked = make_subject("touch", None, "1 ms", None, [], KINDS)
    assert not asked.has_task
    assert DEFAULT_HAND in asked.notes[0]
    assert asked.scene.clock.round_trip_delay == 0.001


def test_another_hand_keeps_the_force_of_the_scene():
    asked = make_subject(str(SCENES / "fig6a.toml"), "fu_cavusoglu_x", None, None, [], KINDS)
    assert value_at(asked.scene, "hand.grip.stiffness") == 379.5
    assert value_at(asked.scene, "hand.force.value") == -0.65


def test_what_the_events_of_a_scene_change_is_changed_from_the_start():
    done = apply_events(load(SCENES / "swap.toml"))
    assert [table.name for table in done.dissipation] == ["unidirectional-inertia"]
    assert not done.event


def test_the_hold_of_a_scene_is_what_its_wall_bears_when_the_hands_own_spring_has_taken_its_part():
    fig6a = load(SCENES / "fig6a.toml")  # -0.65 N, of which 10 N/m take 0.6 N to the wall at -60 mm
    assert hold_N(make_loop(fig6a, has_task=True)) == pytest.approx(0.05)
    assert hold_N(make_loop(fig6a, has_task=False)) == 1.0
    assert hold_N(loop_of("touch")) == pytest.approx(0.3 * 3.3)


def test_a_late_loop_is_watched_for_sixty_round_trips():
    late = loop_of("touch", "clock.round_trip_delay=0.2")
    assert slowness(late) * 2.75 == pytest.approx(12.0, rel=0.02)
    assert Case(1.0).scene(late).duration >= 12.0


def test_a_rigid_device_without_delay_is_ideal_and_one_with_a_cable_or_a_delay_is_not():
    assert is_ideal(loop_of("premium15"))
    assert not is_ideal(loop_of("premium15_cable"))
    assert not is_ideal(loop_of("premium15", "clock.round_trip_delay=0.001"))


def test_every_corner_takes_every_quantity_both_ways_and_the_attack_has_other_cases():
    of = ranges(loop_of("premium15"))
    assert len(every_case(of)) == (1 + 2**4) * len(HOLDS)
    assert len({case.corner for case in attack(of)}) == 1 + 2**4
    assert not set(attack(of)) & set(every_case(of))
    assert len(ranges(loop_of("premium15", "clock.round_trip_delay=0.002"))) == 5


def test_of_many_corners_the_search_takes_32_in_which_no_two_quantities_go_together_and_the_attack_takes_all():
    loop = loop_of("premium15_cable")
    of = ranges(loop, [key.key for key in assumptions(bundled("devices")["premium15_cable"])])
    corners = {case.corner for case in every_case(of)} - {()}
    signs = np.array([[factor > 1.0 for _, factor in one] for one in corners]) * 2.0 - 1.0
    assert signs.shape == (32, len(of))
    assert np.array_equal(signs.T @ signs, 32.0 * np.eye(len(of)))
    assert len({case.corner for case in attack(of)}) == 1 + 2 ** len(of)


def test_an_assumed_number_is_taken_half_and_double_and_not_a_fifth_off_with_its_quantity_as_well():
    loop = loop_of("omega3")
    of = ranges(loop, ["device.mass", "friction.kinetic"])
    assert "device mass" not in of
    assert of["device.mass"] == of["friction.kinetic"] == (0.5, 2.0)
    cable = scale_quantities(loop_of("premium15_cable"), {"device mass": 1.2, "transmission.motor_mass": 0.5})
    assert value_at(cable, "device.mass") == pytest.approx(1.2 * 0.0496)
    assert value_at(cable, "transmission.motor_mass") == pytest.approx(0.5 * 0.0029)


def test_a_delay_a_fifth_more_is_rounded_to_whole_steps_and_never_to_what_it_was():
    late = scene(clock={"round_trip_delay": 0.002}, wall={"position": 0.0, "stiffness": 1.0})
    assert scale_quantities(late, {"delay": 1.2}).clock.round_trip_delay == pytest.approx(0.0024)
    short = scene(clock={"round_trip_delay": 0.0001}, wall={"position": 0.0, "stiffness": 1.0})
    assert [scale_quantities(short, {"delay": f}).clock.round_trip_delay for f in (0.8, 1.2)] == [0.0, 0.0002]


def test_the_grip_is_scaled_with_the_hand_and_the_motor_with_the_device():
    cable = loop_of("premium15_cable")
    heavy = scale_quantities(cable, {"device mass": 1.2, "hand stiffness": 0.8})
    assert value_at(heavy, "transmission.motor_mass") == pytest.approx(1.2 * 0.0029)
    assert value_at(heavy, "hand.grip.stiffness") == pytest.approx(0.8 * 552.4)


@pytest.mark.parametrize(
    ("device", "chatter_N_m", "sampling_N_m"),
    [("premium15", 3345.0, 22.8), ("touch", 9455.0, 20.0), ("falcon", 15789.0, 200.0), ("omega3", 40000.0, 200.0)],
)
def test_the_formulas_of_abbott_and_okamura_come_one_by_one_with_the_numbers_of_the_device(
    device, chatter_N_m, sampling_N_m
):
    chatter, sampling, *_ = formulas(loop_of(device))
    assert chatter.stiffness_N_m == pytest.approx(chatter_N_m, rel=1e-3)
    assert sampling.stiffness_N_m == pytest.approx(sampling_N_m)


def test_what_a_device_file_assumes_is_known_and_what_a_file_built_on_it_measures_is_not():
    files = bundled("devices")
    assert {of.key for of in assumptions(files["omega3"])} == {"device.mass", "device.damping", "friction.kinetic"}
    assert {of.key for of in assumptions(files["falcon"])} == {"device.mass", "device.damping", "friction.kinetic"}
    assert not assumptions(files["premium15"])
    of_cable = {of.key for of in assumptions(files["premium15_cable"])}
    assert {"transmission.stiffness", "transmission.motor_mass"} <= of_cable
    assert "friction.kinetic" not in of_cable


def test_every_published_value_is_of_a_device_that_comes_with_haploop_and_has_a_source():
    assert set(PUBLISHED) <= set(bundled("devices"))
    assert all(value.source and value.stiffness_N_m > 0.0 for values in PUBLISHED.values() for value in values)


@pytest.mark.parametrize(("value", "down"), [(1969.7, 1960.0), (0.0, 0.0), (44.99, 44.9), (100.0, 100.0), (9.96, 9.95)])
def test_a_safe_stiffness_is_rounded_down(value, down):
    assert rounded_down(value) == pytest.approx(down)


@pytest.mark.slow
def test_an_advice_says_first_that_it_is_an_upper_bound_goes_on_when_stopped_and_leaves_a_scene_that_runs(tmp_path):
    out = tmp_path / "a"
    asked = ["advise", "touch", "--workers", "1", "--out", str(out), "--json"]
    done = CliRunner().invoke(app, asked)
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["headline"].startswith("Upper bound, not advice: touch is taken as rigid")
    lines = (out / "walls.jsonl").read_text().splitlines()
    advised = load(out / "advice.toml")
    assert value_at(advised, "wall.stiffness") == found["recommended"]["stiffness_N_m"]
    assert (out / "figure.png").stat().st_size > 10_000
    (out / "walls.jsonl").write_text("\n".join(lines[: len(lines) // 2]) + '\n["torn')
    again = json.loads(CliRunner().invoke(app, asked).stdout.splitlines()[-1])
    assert 0 < again.pop("runs") < found.pop("runs")
    assert again == found


def test_a_device_of_ones_own_is_taken_as_the_presets_are_and_a_scene_with_a_wall_as_a_task(tmp_path):
    mine = tmp_path / "mine.toml"
    mine.write_text('extends = "omega3.toml"\n[device]\nmass = 0.3  # weighed\n')
    (tmp_path / "omega3.toml").write_text(bundled("devices")["omega3"].read_text())
    asked = make_subject(str(mine), None, None, None, [], KINDS)
    assert not asked.has_task
    assert asked.scene.device.mass == 0.3
    assert {of.key for of in asked.assumed} == {"device.damping", "friction.kinetic"}
    assert make_subject("fig6c", None, None, None, [], KINDS).has_task


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ("[device]\nmass = 0.0", "device.mass is 0.0. It must be above 0 kg"),
        ("[device]\nmass = -0.1", "device.mass is -0.1. It must be above 0 kg"),
        ("[device]\nmass = 1e308", "device.mass is 1e\\+308. It must be at most"),
        ("[device]\nmass = 0.1\n[friction]\nkinetic = 1e308", "friction.kinetic is 1e\\+308. It must be at most"),
        ("[device]\nmass = 0.1\n[encoder]\nresolution = nan", "encoder.resolution is nan. It must be a finite number"),
    ],
)
def test_a_device_of_absurd_numbers_is_refused_with_what_was_expected(tmp_path, tables, words):
    (tmp_path / "mine.toml").write_text(tables)
    with pytest.raises(SceneError, match=words):
        make_subject(str(tmp_path / "mine.toml"), None, None, None, [], KINDS)


def test_a_directory_of_something_else_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    done = CliRunner().invoke(app, ["advise", "touch", "--out", str(tmp_path)])
    assert done.exit_code == 2
    assert "must be new or empty" in done.output


def test_a_changed_number_of_a_loop_makes_another_key():
    store, cases = Store(), [Case(1.0)]
    loop = loop_of("touch")
    key = store.key(loop, Tried(1000.0), cases)
    assert key == store.key(loop_of("touch"), Tried(1000.0), [Case(1.0)])
    changed = with_value(loop, "friction.kinetic", 0.261)
    others = {store.key(changed, Tried(1000.0), cases), store.key(loop, Tried(1000.1), cases),
              store.key(loop, Tried(1000.0), [Case(1.5)])}  # fmt: skip
    assert len(others | {key}) == 4


@pytest.mark.parametrize(
    ("right_N_m", "words"),
    [
        (33_700.0, "Were it right: about 34 N/mm with 12 N s/m of damping. Measure friction.kinetic first"),
        (17_500.0, "Were it right, the wall would be as stiff within a tenth."),
    ],
)
def test_what_is_assumed_stands_in_the_answer_with_what_the_wall_would_be_were_it_right(right_N_m, words):
    limits = [Limit(value, 1.05 * value) for value in (16_000.0, 40_000.0, 30_000.0, right_N_m)]
    right = Best(DAMPING, (12.0,), limits[2], limits[3])
    told: Any = SimpleNamespace(
        assumed=((Assumed("friction.kinetic", "a guess"), *limits[:2]),), described=limits[2],
        found=SimpleNamespace(stiffness_N_m=17_000.0),
    )  # fmt: skip
    found = assumes(told, right)
    assert found.startswith("friction.kinetic, published nowhere: the wall bears half and twice of it. " + words)


def test_lines_of_a_damaged_store_are_passed_over_and_whole_ones_of_two_advices_at_once_are_kept(tmp_path):
    file, failure = tmp_path / "walls.jsonl", Failure("hold x 3", 1.0, gone=False, force_N=0.1)
    one, other = Store(file), Store(file)
    one.add({"a": None})
    other.add({"b": failure})
    with file.open("ab") as lines:
        lines.write(b'["c", {"case": "x", "at\n\xff\xfe\n[1]\n{}\n["d", {"no": 1}]\n["e", nul')
    one.add({"f": None})
    assert Store(file).known == {"a": None, "b": failure, "f": None}


@pytest.mark.skipif(os.name == "nt", reason="Windows has no limit of a file's size")
def test_a_full_disk_is_told_in_a_sentence_and_what_was_kept_stays(tmp_path):
    import resource
    import signal

    file = tmp_path / "walls.jsonl"
    kept = Store(file)
    kept.add({"a": None})
    before, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20, before[1]))
    try:
        with pytest.raises(OutputError, match=r"walls.jsonl, where .* cannot be used: File too large. Make room"):
            kept.add({"b": None, "c": None})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    kept.add({"d": None})
    assert {"a", "d"} <= Store(file).known.keys() <= {"a", "b", "d"}


def test_a_store_that_cannot_be_read_is_told_in_a_sentence(tmp_path):
    with pytest.raises(OutputError, match="cannot be used: "):
        Store(tmp_path)
