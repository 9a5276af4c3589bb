"""`haploop advise`: what the first line says, formulas beside it, and that an interrupted advice goes on."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from haploop import api
from haploop.api.results import AdviceResult
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.bundled import bundled
from haploop.launch.scene.file import load
from haploop.launch.scene.toml_writer import to_toml
from haploop.launch.stability.judge import judge_scene
from haploop.logger.log.recording import MemoryLog
from haploop.protocol.scene.paths import value_at, with_value
from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.advice import advice_data
from haploop.tools.advise.families import DAMPING
from haploop.tools.advise.known import PUBLISHED, formulas
from haploop.tools.advise.report import assumes, describe_hand, sentences
from haploop.tools.advise.search import Found
from haploop.tools.advise.shown import advised_scene, ending_with
from haploop.tools.advise.subject import Assumed, make_subject
from haploop.tools.advise.walls.cases import Case, is_ideal, make_loop
from haploop.tools.advise.walls.limit import Limit
from haploop.tools.advise.withstand import Best, rounded_down
from haploop.tools.cli.app import app
from helpers.data.advices import ADVICE
from helpers.scenes.least import KINDS
from helpers.scenes.presets import loop_of


def test_a_rigid_device_without_delay_is_ideal_and_one_with_a_cable_or_a_delay_is_not():
    assert is_ideal(loop_of("premium15"))
    assert not is_ideal(loop_of("premium15_cable"))
    assert not is_ideal(loop_of("premium15", "clock.round_trip_delay=0.001"))


@pytest.mark.parametrize(("delay", "title"), [("0 ms", "upper bound, 1.00 N/mm"), ("1 ms", "1.00 N/mm")])
def test_the_scene_of_an_upper_bound_is_called_so_in_its_title(delay, title):
    best = Best(DAMPING, (0.5,), Limit(1000.0, 1100.0))
    found = Found((best,), best, 1000.0, None, None, 10)
    subject = make_subject("premium15", delay=delay)
    scene = advised_scene(subject, make_loop(subject.scene, False), found)
    assert scene
    assert scene.title.startswith(f"premium15: {title} with ")


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


def test_every_published_value_is_of_a_device_that_comes_with_haploop_and_has_a_source():
    assert set(PUBLISHED) <= set(bundled("devices"))
    assert all(value.source and value.stiffness_N_m > 0.0 for values in PUBLISHED.values() for value in values)


@pytest.mark.parametrize(("value", "down"), [(1969.7, 1960.0), (0.0, 0.0), (44.99, 44.9), (100.0, 100.0), (9.96, 9.95)])
def test_a_safe_stiffness_is_rounded_down(value, down):
    assert rounded_down(value) == pytest.approx(down)


def test_an_advice_tells_in_python_what_is_recommended_and_prints_as_the_command_does():
    assert ADVICE.recommended == {
        "element": "damping", "stiffness_N_m": 1640.0, "parameters": {"damping.damping": 1.1},
    }  # fmt: skip
    assert (ADVICE.stiffness_N_m, ADVICE.element, ADVICE.without_N_m) == (1640.0, "damping", 910.0)
    assert advice_data(ADVICE, [])["recommended"] == ADVICE.recommended
    assert repr(ADVICE) == "<Advice on mine: 1.64 N/mm with 1.1 N s/m of damping>"
    printed = str(AdviceResult(**vars(ADVICE)))
    assert printed.startswith("Advice on mine.")
    assert "1.64 N/mm with 1.1 N s/m of damping" in printed
    assert "\x1b" not in printed


@pytest.mark.long
@pytest.mark.slow
def test_an_advice_says_first_that_it_is_an_upper_bound_goes_on_when_stopped_and_leaves_scenes_that_rest_and_swing(
    tmp_path,
):
    out = tmp_path / "a"
    asked = ["advise", "premium15", "--workers", "1", "--out", str(out), "--json"]
    done = CliRunner().invoke(app, asked)
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["headline"].startswith("Upper bound, not advice: premium15 is taken as rigid")
    wall = f"at most {found['recommended']['stiffness_N_m'] / 1e3:.3g} N/mm | nothing"
    assert f"| `premium15` | {wall} |" in Path("docs/advise.md").read_text(encoding="utf-8")
    assert "for a hand: of 0.269 kg, 6.43 N s/m and 105 N/m, holding through a grip of " in found["advice"]
    assert "loses most: no friction: 0." in found["advice"]
    lines = (out / "walls.jsonl").read_text().splitlines()
    (out / "walls.jsonl").write_text("\n".join(lines[: len(lines) * 9 // 10]) + '\n{"torn')
    told = api.advise("premium15", workers=1, out=out)
    assert 0 < told.runs < found["runs"]
    again = json.loads(json.dumps(advice_data(told, sentences(told))))
    assert {key for key in found if again.get(key) != found[key]} == {"runs", "files"}
    assert told.recommended == found["recommended"]
    assert (told.stiffness_N_m, told.element) == (found["recommended"]["stiffness_N_m"], "nothing")
    assert repr(told).startswith("<Advice on premium15: at most ")
    assert len(repr(told)) < 120
    assert str(told).startswith("Upper bound, not advice")
    assert "advice_breaks.toml: the case that breaks first, with a wall of " in done.stderr
    assert "the wall alone (1 of 7) ..." in done.stderr
    advised = load(out / "advice.toml")
    assert value_at(advised, "wall.stiffness") == found["recommended"]["stiffness_N_m"]
    assert (out / "figure.png").stat().st_size > 10_000
    assert judge_scene(advised, KINDS).word == "steady"
    assert judge_scene(load(out / "advice_breaks.toml"), KINDS).word in ("limit-cycle", "growing", "diverged")


_STAGE = """
device = { mass = 0.085, damping = 0.12 }
friction.kinetic = 0.15
encoder.resolution = "0.2 m / 4096"
actuator.saturation = 18
clock.round_trip_delay = "1 ms"
"""
_CORNER = {"device mass": 0.8, "hand mass": 1.2, "hand damping": 0.8, "hand stiffness": 1.2, "friction": 0.8}
_CORNER |= {"device damping": 1.2, "actuator force": 0.8, "clock.round_trip_delay": 0.5}


@pytest.mark.slow
def test_a_scene_shows_what_broke_a_wall_that_pushes_find_steady_and_none_shows_what_no_hand_feels(tmp_path):
    (tmp_path / "stage.toml").write_text(_STAGE)
    subject = make_subject(str(tmp_path / "stage.toml"))
    loop = make_loop(subject.scene, subject.has_task)
    case = Case(2.0, tuple(_CORNER.items())).scene(loop)

    def ends(stiffness_N_m: float) -> Scene | None:
        damping = DAMPING.elements((4.9,))
        scene = replace(with_value(case, "wall.stiffness", stiffness_N_m), dissipation=damping)
        return ending_with(scene, loop, 1.75)

    assert not ends(100.0)
    shown = ends(2558.06)
    assert shown
    judged = replace(shown, run=replace(shown.run, verdict="pushed"))
    assert judge_scene(judged, KINDS).word == "steady"
    window = run_in_process(shown, KINDS, memory=MemoryLog())["window"]
    assert (shown.duration, window["from_s"]) == (1.75, 1.25)
    assert window["force_swing_N"] == pytest.approx(0.603, abs=1e-3)


@pytest.mark.parametrize(
    ("grip", "words"), [(None, "105 N/m, each"), ((3.6, 552.0), "a grip of 3.60 N s/m and 552 N/m, each")]
)
def test_the_hand_that_a_wall_is_for_is_told_with_its_grip(grip, words):
    told: Any = SimpleNamespace(hand=(0.269, 6.43, 105.0), grip=grip)
    assert f"{words} 20 % more or less" in describe_hand(told)


def test_a_directory_of_something_else_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    done = CliRunner().invoke(app, ["advise", "touch", "--out", str(tmp_path)])
    assert done.exit_code == 2
    assert "must be new or empty" in done.output


def test_a_directory_with_an_advice_on_another_scene_is_left_as_it_is(tmp_path):
    (tmp_path / "walls.jsonl").touch()
    (tmp_path / "asked.toml").write_text(to_toml(make_subject("falcon").scene.as_dict()))
    (tmp_path / "advice.json").write_text("{}")
    done = CliRunner().invoke(app, ["advise", "touch", "--out", str(tmp_path)])
    assert done.exit_code == 2
    assert f"{tmp_path} contains advice on another scene" in done.output
    assert (tmp_path / "advice.json").read_text() == "{}"


@pytest.mark.parametrize(
    ("right_N_m", "words"),
    [
        (
            33_700.0,
            "If it were right: about 34 N/mm with 12 N s/m of damping, not attacked. Measure friction.kinetic first",
        ),
        (17_500.0, "If it were right, the wall would be equally stiff within a tenth."),
    ],
)
def test_what_is_assumed_stands_in_the_answer_with_what_the_wall_would_be_were_it_right(right_N_m, words):
    limits = [Limit(value, 1.05 * value) for value in (16_000.0, 40_000.0, 30_000.0, right_N_m)]
    right = Best(DAMPING, (12.0,), limits[2], limits[3])
    told: Any = SimpleNamespace(
        assumed=((Assumed("friction.kinetic", "a guess"), *limits[:2]),), unchanged=SimpleNamespace(limit=limits[2]),
        found=SimpleNamespace(stiffness_N_m=17_000.0),
    )  # fmt: skip
    found = assumes(told, right)
    lead = "friction.kinetic, neither measured nor published: the wall withstands it at half and at twice its value. "
    assert found.startswith(lead + words)
