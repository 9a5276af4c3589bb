"""Any process that speaks the protocol can watch a run: here a node written from the README alone."""

import base64
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import haploop.logger
from helpers.live.live_run import Going, going, undisturbed
from helpers.live.waiting import PATIENCE_S

OBSERVER = Path(__file__).parents[1] / "oracles/plain_observer.py"
README = Path(__file__).parents[2] / "protocol" / "README.md"
STEPS_PER_TICK = 10


class Observer:
    """The plain observer as a process that does not see haploop."""

    def __init__(self, run: Going, *options: str) -> None:
        command = [sys.executable, "-I", str(OBSERVER), str(run.run_json), *options]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)

    def line(self) -> dict[str, Any]:
        """The next line it prints."""
        assert self.process.stdout
        return json.loads(self.process.stdout.readline())

    def leave(self) -> dict[str, Any]:
        """What it saw, once it has left."""
        while "plant" not in (seen := self.line()):
            pass
        assert self.process.stdout
        with self.process.stdout:
            assert self.process.wait(PATIENCE_S) == 0
        return seen

    def kill(self) -> None:
        assert self.process.stdout
        with self.process.stdout:
            self.process.kill()
            self.process.wait()


def column(seen: dict[str, Any], role: str, name: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(seen[role]["columns"][name]), "<f8")


def documented(message: str) -> set[str]:
    """The columns of a message's blocks in the README: the names in the table after its paragraph."""
    _, _, after = README.read_text(encoding="utf-8").partition(f"**{message}**: `ticks")
    rows = [line for line in after.split("\n\n")[1].splitlines() if line.startswith("| `")]
    return {name for row in rows for name in re.findall(r"`([\w.]+)`", row.split("|")[1])}


def assert_saw_the_log(run: Going, seen: dict[str, Any]) -> None:
    """Every sample seen is the log's, bit for bit, without a gap from the first to the last."""
    log = haploop.logger.read(run.prepared.out)
    plant, controller = seen["plant"], seen["controller"]
    assert plant["gap_ticks"] == controller["gap_ticks"] == 0
    steps = slice(plant["first"] * STEPS_PER_TICK, plant["tick"] * STEPS_PER_TICK + 1)
    assert set(plant["columns"]) == documented("PLANT_BLOCK")
    assert set(controller["columns"]) == documented("CONTROLLER_BLOCK") - {"dissipation.1"}
    for name in ("x", "v"):
        assert column(seen, "plant", name).tobytes() == log["/plant"][name][steps].tobytes()
    # A step's force is the one held from it on; what follows the last step seen was not yet known then.
    assert column(seen, "plant", "force")[:-1].tobytes() == log["/plant"]["force"][steps][:-1].tobytes()
    ticks = slice(controller["first"], controller["tick"])
    for name in ("x", "v", "a", "wall", "total"):
        assert column(seen, "controller", name).tobytes() == log["/controller"][name][ticks].tobytes()


@pytest.mark.slow
def test_an_observer_that_joins_a_run_in_motion_sees_what_is_logged_and_changes_nothing(tmp_path: Path) -> None:
    with going(tmp_path, "duration=1.0", pauses=(999,), pace=2.0) as run:
        observer = Observer(run)
        first = observer.line()["first"]
        run.stands_at(999)
        run.ask("resume")
        seen = observer.leave()
        summary = run.result()
    assert summary["ended"] == "done"
    assert summary["trajectory_sha256"] == undisturbed(run.prepared)["trajectory_sha256"]
    assert {role: seen[role]["first"] for role in first} == first
    assert seen["plant"]["tick"] == seen["controller"]["tick"] == 1000
    assert_saw_the_log(run, seen)


@pytest.mark.slow
def test_observers_may_join_a_paused_run_leave_it_hold_it_up_and_be_killed_while_it_goes_on(tmp_path: Path) -> None:
    window_of_400 = ("run.block_ticks=100", "run.window_blocks=4")
    with going(tmp_path, "duration=1.5", *window_of_400, pauses=(200, 1400)) as run:
        run.stands_at(200)
        leaving, staying, doomed = Observer(run, "--ticks", "300"), Observer(run), Observer(run, "--dwell")
        attached = [observer.line() for observer in (leaving, staying, doomed)]
        assert [state["first"] for state in attached] == [{"plant": 200, "controller": 200}] * 3
        assert len(run.ask("status")[1]["nodes"]) == 6
        run.ask("resume")
        run.stands_at(600, paused=False)  # the run goes no further beyond an observer than the window
        assert doomed.process.poll() is None
        doomed.kill()
        left = leaving.leave()
        run.stands_at(1400)
        assert {node["role"] for node in run.ask("status")[1]["nodes"]} == {
            "plant", "controller", "logger", "plain observer",
        }  # fmt: skip
        run.ask("resume")
        stayed = staying.leave()
        summary = run.result()
    assert summary["ended"] == "done"
    assert summary["trajectory_sha256"] == undisturbed(run.prepared)["trajectory_sha256"]
    assert 500 <= left["plant"]["tick"] <= 1500
    assert stayed["plant"]["tick"] == 1500
    for seen in (left, stayed):
        assert_saw_the_log(run, seen)
    log = haploop.logger.read(run.prepared.out)
    state = attached[0]["state"]
    assert (state["x"], state["v"]) == (log["/plant"]["x"][2000], log["/plant"]["v"][2000])


@pytest.mark.slow
def test_a_viewer_that_stands_still_costs_nothing_and_afterwards_counts_what_it_missed(tmp_path: Path) -> None:
    short_blocks = ("duration=2.3", "run.block_ticks=1", "run.window_blocks=100")
    with going(tmp_path, *short_blocks, pauses=(100, 2200)) as run:
        run.stands_at(100)
        viewer = Observer(run, "--viewer")
        assert viewer.line()["first"] == {"plant": 100, "controller": 100}
        os.kill(viewer.process.pid, signal.SIGSTOP)
        run.ask("resume")
        run.stands_at(2200)
        os.kill(viewer.process.pid, signal.SIGCONT)
        while viewer.line()["quiet"] <= 100:
            pass
        run.ask("resume")
        seen = viewer.leave()
        summary = run.result()
    assert summary["ended"] == "done"
    assert summary["lost"]["telemetry_gaps"] == 0
    assert summary["trajectory_sha256"] == undisturbed(run.prepared)["trajectory_sha256"]
    for role in ("plant", "controller"):
        rows = len(column(seen, role, "x"))
        assert seen[role]["gap_ticks"] > 0
    # Each tick of the controller is one row: those seen and those missed make up the whole.
    assert rows + seen["controller"]["gap_ticks"] == 2200
