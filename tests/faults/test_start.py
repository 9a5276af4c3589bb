"""Faults between the start of the processes and the first tick: each is waited for, or named."""

import os
import re
import resource
import select
import signal
import threading
from pathlib import Path
from typing import Any

import pytest

from haploop.launch.foreign import read_programs
from haploop.launch.processes import children, deadlines, open_files
from haploop.launch.processes.early import Started, start_early, start_node
from haploop.launch.spec import OutputError, RunFailed
from haploop.protocol.transport.messages import PROCESSES
from helpers.live.launched import BRIEF, BRIEF_S
from helpers.live.live_run import Going, going
from helpers.live.waiting import PATIENCE_S, wait_for


def stop_when_joined(run: Going, role: str) -> int:
    """Stops a process as soon as it has joined; returns its pid."""
    while True:
        for node in run.ask("status")[1]["nodes"]:
            if node["role"] == role:
                os.kill(node["pid"], signal.SIGSTOP)
                return node["pid"]
        threading.Event().wait(0.005)


def never(_ready: set[int]) -> bool:
    return False


@pytest.mark.slow
@pytest.mark.parametrize("role", ["controller", "plant"])
def test_a_node_that_hangs_before_the_first_tick_is_named_after_the_deadline_of_the_start(
    role: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    all_were_ready: list[set[int]] = []  # then the controller is at its first tick, where the run's own deadline holds

    def never_again(ready: set[int]) -> bool:
        all_were_ready.append(ready)
        return False

    with going(tmp_path, "duration=600", BRIEF, start_gate=never_again) as run:
        stop_when_joined(run, role)
        wait_for("the others", lambda: len(run.ask("status")[1]["nodes"]) == len(PROCESSES))
        monkeypatch.setattr(deadlines, "START_DEADLINE_S", 2 * BRIEF_S)
        with pytest.raises(RunFailed) as failed:
            run.result()
    limit_s = BRIEF_S if role == "controller" and all_were_ready else 2 * BRIEF_S
    assert re.search(rf"The {role} has not answered for {limit_s} s .* done is 0 ", str(failed.value))


@pytest.mark.slow
def test_a_process_that_never_joins_is_waited_for_as_long_as_the_run_says_where_that_is_longer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(deadlines, "START_DEADLINE_S", 0.5)
    asleep = read_programs(["controller=sh -c 'exec sleep 1000'"], [])
    with (
        going(tmp_path, "run.deadline=2", programs=asleep) as run,
        pytest.raises(RunFailed, match=r"did not join within 2 s"),
    ):
        run.result()


@pytest.mark.slow
def test_the_deadline_of_a_running_loop_does_not_rule_its_start(tmp_path: Path) -> None:
    """A logger that is busy for longer than the deadline before the first tick, as on a loaded machine."""
    with going(tmp_path, "duration=0.2", BRIEF, start_gate=never) as run:
        pid = stop_when_joined(run, "logger")
        threading.Event().wait(BRIEF_S + 1)
        assert run.ask("status")[1]["granted"] == 0
        os.kill(pid, signal.SIGCONT)
        run.ask("stop")
        assert run.result()["ended"] == "stopped"


@pytest.mark.slow
def test_a_node_that_comes_with_a_wrong_secret_is_named_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def start(role: str, sockets: Path, told: dict[str, Any], *_: Any) -> children.Child:
        return real(role, sockets, {**told, "secret": "0" * 32} if role == "controller" else told)

    real = children.Child
    monkeypatch.setattr(children, "Child", start)
    with going(tmp_path) as run, pytest.raises(RunFailed, match=r"JOIN as controller, .* came with a wrong secret"):
        run.result()


@pytest.mark.parametrize(("soft", "hard", "set_to"), [(1024, 4096, [(4096, 4096)]), (1024, -1, [(65_536, -1)])])
def test_a_run_may_open_as_many_files_as_the_system_lets_it_since_all_who_connect_take_one(
    soft: int, hard: int, set_to: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert resource.RLIM_INFINITY == -1
    asked: list[tuple[int, int]] = []
    monkeypatch.setattr(resource, "getrlimit", lambda _: (soft, hard))
    monkeypatch.setattr(resource, "setrlimit", lambda _, limits: asked.append(limits))
    open_files.allow_many()
    assert asked == set_to


def test_where_a_run_may_open_too_few_files_that_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resource, "getrlimit", lambda _: (40, 40))
    with pytest.raises(OutputError, match=r"opens up to 64 files, but here .* 40; allow more with ulimit -n 64"):
        open_files.allow_many()


def test_the_processes_of_a_run_load_beside_their_launcher_but_for_those_it_may_not_need() -> None:
    early: dict[str, Started] = {}
    for words in (["run", "fig6c", "--in-process"], ["run", "--node=plant=own", "fig6c"]):
        start_early(words, early)
        assert early == {}
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (256, hard))
    start_early(["run", "fig6c"], early)
    assert early.keys() == PROCESSES.keys()
    for process in early.values():
        assert resource.prlimit(process.process.pid, resource.RLIMIT_NOFILE)[0] > min(256, hard - 1)
        process.end()
        assert process.process.returncode == -signal.SIGKILL
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_a_process_that_is_told_of_no_run_ends_with_its_launcher() -> None:
    waiting = start_node("controller")
    assert waiting.process.stdin
    waiting.process.stdin.close()
    assert select.select([waiting.died], [], [], PATIENCE_S)[0] == [waiting.died]
    assert waiting.process.wait() == 1
    os.close(waiting.died)
