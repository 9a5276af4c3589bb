"""Commands from another terminal: each takes effect at a named tick, is on record, and the run can be replayed."""

import json
import math
import signal

import pytest

from haploop.controller.dissipation import registry
from haploop.launch.processes import run_directory
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from helpers.live.in_process import ask
from helpers.live.launched import SCENE, command, same_bits

KINDS = registry()


def answer(*arguments):
    """The data a command answers with ``--json``."""
    done = ask(*arguments, "--json")
    assert done.status == 0, done.stderr
    return json.loads(done.stdout)


def test_every_command_takes_effect_at_its_tick_stands_in_the_log_and_the_run_replays_bit_for_bit(running):
    """From the command line: a swap and a set at once, another set at a time, pause, step, resume, stop."""
    run = running()
    run.reaches(300)
    paused = answer("pause")["tick"]
    assert run.stands() == paused
    swapped = answer("swap", "damping", "damping=0.8")["tick"]
    assert swapped == paused
    stepped = answer("step", "7")["tick"]
    assert run.stands(at=stepped) == paused + 7
    softer = answer("set", "wall.stiffness=0.12 N/mm")["tick"]
    assert softer == stepped
    at = (stepped + 40) / 1000
    assert answer("set", "wall.position=-0.05", "dissipation.0.damping=0.7", "--at", f"{at} s")["tick"] == stepped + 40
    resumed = answer("resume")["tick"]
    assert resumed == stepped
    run.reaches(stepped + 100)
    stopped = answer("stop")["tick"]
    summary = run.summary()
    assert summary["ticks"] == stopped

    events = [{key: value for key, value in e.items() if key not in ("at", "timestamp")} for e in run.log()["/events"]]
    assert events == [
        {"tick": paused, "pause": True},
        {"tick": paused, "swap": {"kind": "damping", "acts": "in-contact", "damping": 0.8}, "element": 0},
        {"tick": paused, "step": 7},
        {"tick": stepped, "set": {"wall.stiffness": 120.0}},
        {"tick": stepped, "resume": True},
        {"tick": stepped + 40, "set": {"wall.position": -0.05, "dissipation.0.damping": 0.7}},
        {"tick": stopped, "stop": True},
    ]
    books = [(e["kind"], e["from_tick"], e["to_tick"]) for e in summary["energy"]["elements"]]
    assert books == [
        ("unidirectional-inertia", 0, paused),
        ("damping", paused, stepped + 40),
        ("damping", stepped + 40, stopped),
    ]
    assert ask("replay", str(run.out)).status == 0


@pytest.mark.slow
def test_a_replay_says_so_when_the_log_is_not_what_ran(running):
    """Without the swap in its scene of events, the same run gives other bits."""
    run = running(sets=("duration=0.6", "wall.position=-0.001"), pace=())
    run.end(0)
    text = (run.out / "scene.toml").read_text()
    assert "mass = 0.01\n" in text
    head, _, tail = text.rpartition("mass = 0.01\n")
    (run.out / "scene.toml").write_text(head + "mass = 0.011\n" + tail)
    replayed = ask("replay", str(run.out))
    assert replayed.status == 1
    assert "differs from the scene in the log" in replayed.stdout


