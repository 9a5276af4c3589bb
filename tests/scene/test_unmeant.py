"""Scenes that are in order but cannot be meant: one line asks; of those that can be meant nothing is said."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import haploop.logger
from haploop.launch.plan.meant.notes import RULES, note_unmeant
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load, places
from haploop.launch.scene.mistakes import SceneError
from haploop.tools.cli.app import app
from helpers.scenes.least import KINDS, LEAST_TOML, WALL, scene

SCENES = Path(__file__).parents[2] / "launch/scenes"
PUSHED = {"mass": 0.1, "damping": 2.0, "stiffness": 100.0, "force": {"kind": "ramp", "value": -10, "rise_time": 0.1}}
FORCE = {"kind": "constant"}
HELD = {"mass": 0.1, "damping": 2.0, "stiffness": 100.0, "grip": {"stiffness": 500.0, "damping": 1.0}}
HELD["force"] = {**FORCE, "value": -0.2}
THROWN = {"mass": 0.05, "damping": 0.1, "velocity": -0.3}


def recorded(samples: int, last_N: float) -> dict[str, Any]:
    """A force sampled every 10 ms."""
    return {"kind": "trace", "time": [0.01 * k for k in range(samples)], "force": [*[-9.0] * (samples - 1), last_N]}


# Tables that break each rule, and a neighbour of them that keeps it; what the sentence must hold.
CASES: list[tuple[dict[str, Any], dict[str, Any], str]] = [
    ({"duration": 3, "clock": {"control_rate": 10_000, "round_trip_delay": 0.2}},
     {"duration": 3, "clock": {"control_rate": 2_000, "round_trip_delay": 0.2}}, "is 2000 ticks"),
    ({"clock": {"round_trip_delay": 1.0}}, {"clock": {"round_trip_delay": 0.9}}, "No force takes effect"),
    ({"hand": {"mass": 0.1, "stiffness": 50.0}}, {"hand": {"mass": 0.1, "stiffness": 50.0, "rest": 0.01}},
     "Nothing moves the device"),
    ({"hand": PUSHED, "friction": {"kinetic": 80.0}}, {"hand": PUSHED, "friction": {"kinetic": 8.0}},
     "Dry friction of 80 N holds the device, which the hand pushes by 10 N at most"),
    ({"hand": HELD | {"force": {**FORCE, "value": -1.5e-3}}, "friction": {"kinetic": 0.048}, "device": THROWN},
     {"hand": HELD, "friction": {"kinetic": 0.048}, "device": THROWN}, "is very small beside"),
    ({"hand": HELD | {"force": {**FORCE, "value": -1.5e-3}}, "wall": WALL, "device": THROWN},
     {"hand": HELD, "wall": {**WALL, "position": -5e-3}, "device": THROWN}, "touches it at most during a swing"),
    ({"hand": PUSHED, "wall": {"position": -60, "stiffness": 150}},
     {"hand": PUSHED, "wall": {"position": -0.06, "stiffness": 150}}, "The wall is at -60 m"),
    ({"hand": PUSHED | {"stiffness": 2000.0, "damping": 9.0}, "wall": WALL}, {"hand": PUSHED, "wall": WALL},
     "The wall is never reached"),
    ({"hand": {"mass": 0.1, "force": {"kind": "constant", "value": 1.0}}, "wall": WALL},
     {"hand": {"mass": 0.1, "force": {"kind": "constant", "value": -1.0}}, "wall": WALL}, "away from the wall"),
    ({"hand": HELD, "wall": WALL}, {"hand": HELD | {"force": {**FORCE, "value": -5.0}}, "wall": WALL},
     "The wall is never reached"),
    ({"hand": PUSHED | {"force": {**FORCE, "value": 5.0}}, "wall": WALL}, {"hand": PUSHED, "wall": WALL},
     "away from the wall"),
    ({"hand": PUSHED, "noise": {"deviation": 5e-3, "cutoff": 100}},
     {"hand": PUSHED, "noise": {"deviation": 5e-4, "cutoff": 100}}, "noise.deviation is 0.005 m; is that the unit"),
    ({"hand": PUSHED, "actuator": {"saturation": 5e-3}}, {"hand": PUSHED, "actuator": {"saturation": 5}},
     "actuator.saturation is 0.005 N; is that the unit"),
    ({"hand": PUSHED | {"force": {**FORCE, "value": -1000.0}}},
     {"hand": PUSHED | {"force": {**FORCE, "value": -100.0}}}, "hand.force.value is -1000 N; is that the unit"),
    ({"hand": PUSHED, "acceleration": {"source": "accelerometer"}},
     {"hand": PUSHED, "acceleration": {"source": "accelerometer"}, "accelerometer": {}}, "so it is ideal"),
    ({"hand": PUSHED, "wall": {"position": 0.01, "stiffness": 150}},
     {"hand": PUSHED, "wall": {"position": 0.0005, "stiffness": 150}}, "10 mm deep in the wall"),
    ({"hand": PUSHED, "encoder": {"resolution": 1.0}}, {"hand": PUSHED, "encoder": {"resolution": 1e-5}},
     "encoder.resolution is 1 m; is that the unit"),
    ({"hand": PUSHED, "device": {"mass": 50, "damping": 0.1}}, {"hand": PUSHED, "device": {"mass": 5, "damping": 0.1}},
     "device.mass is 50 kg; is that the unit"),
    ({"hand": PUSHED, "wall": {"position": -0.01, "stiffness": 4e5}},
     {"hand": PUSHED, "wall": {"position": -0.01, "stiffness": 4e4}}, "wall.stiffness is 400000 N/m; is that the unit"),
    ({"hand": PUSHED | {"force": recorded(99, -10.0)}}, {"hand": PUSHED | {"force": recorded(99, 0.0)}},
     "ends at 0.98 s and the run at 1 s; its last value, -10 N, is held"),
    ({"hand": PUSHED | {"force": recorded(99, -10.0)}}, {"hand": PUSHED | {"force": recorded(2, -10.0)}},
     "The recorded force ends at"),
    ({"hand": PUSHED | {"force": recorded(99, -10.0)}}, {"hand": PUSHED | {"force": recorded(100, -10.0)}},
     "The recorded force ends at"),
    ({"hand": PUSHED, "duration": 1e5}, {"hand": PUSHED, "duration": 1e4}, "The run has 1e+08 ticks"),
    ({"hand": PUSHED, "dissipation": [{"kind": "damping", "damping": 1.0}]},
     {"hand": PUSHED, "dissipation": [{"kind": "damping", "damping": 1.0, "acts": "always"}]}, "Nothing is ever in"),
    ({"hand": PUSHED, "wall": {"position": -0.01, "stiffness": 1}},
     {"hand": PUSHED, "wall": {"position": -0.01, "stiffness": 1000}}, "wall.stiffness is 1 N/m; is that the unit"),
    ({"hand": PUSHED, "wall": {"position": -0.01, "stiffness": 150}},
     {"hand": PUSHED, "wall": {"position": -0.01, "stiffness": 400}}, "gives way by 36 mm to the hand's largest force"),
    ({"hand": PUSHED, "wall": {"position": -0.12, "stiffness": 1000}},
     {"hand": PUSHED, "wall": {"position": -0.09, "stiffness": 1000}}, "holds the device 100 mm from"),
    ({"hand": PUSHED, "wall": WALL, "event": [{"at": 0.5, "set": {"wall.stiffness": each}} for each in (900, 950)]},
     {"hand": PUSHED, "wall": WALL, "event": [{"at": 0.5, "set": {"wall.stiffness": 900, "wall.position": -0.01}},
                                              {"at": 0.501, "set": {"wall.stiffness": 950}}]},
     "Two events change wall.stiffness at 0.5 s (tick 500)"),
]  # fmt: skip


@pytest.mark.parametrize(("broken", "kept", "words"), CASES, ids=[case[2] for case in CASES])
def test_a_rule_speaks_in_one_line_where_it_is_broken_and_is_silent_beside_it(broken, kept, words):
    still = {"device": {"mass": 0.01, "damping": 0.1, "velocity": 0.1}} if "hand" not in broken else {}
    said = [note for note in note_unmeant(scene(**still | broken)) if words in note]
    assert len(said) == 1
    assert "\n" not in said[0]
    assert not [note for note in note_unmeant(scene(**still | kept)) if words.split(" is ")[-1] in note]


def test_every_rule_has_its_case():
    said = [note for broken, _, _ in CASES for note in note_unmeant(scene(**broken))]
    begins = [rule.sentence.partition("{")[0] for rule in RULES]
    assert all(any(note.startswith(begin) for note in said) for begin in begins)


@pytest.mark.parametrize("path", sorted(SCENES.rglob("*.toml")), ids=lambda path: path.stem)
def test_of_a_shipped_scene_nothing_is_asked(path):
    assert not note_unmeant(load(path))


def farthest_m(tmp_path: Path, **tables: Any) -> float:
    """How far a device comes when no wall is there, to the wall's side."""
    run_in_process(scene(**tables), KINDS, out=tmp_path)
    return -float(haploop.logger.read(tmp_path)["/plant"]["x"].min())


