"""Choices of a running loop: each takes effect, is on record and can be replayed."""

import json
import math

import pytest

from haploop.launch.clock.capabilities import capabilities
from haploop.launch.processes.run_directory import CommandRefused
from haploop.launch.runs.replay import replay
from haploop.logger import read
from haploop.protocol.scene.scene import Wall
from helpers.live.live_run import going, undisturbed
from helpers.runs.clocks import clock, granted
from helpers.scenes.least import KINDS, WALL, scene

DAMPING = {"kind": "damping", "damping": 0.5}


def test_options_name_every_key_that_can_be_set_with_unit_bounds_and_present_value():
    data = capabilities(scene(wall=WALL, dissipation=[DAMPING], clock={"round_trip_delay": "2 ms"}), KINDS)
    settable = data["settable"]
    assert set(settable) == {"wall.stiffness", "wall.position", "clock.round_trip_delay", "dissipation.0.damping"}
    assert settable["wall.stiffness"]["unit"] == "N/m"
    assert settable["wall.stiffness"]["value"] == 150.0
    assert settable["clock.round_trip_delay"] == {
        "unit": "s", "at_least": 0, "above": None, "at_most": 10.0, "below": None, "value": 0.002,
    }  # fmt: skip
    assert settable["dissipation.0.damping"]["value"] == 0.5
    assert set(data["kinds"]) == set(KINDS)
    assert data["kinds"]["damping"]["parameters"]["damping"]["unit"] == "N s/m"
    assert data["elements"] == [{**DAMPING, "acts": "in-contact"}]


def test_options_of_a_scene_without_a_wall_offer_none():
    assert set(capabilities(scene(), KINDS)["settable"]) == {"clock.round_trip_delay"}


def test_the_present_scene_has_every_change_that_has_taken_effect_and_none_that_has_not():
    subject = clock(
        event=[
            {"at": 0.1, "swap": {"kind": "unidirectional-inertia", "mass": 0.02}},
            {"at": 0.2, "set": {"dissipation.0.mass": 0.03, "wall.stiffness": 200.0, "clock.round_trip_delay": 0.001}},
            {"at": 0.3, "swap": DAMPING, "element": 1},
            {"at": 0.9, "swap": {"kind": "none"}, "element": 0},
        ]
    )
    granted(subject, 0)
    now = subject.present()
    assert [element.name for element in now.dissipation] == ["unidirectional-inertia", "damping"]
    assert now.dissipation[0].parameters == {"mass": 0.03}
    assert now.wall == Wall(position=-0.06, stiffness=200.0)
    assert now.clock.round_trip_delay == 0.001
    granted(subject, 600)
    assert [element.name for element in subject.present().dissipation] == ["damping"]
    assert subject._scene.wall == Wall(position=-0.06, stiffness=150.0)


def test_after_a_change_of_pace_time_goes_on_from_where_it_was_at_the_new_pace():
    subject = clock(pace=1.0)
    assert granted(subject, 0, now=0.0) == 1
    subject.run_at(0.1)
    assert [granted(subject, 1, now=now) for now in (5.0, 5.009, 5.011)] == [2, 2, 3]
    subject.run_at(math.inf)
    assert granted(subject, 300, now=5.011) == 700  # the window


@pytest.mark.slow
def test_a_run_takes_pace_and_delay_while_it_goes_records_them_and_replays_to_the_same_bits(tmp_path):
    with going(tmp_path, "duration=600", pauses=(500,)) as subject:
        subject.stands_at(500)
        assert subject.ask("options")[1]["settable"]["clock.round_trip_delay"]["value"] == 0.002
        assert subject.ask("pace", pace=20)[0].startswith("pace 20 from tick 500")
        assert subject.ask("status")[1]["pace"] == 20
        subject.ask("set", set={"clock.round_trip_delay": "0.3 ms", "wall.stiffness": "0.2 N/mm"})
        subject.ask("step", ticks=50)
        subject.stands_at(550)
        assert subject.ask("options")[1]["settable"]["clock.round_trip_delay"]["value"] == 0.0003
        subject.ask("set", set={"clock.round_trip_delay": "4 ms"})
        subject.ask("pace", pace="free")
        subject.ask("step", ticks=3000)
        subject.stands_at(3550)
        subject.ask("stop")
        summary = subject.result()
    log = read(subject.prepared.out)
    commands = log["/events"]
    assert [event["pace"] for event in commands if "pace" in event] == [20, "free"]
    assert [event["set"]["clock.round_trip_delay"] for event in commands if "set" in event] == [0.0003, 0.004]
    assert summary["lost"]["commands_dropped"] > 0
    assert summary["energy"]["residual_J"] <= 1e-12 * summary["energy"]["moved_J"]
    assert replay(subject.prepared.out).differences == []


@pytest.mark.slow
def test_a_paced_run_tells_how_late_its_ticks_were_and_has_the_bits_of_a_free_one(tmp_path):
    with going(tmp_path, "duration=0.5", pauses=(250,), pace=1.0) as subject:
        subject.stands_at(250)
        late = subject.ask("status")[1]["lateness"]
        assert late["ticks"] == 250
        subject.ask("resume")
        summary = subject.result()
        assert summary["lateness"]["ticks"] == 500
        assert 0.0 <= late["median_s"] <= late["percent_99_s"] <= late["most_s"]
        written = json.loads((subject.prepared.out / "summary.json").read_text())
        assert written["lateness"] == summary["lateness"]
        free = undisturbed(subject.prepared)
        assert "lateness" not in free
        assert summary["trajectory_sha256"] == free["trajectory_sha256"]


def test_what_cannot_be_is_refused_with_the_reason_and_the_run_goes_on_as_it_was(tmp_path):
    refused = [
        ("pace", {"pace": "quick"}, "or free"),
        ("pace", {"pace": -1}, "or free"),
        ("pace", {"pace": True}, "or free"),
        ("set", {"set": {"clock.round_trip_delay": "0.25 ms"}}, "0.0002 s and 0.0003 s"),
        ("set", {"set": {"clock.round_trip_delay": -0.001}}, "at least 0"),
        ("set", {"set": {"clock.plant_rate": 20000}}, "clock.round_trip_delay"),
    ]
    with going(tmp_path, pauses=(10,)) as subject:
        subject.stands_at(10)
        for verb, arguments, says in refused:
            with pytest.raises(CommandRefused, match=says):
                subject.ask(verb, **arguments)
            assert subject.ask("options")[1]["settable"]["clock.round_trip_delay"]["value"] == 0.002
        subject.ask("resume")
        assert subject.result()["ended"] == "done"
