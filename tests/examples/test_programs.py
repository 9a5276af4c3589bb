"""Programs of other languages, written from protocol/README.md alone, take part in runs as haploop's own nodes do."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import haploop.logger
from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.runs.replay import replay
from haploop.launch.scene.file import load
from haploop.logger.log.recording import Recording
from helpers.live import attacks
from helpers.live.launched import BRIEF, SCENES, Run
from helpers.live.programs import compiled, in_node, program, seat
from helpers.live.system import alive
from helpers.live.waiting import PATIENCE_S, wait_for

pytestmark = pytest.mark.slow

CONTROLLERS = [("controller.js", "fig6b.toml"), ("wall.c", "fig6a.toml")]
SEATS = [("controller", *controller) for controller in CONTROLLERS] + [("plant", "plant.js", "fig6b.toml")]
PAGE = Path(__file__).parents[2] / "protocol/README.md"
FREE = ("--pace", "free")
# It stands still until whoever is to be there is there.
STANDS = "event=[{at=0.5, pause=true}]"
Start = Callable[..., Run]


def own(tmp_path: Path, scene: str, *sets: str) -> Recording:
    """The log of the same run in one process, by haploop's own code alone."""
    kinds = registry()
    (tmp_path / "own").mkdir()
    run_in_process(load(SCENES / scene, ["run.verdict=window", *sets], kinds), kinds, out=tmp_path / "own")
    return haploop.logger.read(tmp_path / "own")


def sockets(run: Run) -> Path:
    assert run.live.sockets
    return run.live.sockets


def awaited(run: Run, role: str) -> Path:
    """The file of a run that waits for a program, once it is whole."""
    file = sockets(run) / f"external-{role}.json"
    wait_for("its file", lambda: file.is_file() and file.read_text(encoding="utf-8").endswith("}"))
    return file


def assert_same(log: Recording, truth: Recording) -> None:
    """Every number of every column of a log is that of another one, to the bit."""
    assert log.keys() == truth.keys()
    for topic in truth.keys() - {"/events"}:
        assert set(log[topic]) == set(truth[topic]), topic
        for name, column in truth[topic].items():
            assert np.asarray(log[topic][name]).tobytes() == np.asarray(column).tobytes(), (topic, name)


@pytest.mark.parametrize("given", ["--node", "--external"])
def test_the_protocols_page_names_what_a_program_is_told_at_its_start_and_nothing_else(
    given: str, running: Start
) -> None:
    _, _, after = PAGE.read_text(encoding="utf-8").partition("The JSON holds")
    rows = [line for line in after.split("\n\n")[1].splitlines() if line.startswith("| `")]
    named = {key for row in rows for key in re.findall(r"`(\w+)`", row.split("|")[1])}
    external = {"role", "run", "directory"}
    if given == "--node":
        script = "import json, sys; print(*json.loads(sys.stdin.readline()), sys.argv[1])"
        run = running(*seat("controller", [sys.executable, "-c", script]), pace=FREE)
        run.end(1)
        *told, directory = (run.out_directory / "prints.txt").read_text(encoding="utf-8").split()
        assert set(told) == named - external
        assert re.fullmatch(r".*/haploop(-\d+)?/[0-9a-f]{6}", directory)
        return
    run = running("--external", "controller", pace=FREE)
    file = awaited(run, "controller")
    assert set(json.loads(file.read_text(encoding="utf-8"))) == named


@pytest.mark.parametrize(("name", "scene"), CONTROLLERS)
def test_a_controller_of_another_language_gives_every_column_of_our_own_to_the_bit(
    name: str, scene: str, tmp_path: Path, running: Start
) -> None:
    run = running(*seat("controller", program(name)), scene=SCENES / scene, sets=(), pace=FREE)
    programs = run.summary()["programs"]
    assert (programs["controller"]["name"], programs["controller"]["own"]) == (name, False)
    assert programs["plant"]["own"]
    assert_same(haploop.logger.read(run.out_directory), own(tmp_path, scene))
    assert replay(run.out_directory).differences == []


@pytest.mark.parametrize(("name", "scene"), CONTROLLERS)
def test_a_controller_of_another_language_carries_out_what_is_set_at_the_tick_that_our_own_does(
    name: str, scene: str, tmp_path: Path, running: Start
) -> None:
    changes = '[{at = 1.0, set = {"wall.stiffness" = 120.0, "clock.round_trip_delay" = 0.0035}},'
    changes += '{at = 1.5, set = {"wall.position" = -0.0601}}]'
    words = seat("controller", program(name))
    run = running(*words, scene=SCENES / scene, sets=(f"event={changes}",), pace=FREE)
    run.end(0)
    assert_same(haploop.logger.read(run.out_directory), own(tmp_path, scene, f"event={changes}"))