@pytest.mark.parametrize("damping", [0.05, 1.0, 20.0])
def test_a_wall_called_out_of_reach_is_not_met_even_by_a_force_at_the_natural_frequency(tmp_path, damping):
    hand = {"mass": 0.09, "stiffness": 100.0, "damping": damping}
    frequency = np.sqrt(100.0 / 0.1) / (2.0 * np.pi)
    hand["force"] = {"kind": "sine", "amplitude": 0.5, "frequency": frequency}
    device = {"mass": 0.01, "damping": 0.0, "velocity": -0.1}
    reached = farthest_m(tmp_path, hand=hand, device=device)

    def is_noted(place_m: float) -> bool:
        notes = note_unmeant(scene(hand=hand, device=device, wall={"position": -place_m, "stiffness": 10}))
        return any(note.startswith("The wall is never reached") for note in notes)

    assert not is_noted(0.999 * reached)
    assert is_noted(6.0 * reached + 0.02)


@pytest.mark.parametrize("kind", ["step", "ramp"])
@pytest.mark.parametrize("stiffness", [30.0, 3000.0])
def test_a_wall_called_out_of_reach_of_a_chain_is_not_met_by_a_force_that_grows(tmp_path, kind, stiffness):
    force = {"kind": kind, "value": -0.5} | ({"at": 0.1} if kind == "step" else {"rise_time": 0.01})
    hand = {"mass": 0.05, "stiffness": 100.0, "grip": {"stiffness": stiffness, "damping": 0.01}, "force": force}
    tables = {"hand": hand, "device": {"mass": 0.05, "damping": 0.01}}
    reached = farthest_m(tmp_path, **tables)
    assert reached > 0.007
    [swing] = note_unmeant(scene(**tables, wall={"position": -0.999 * reached, "stiffness": 500}))
    assert "holds the device 5 mm from its spring's rest" in swing
    [never] = note_unmeant(scene(**tables, wall={"position": -3.0 * reached - 0.005, "stiffness": 500}))
    assert never.startswith("The wall is never reached")