SWAP = {"kind": "damping", "damping": 0.8}
REFUSED = [
    ("swap", {"swap": {"kind": "dampng", "damping": 0.8}}, "damping"),
    ("swap", {"swap": {"kind": "damping"}}, "is missing"),
    ("swap", {"swap": SWAP | {"damping": -0.8}}, "at least 0"),
    ("swap", {"swap": SWAP | {"damping": math.nan}}, "nan"),
    ("swap", {"swap": SWAP | {"damping": "0.8 N/m"}}, "N/m"),
    ("swap", {"swap": SWAP, "element": 2}, "element"),
    ("swap", {"swap": SWAP, "element": -1}, "element"),
    ("swap", {"swap": SWAP, "at": 0.001}, "is past"),
    ("swap", {"swap": SWAP, "at": 600.0}, "The run ends at tick 600000"),
    ("swap", {"swap": SWAP, "at": math.inf}, "a time from 0 to"),
    ("swap", {"swap": SWAP, "reload": True}, "Only kinds from files given by --plugin when the run was started"),
    ("swap", {"swap": "damping"}, "must be a table"),
    ("swap", {}, "cannot be used"),
    ("set", {"set": {"wall.stifness": 1.0}}, "wall.stiffness"),
    ("set", {"set": {"wall.stiffness": -1.0}}, "wall.stiffness"),
    ("set", {"set": {"wall.stiffness": 80.0, "device.mass": 1.0}}, "device.mass"),
    ("set", {"set": {"dissipation.1.mass": 0.01}}, "dissipation.1.mass"),
    ("step", {"ticks": 0}, "from 1 to 600000"),
    ("step", {"ticks": "many"}, "from 1 to 600000"),
    ("step", {"ticks": 10**26}, "an integer does not fit into 64 bits"),
    ("set", {"set": {"wall.stiffness": 10**26}}, "an integer does not fit into 64 bits"),
    ("explode", {}, "is not a command"),
]


@pytest.mark.slow
def test_what_cannot_be_done_is_refused_with_the_reason_and_leaves_the_run_as_it_was(running, undisturbed):
    run = running()
    run.reaches(200)
    for verb, arguments, reason in REFUSED:
        with pytest.raises(run_directory.CommandRefused, match=reason):
            run.ask(verb, **arguments)
    done = run.reaches(run.ask("status")["granted"])
    run.ask("stop")
    summary = run.summary()
    assert same_bits(run.log(), undisturbed) >= done
    assert [event.keys() & {"stop", "swap", "set", "step"} for event in run.log()["/events"]] == [{"stop"}]
    assert [element["kind"] for element in summary["energy"]["elements"]] == ["unidirectional-inertia"]


@pytest.mark.slow
def test_a_refused_command_line_says_why_and_exits_with_2(running):
    run = running()
    run.reaches(1)
    refused = ask("swap", "dampng", "damping=0.8")
    assert refused.status == 2
    assert "dampng" in refused.stderr
    assert ask("set", "wall.stiffness").status == 2
    assert ask("step", "0").status == 2


def test_a_command_without_a_live_run_says_so():
    answer = command("stop")
    assert answer.returncode == 2
    assert "No run is live" in answer.stderr


@pytest.mark.slow
def test_two_runs_side_by_side_each_give_the_bits_they_give_alone(running):
    """Different scenes at once; a command names the one it means, and the other does not notice."""
    sets = [("duration=3", "event=[{at=1.0, pause=true}]", f"wall.stiffness={k}") for k in (100.0, 200.0)]
    alone = [run_in_process(load(SCENE, overrides, KINDS), KINDS)["trajectory_sha256"] for overrides in sets]
    assert alone[0] != alone[1]
    runs = [running(sets=overrides, pace=()) for overrides in sets]
    for run in runs:
        assert run.reaches(1000) == 1000
    ambiguous = command("pause")
    assert ambiguous.returncode == 2
    assert all(run.live.id in ambiguous.stderr for run in runs)
    assert command("step", "5", "--run", runs[0].live.id).returncode == 0
    assert runs[0].stands(at=1005)
    assert runs[1].stands() == 1000
    for run in runs:
        run.ask("resume")
    assert [run.summary()["trajectory_sha256"] for run in runs] == alone
    for run in runs:
        run.leaves_nothing()


@pytest.mark.slow
def test_killing_a_node_of_one_run_does_not_disturb_the_one_beside_it(running, undisturbed):
    doomed, other = running(), running(sets=("duration=3", "event=[{at=0.5, pause=true}]"), pace=("--pace", "2"))
    doomed.reaches(1)
    other.stands(500)
    other.ask("resume")
    doomed.send("controller", signal.SIGKILL)
    doomed.end(1)
    assert other.summary()["ended"] == "done"
    assert same_bits(other.log(), undisturbed) == 3000