@pytest.mark.parametrize(("name", "scene"), CONTROLLERS)
def test_a_swap_that_a_controller_cannot_make_stands_in_the_log_as_refused_and_changes_nothing(
    name: str, scene: str, tmp_path: Path, running: Start
) -> None:
    swap = 'event=[{at = 1.5, swap = {kind = "damping", damping = 5.0}}]'
    run = running(*seat("controller", program(name)), scene=SCENES / scene, sets=(swap,), pace=FREE)
    run.end(0)
    log = haploop.logger.read(run.out_directory)
    (refused,) = [event for event in log["/events"] if "refused" in event]
    assert refused["change"]["tick"] == 1500
    assert refused["change"]["swap"]["kind"] == "damping"
    truth = own(tmp_path, scene)
    assert log["/plant"]["x"].tobytes() == truth["/plant"]["x"].tobytes()


def test_a_plant_of_another_language_moves_as_the_exact_flow_and_the_books_find_no_energy_of_its_own(
    tmp_path: Path, running: Start
) -> None:
    run = running(*seat("plant", in_node("plant.js")), scene=SCENES / "fig6b.toml", sets=(), pace=FREE)
    summary = run.summary()
    log, truth = haploop.logger.read(run.out_directory), own(tmp_path, "fig6b.toml")
    assert np.abs(log["/plant"]["x"] - truth["/plant"]["x"]).max() < 1e-13
    assert log["/plant"]["x"].tobytes() != truth["/plant"]["x"].tobytes()
    assert abs(summary["energy"]["residual_J"]) < 1e-12 * summary["energy"]["moved_J"]


def test_a_plant_that_diverges_ends_the_run_at_the_tick_at_which_our_own_does_though_the_logger_is_held_up_at_its_end(
    tmp_path: Path, running: Start
) -> None:
    wild = ("dissipation.0.damping=60", "diverged_beyond=0.07")
    held = ("run.block_ticks=1000", "run.deadline=30", "event=[{at=0.01, pause=true}]")  # more than a socket buffers
    run = running(*seat("plant", in_node("plant.js")), scene=SCENES / "fig6b.toml", sets=(*wild, *held), pace=FREE)
    run.reaches(10)
    run.send("logger", signal.SIGSTOP)
    run.ask("resume")
    wait_for("the plant's end", lambda: run.stood_for(1.5))
    run.send("logger", signal.SIGCONT)
    summary, truth = run.summary(), own(tmp_path, "fig6b.toml", *wild)
    assert "beyond the limit of 0.07 m" in summary["why"]
    assert (summary["ended"], summary["ticks"]) == ("diverged", len(truth["/controller"]["x"]))


@pytest.mark.parametrize("how", ["to its end", "killed", "without its launcher"])
@pytest.mark.parametrize(("role", "name", "scene"), SEATS)
def test_a_program_joins_a_run_that_waits_for_it_and_neither_outlives_the_other(
    role: str, name: str, scene: str, how: str, running: Start
) -> None:
    words = program(name)
    sets = () if how == "to its end" else ("duration=600",)
    run = running("--external", role, scene=SCENES / scene, sets=sets, pace=FREE)
    file = awaited(run, role)
    assert file.stat().st_mode & 0o777 == 0o600
    with subprocess.Popen([*words, str(file)]) as joined:
        try:
            if how == "to its end":
                assert run.summary()["programs"][role]["name"] == name
                assert joined.wait(PATIENCE_S) == 0
                return
            run.reaches(100)
            if how == "killed":
                joined.kill()
                run.end(1)
                assert "is gone" in run.stderr
            else:
                run.signal(signal.SIGKILL)
                run.end(-signal.SIGKILL)
                assert joined.wait(PATIENCE_S) == 1
        finally:
            joined.kill()


@pytest.mark.parametrize(("role", "name", "scene"), SEATS)
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_program_that_is_killed_or_hangs_ends_the_run_by_name_and_leaves_nothing(
    number: signal.Signals, role: str, name: str, scene: str, running: Start
) -> None:
    deadline = (BRIEF,) if number == signal.SIGSTOP else ()
    run = running(*seat(role, program(name)), scene=SCENES / scene, sets=("duration=600", *deadline))
    run.reaches(100)
    run.send(role, number)
    run.end(1)
    run.leaves_nothing()
    assert Path(name).stem in run.stderr
    assert ("killed by SIGKILL" if number == signal.SIGKILL else "has not answered") in run.stderr
    assert len(haploop.logger.read(run.out_directory)["/controller"]["x"]) >= 100