def test_what_may_yet_push_or_reach_silences_the_rule():
    still = {"wall": WALL}
    assert note_unmeant(scene(**still))
    for more in (
        {"noise": {"deviation": 1e-6, "cutoff": 100}},
        {"event": [{"at": 0.5, "set": {"wall.position": 0.01}}]},
        {"device": {"mass": 0.01, "damping": 0.1, "velocity": -1.0}},
    ):
        assert not note_unmeant(scene(**still | more)), more


def test_check_notes_what_cannot_be_meant_and_does_not_refuse_it():
    fig = str(SCENES / "fig6c.toml")
    far = CliRunner().invoke(app, ["check", fig, "--set", "wall.position=-60", "--json"])
    assert far.exit_code == 0
    assert far.stderr.count("Note: The wall is at -60 m") == 1
    assert [note for note in json.loads(far.stdout)["notes"] if note.startswith("The wall is at -60 m")]
    assert json.loads(CliRunner().invoke(app, ["check", fig, "--json"]).stdout)["notes"] == []


def test_a_note_names_the_line_it_speaks_of_whatever_file_that_is_in_and_none_of_what_set_gave(tmp_path):
    (tmp_path / "beneath.toml").write_text(LEAST_TOML + "[wall]\nposition = -60.0\nstiffness = 150.0\n")
    mine = tmp_path / "mine.toml"
    mine.write_text(
        'extends = "beneath.toml"\n[device]\nvelocity = -1.0\n[wall]\nstiffness = 3\n'
        '[[event]]\nat = 0.5\nset = { "wall.stiffness" = 100 }\n[[event]]\nat = 0.2\npause = true\n'
        '[[event]]\nat = 0.5\nset = { "wall.stiffness" = 200 }\n'
    )
    line = LEAST_TOML.count("\n") + 2
    told = CliRunner().invoke(app, ["check", str(mine), "--set", "noise.deviation=1", "--set", "noise.cutoff=9"]).stderr
    assert told.splitlines()[0] == ""
    assert f"{tmp_path}/beneath.toml:{line}: Note: The wall is at -60 m" in told
    assert f"{mine}:5: Note: wall.stiffness is 3 N/m" in told
    assert f"{mine}:6: Note: Two events change wall.stiffness at 0.5 s" in told
    assert "\nNote: noise.deviation is 1 m" in told


def test_keys_of_a_file_that_has_gone_stand_nowhere(tmp_path):
    assert places(tmp_path / "gone.toml", [], ["wall.position", "event.1"]) == ["", ""]
    (tmp_path / "other.toml").write_text(LEAST_TOML)
    assert places(tmp_path / "other.toml", [], ["wall.position", "event.1"]) == ["", ""]


