"""Programs that somebody else starts: a run waits for them, turns a second away, and leaves nothing if none comes."""

from __future__ import annotations

import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from haploop.launch.processes import private_directory
from haploop.logger import read
from helpers.live.foreign import CONTROLLER, Started
from helpers.live.launched import HAPLOOP, Launched
from helpers.live.system import alive
from helpers.live.waiting import PATIENCE_S, wait_for
from helpers.slowly import first_and_slowly


def seat_of(run: Launched, role: str = "controller") -> Path:
    """The file by which a program finds the run."""
    named = f"*/external-{role}.json"
    whole = lambda path: path.read_text().rstrip().endswith("}")  # noqa: E731
    return wait_for("the file", lambda: next(filter(whole, private_directory.base_directory().glob(named)), None))


def joined(seat: Path, *options: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-I", str(CONTROLLER), *options, "--seat", str(seat)])


@pytest.mark.slow
def test_a_run_waits_for_an_external_controller_and_gives_the_same_bits(started: Started) -> None:
    own, run = started(node=None), started("--external", "controller", node=None)
    seat = seat_of(run)
    assert stat.S_IMODE(seat.stat().st_mode) == 0o600
    run.says("Waiting 60 s for a controller to join")
    controller = joined(seat, "--nameless")
    assert run.summary()["trajectory_sha256"] == own.summary()["trajectory_sha256"]
    assert run.summary()["programs"]["controller"] == {"name": "", "version": "", "command": "", "own": False}
    assert controller.wait(PATIENCE_S) == 0
    assert not seat.exists()
    assert read(run.out_directory).attachments.keys() == {"scene.toml", "programs.json"}
    run.leaves_nothing()


@pytest.mark.slow
def test_an_external_controller_that_dies_is_noticed_at_once(started: Started) -> None:
    run = started("--external", "controller", node=None)
    controller = joined(seat_of(run), "--misbehave", "die")
    run.end(1)
    assert "The controller (external) is gone; the last tick all nodes had done is" in run.stderr
    assert controller.wait(PATIENCE_S) == -signal.SIGKILL


@pytest.mark.slow
def test_of_two_programs_for_one_role_the_second_is_turned_away(started: Started, tmp_path: Path) -> None:
    run = started("--external", "controller", "--external", "plant", node=None, sets=())
    seat = seat_of(run)
    first = joined(seat)
    wait_for("the first", lambda: any(node["role"] == "controller" for node in run.ask("status")["nodes"]))
    second = joined(seat)
    assert second.wait(PATIENCE_S) == 1
    assert run.ask("status")["refused"] == {"controller": "The role controller is taken."}
    run.signal(signal.SIGINT)
    run.end(1)
    assert "Interrupted before the run began; nothing is left of it." in run.stderr
    assert not run.out_directory.exists()
    first.kill()
    first.wait()


@pytest.mark.slow
@pytest.mark.parametrize("role", ["plant", "controller"])
def test_a_half_that_has_joined_stays_until_the_logger_has_all_of_it(role: str, started: Started) -> None:
    run = started("--external", role, node=None, sets=("event=[{at=2.99, pause=true}]",))
    node = subprocess.Popen([*HAPLOOP, "join", str(seat_of(run, role))])
    run.stands(run.reaches(2990))
    run.send("logger", signal.SIGSTOP)
    run.ask("resume")
    wait_for("its last tick", lambda: 3000 in [n["tick"] for n in run.ask("status")["nodes"] if n["role"] == role])
    with pytest.raises(subprocess.TimeoutExpired):
        node.wait(1.0)
    run.send("logger", signal.SIGCONT)
    assert run.summary()["ticks"] == 3000
    assert node.wait(PATIENCE_S) == 0


@pytest.mark.slow
@pytest.mark.parametrize("role", ["plant", "controller"])
def test_a_half_that_has_joined_ends_by_itself_when_the_launcher_is_killed(role: str, started: Started) -> None:
    run = started("--external", role, node=None, sets=("event=[{at=1.5, pause=true}]",))
    node = subprocess.Popen([*HAPLOOP, "join", str(seat_of(run, role))], stderr=subprocess.PIPE, text=True)
    run.stands(run.reaches(1500))
    run.signal(signal.SIGKILL)
    _, why = node.communicate(timeout=PATIENCE_S)
    assert node.returncode == 1
    assert "its launcher was ended" in why


@pytest.mark.slow
@pytest.mark.parametrize("end", first_and_slowly("wait", "stop", "interrupt"))
def test_a_run_that_nobody_joins_leaves_nothing(end: str, started: Started) -> None:
    run = started("--external", "controller", *(("--wait", "0.5") if end == "wait" else ()), node=None)
    if end != "wait":
        seat_of(run)
        run.ask("stop") if end == "stop" else run.signal(signal.SIGINT)
    run.end(1)
    words = {"wait": "No program joined as the controller within 0.5 s", "stop": "The run was stopped before"}
    assert words.get(end, "Interrupted before the run began") in run.stderr
    assert not run.out_directory.exists()
    assert not alive([run.pid])
    run.leaves_nothing()