@pytest.mark.parametrize(("role", "name", "scene"), SEATS)
def test_a_program_ends_with_the_launcher(role: str, name: str, scene: str, running: Start) -> None:
    run = running(*seat(role, program(name)), scene=SCENES / scene, sets=("duration=600",))
    run.reaches(100)
    run.signal(signal.SIGKILL)
    wait_for("the end of the nodes", lambda: not alive(list(run.nodes.values())))


@pytest.mark.parametrize(("role", "name", "scene"), SEATS)
def test_what_strangers_send_changes_no_bit_of_a_run_with_a_program_of_another_language(
    role: str, name: str, scene: str, running: Start
) -> None:
    words = seat(role, program(name))
    undisturbed = running(*words, scene=SCENES / scene, sets=(), pace=FREE).summary()
    run = running(*words, scene=SCENES / scene, sets=(STANDS,), pace=FREE)
    run.stands(500)
    flood = subprocess.Popen([sys.executable, attacks.__file__, str(sockets(run))], stdout=subprocess.PIPE)
    assert flood.stdout
    with flood.stdout:
        flood.stdout.readline()
        context = attacks.zmq.Context()
        senders = [each for file in sockets(run).glob("*.sock") for each in attacks.send_unasked(context, file)]
        run.ask("resume")
        summary = run.summary()
        flood.kill()
        flood.wait()
    assert senders
    context.destroy(linger=0)
    assert summary["trajectory_sha256"] == undisturbed["trajectory_sha256"]


@pytest.mark.parametrize(
    ("role", "name", "scene", "says"),
    [
        ("controller", "controller.js", "fig6c.toml", "a spring wall with one damping"),
        ("controller", "wall.c", "fig6b.toml", "only a spring wall"),
        ("plant", "plant.js", "all_effects.toml", "does not support"),
    ],
)
def test_a_scene_that_asks_for_more_than_a_program_can_ends_the_run_with_its_sentence(
    role: str, name: str, scene: str, says: str, running: Start
) -> None:
    run = running(*seat(role, program(name)), scene=SCENES / scene, sets=(), pace=FREE)
    run.end(1)
    assert says in run.stderr


def test_the_observer_in_c_misses_nothing_changes_nothing_and_ends_with_the_run(tmp_path: Path, running: Start) -> None:
    observer = compiled("observer.c")
    run = running(scene=SCENES / "fig6b.toml", sets=(STANDS,), pace=FREE)
    run.stands(500)
    pipe = subprocess.PIPE
    with subprocess.Popen([*observer, str(sockets(run))], stdout=pipe, stderr=pipe, text=True) as process:
        wait_for("the observer", lambda: len(run.ask("status")["nodes"]) == 4)
        run.ask("resume")
        said, complaint = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, complaint
    run.end(0)
    log, truth = haploop.logger.read(run.out_directory), own(tmp_path, "fig6b.toml")
    assert_same(log, truth)
    x, force = truth["/plant"]["x"], truth["/plant"]["force"]
    attached, ended = said.splitlines()
    seen = slice(int(attached.split()[-1]) * 10, None)
    assert ended.startswith("to tick 3000: ")
    assert ended.endswith(" 0 ticks missed")
    numbers = [float(number) for number in re.findall(r"-?\d\S*(?= to| m| N)", ended.partition(":")[2])]
    assert numbers == [x[seen].min(), x[seen].max(), force[seen].min(), force[seen].max()]


def test_the_observer_in_c_notices_that_the_launcher_was_killed(running: Start) -> None:
    observer = compiled("observer.c")
    run = running()
    run.reaches(10)
    with subprocess.Popen([*observer, str(sockets(run))], stderr=subprocess.PIPE, text=True) as process:
        wait_for("the observer", lambda: len(run.ask("status")["nodes"]) == 4)
        run.signal(signal.SIGKILL)
        run.end(-signal.SIGKILL)
        try:
            assert process.wait(PATIENCE_S) == 1
        finally:
            process.kill()
        assert process.stderr
        assert "launcher is gone" in process.stderr.read()


def test_the_steering_client_says_what_became_of_a_command_and_exits_by_it(running: Start) -> None:
    run = running(scene=SCENES / "fig6b.toml")
    run.reaches(1)
    client = [*in_node("steer.js"), str(sockets(run) / "run.json")]

    def say(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([*client, *words], capture_output=True, text=True, timeout=PATIENCE_S)

    done = say("set", json.dumps({"set": {"wall.stiffness": 200}}))
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("wall.stiffness = 200 N/m from tick ")
    refused = say("set", json.dumps({"set": {"wall.stiffnes": 200}}))
    assert refused.returncode == 1
    assert "did you mean wall.stiffness?" in refused.stdout
    assert say("stop").returncode == 0
    run.end(0)
    late = say("status")
    assert late.returncode == 1