def test_a_second_swap_of_one_tick_is_noted_unless_the_first_removed_what_stood_there():
    swap = {"kind": "damping", "damping": 1.0}
    own = {"hand": PUSHED, "wall": WALL | {"stiffness": 1000}, "dissipation": [swap, swap]}

    def noted(*changes: dict[str, Any]) -> bool:
        events = [{"at": 0.5, **change} for change in changes]
        return any("Two events change dissipation.0" in note for note in note_unmeant(scene(**own, event=events)))

    assert noted({"swap": swap}, {"swap": swap})
    assert noted({"set": {"dissipation.0.damping": 2}}, {"swap": swap})
    assert not noted({"swap": swap}, {"set": {"dissipation.0.damping": 2}})
    assert not noted({"swap": swap}, {"swap": swap, "element": 1})
    assert not noted({"swap": {"kind": "none"}}, {"swap": swap})


def test_the_report_of_a_run_without_contact_says_why(tmp_path):
    far = tmp_path / "far.toml"
    far.write_text(LEAST_TOML + "[hand]\nstiffness = 10\nmass = 0.1\ndamping = 0.5\nforce.kind = \"ramp\"\n"
                   "force.value = -1\nforce.rise_time = 0.1\n[wall]\nposition = -0.2\nstiffness = 1000\n")  # fmt: skip
    report = CliRunner().invoke(app, ["run", str(far), "--in-process", "--out", str(tmp_path / "out")]).stdout
    assert "no-contact" in report
    assert "the wall is 200 mm from there" in " ".join(report.split())


def test_the_last_line_of_check_is_its_verdict_and_the_notes_stand_before_it():
    fig = str(SCENES / "fig6c.toml")
    told = CliRunner().invoke(app, ["check", fig, "--set", "wall.position=-60"]).output.splitlines()
    assert told[-2].startswith("Note: The wall is at -60 m")
    assert told[-1] == f"{fig} can be run. The notes above say what is probably unintended."
    assert CliRunner().invoke(app, ["check", fig]).output.splitlines()[-1] == f"{fig} can be run."


def test_a_change_of_a_wall_that_is_not_there_and_an_element_of_ones_own_are_told_what_is_missing():
    change = [{"at": 0.5, "set": {"wall.stiffness": 100.0}}]
    with pytest.raises(SceneError, match=r"wall\.stiffness cannot be set\. The scene has no \[wall\]\. Allowed at"):
        scene(event=change)
    with pytest.raises(SceneError, match=r"wall\.stifness cannot be set; did you mean wall.stiffness\? Allowed at"):
        scene(event=[{"at": 0.5, "set": {"wall.stifness": 100.0}}], wall=WALL)
    for tables in ({"dissipation": [{"kind": "brake"}]}, {"event": [{"at": 0.5, "swap": {"kind": "brake"}}]}):
        with pytest.raises(SceneError, match="An element of your own needs --plugin FILE"):
            scene(**tables)


REPAIRS = {
    "duration = 0.0003": "the least legal value is 0.001 s",
    "duration = 1,5": "Write decimals with a point, not a comma: 1.5.",
    "duration = 2 ms": 'A number with its unit must be text in quotes: "2 ms".',
    'duration = "0,3 s"': 'Write decimals with a point, not a comma: "0.3 s".',
    "duration = 1.0\n[dissipation]\nkind='damping'": "It must be a list of tables: [[dissipation]], two",
    "": "my.toml takes it as it is",
}


@pytest.mark.parametrize(("head", "words"), REPAIRS.items())
def test_a_mistake_of_form_is_told_with_its_repair(tmp_path, head, words):
    file = tmp_path / "my.toml"
    file.write_text(f"{head}\n[device]\nmass = 0.05\ndamping = 0.0\n")
    with pytest.raises(SceneError, match=re.escape(words)):
        load(file)


def test_a_device_of_haploops_own_is_called_by_the_name_that_advise_and_extends_know():
    with pytest.raises(SceneError) as refused:
        load(Path("devices/premium15"))
    assert "haploop advise premium15 takes it as it is" in str(refused.value)
    assert 'extends = ["devices/premium15"].' in str(refused.value)


@pytest.mark.parametrize(("friction_N", "moves"), [(9.9, True), (10.0, False)])
def test_a_device_that_friction_is_said_to_hold_stays_where_it_is(tmp_path, friction_N, moves):
    tables: dict[str, Any] = {"hand": PUSHED | {"stiffness": 0.0}, "friction": {"kinetic": friction_N}}
    assert any(note.startswith("Dry friction") for note in note_unmeant(scene(**tables))) == (not moves)
    assert (farthest_m(tmp_path, **tables) > 0.0) == moves
