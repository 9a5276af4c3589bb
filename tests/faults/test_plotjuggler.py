"""PlotJuggler gets every sample of a run, whenever it comes; and whatever becomes of it, the run does not mind."""

from __future__ import annotations

import re
import signal
import threading
from typing import Any, Self

import numpy as np
import pytest

import haploop.logger
from haploop.launch.processes.run_directory import LiveRun
from haploop.logger.log.recording import Recording
from haploop.tools.attach import plotjuggler
from haploop.tools.attach.plotjuggler import Outlet, publish
from helpers.live.in_process import ask
from helpers.live.live_run import Going, going, undisturbed
from helpers.live.waiting import PATIENCE_S, wait_for, wait_till_stays
from helpers.slowly import first_and_slowly
from oracles.plotjuggler_rules import Viewer

END = "/end"
ROWS_A_TICK = {"/plant": 10, "/controller": 1, "/energy": 1}


def ticks_of_nodes(status: dict[str, Any]) -> list[int]:
    return [node["tick"] for node in status["nodes"] if node["role"] == "plotjuggler"]


class Node:
    """The node in a thread of this process."""

    def __init__(self, live: LiveRun) -> None:
        self.outlet = Outlet(0)
        self._thread = threading.Thread(target=publish, args=(live, self.outlet))
        self._thread.start()

    def joined(self, subject: Going, tick: int) -> None:
        """Wait until it stands at this tick, like everyone, and not only as it is greeted."""
        wait_till_stays("the node", lambda: ticks_of_nodes(subject.ask("status")[1]), [tick])

    def heard(self) -> None:
        """Wait until it knows that a viewer listens."""
        wait_for("the viewer", lambda: self.outlet.has_subscribers)

    def finish(self) -> None:
        """Wait until it has seen the run end, and mark the end of what it said."""
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive(), "the node does not notice the end of the run"
        self.outlet.send(END, b"\x90")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._thread.join(PATIENCE_S)
        self.outlet.close()


def assert_rows(viewer: Viewer, log: Recording, first_tick: int) -> None:
    """All that came are the rows of the log from a tick on to the end: each number bit for bit, at its own time."""
    for topic, rows in ROWS_A_TICK.items():
        parser, table = viewer.parsers[topic], log[topic]
        first = first_tick * rows
        for name, column in table.items():
            assert parser.column(name).tobytes() == column[first:].tobytes(), (topic, name)
            finite = np.isfinite(column[first:])
            times = [t for t, _ in parser.series[f"{topic}/{name}"]]
            assert times == table["timestamp"][first:][finite].tolist(), (topic, name)
        assert {type(value) for sample in parser.samples for value in sample.values()} == {float}


@pytest.mark.slow
@pytest.mark.parametrize("pace", first_and_slowly({}, {"pace": 2.0}), ids=["free", "at a pace"])
def test_every_sample_of_a_run_reaches_plotjuggler_bit_for_bit(pace, tmp_path, capsys):
    """From the tick on at which the node joined; an element that is added on the way makes no gap."""
    with going(tmp_path, "duration=0.8", "wall.position=-0.001", pauses=(5,), **pace) as subject:
        subject.stands_at(5)
        with Node(subject.live) as node, Viewer(node.outlet.address) as viewer:
            node.joined(subject, 5)
            node.heard()
            subject.ask("swap", swap={"kind": "damping", "damping": 0.2}, element=1, at=0.4)
            subject.ask("resume")
            subject.result()
            node.finish()
            viewer.read_to(END)
    log = haploop.logger.read(subject.prepared.out)
    assert "dissipation.1" in log["/controller"]
    assert len(log["/plant"]["x"]) == 8001
    assert_rows(viewer, log, 5)
    assert "0 ticks skipped" in capsys.readouterr().err


@pytest.mark.slow
def test_a_viewer_that_comes_late_gets_everything_from_there_on(tmp_path):
    with going(tmp_path, "duration=1.2", pauses=(5, 300), pace=1.0) as subject:
        subject.stands_at(5)
        with Node(subject.live) as node:
            node.joined(subject, 5)
            subject.ask("resume")
            subject.stands_at(300)
            with Viewer(node.outlet.address) as viewer:
                node.heard()
                subject.ask("resume")
                subject.result()
                node.finish()
                viewer.read_to(END)
    log = haploop.logger.read(subject.prepared.out)
    for topic in ROWS_A_TICK:
        stamps, parser = log[topic]["timestamp"], viewer.parsers[topic]
        first = len(stamps) - len(parser.samples)
        assert 0.2 < stamps[first] < 1.2, "it came in mid-run"
        assert parser.column("timestamp").tobytes() == stamps[first:].tobytes(), topic


@pytest.mark.slow
def test_a_viewer_that_does_not_read_costs_the_run_nothing_and_the_node_skips_nothing(tmp_path, capsys, monkeypatch):
    """Nor does the memory of the node grow with it: so many messages are kept, three here, and no more."""
    monkeypatch.setattr(plotjuggler, "_KEPT_MESSAGES", 3)
    with going(tmp_path, "duration=20", pauses=(5,)) as subject:
        subject.stands_at(5)
        with Node(subject.live) as node, Viewer(node.outlet.address, kept_messages=1) as viewer:
            node.joined(subject, 5)
            node.heard()
            subject.ask("resume")
            summary = subject.result()
            node.finish()
            while viewer.read(2000):
                pass
    assert summary["trajectory_sha256"] == undisturbed(subject.prepared)["trajectory_sha256"]
    assert summary["lost"]["telemetry_gaps"] == 0
    assert "0 ticks skipped" in capsys.readouterr().err
    assert len(viewer.parsers["/plant"].samples) < 200_001, "it was to lose some: else this shows nothing"


def attached(launched, *arguments):
    """The node as a user starts it, and where it publishes."""
    node = launched("attach", "plotjuggler", "--port", "0", *arguments)
    node.says("publishing on ")
    return node, re.findall(r"tcp://127\.0\.0\.1:\d+", node.stderr)[0]


def has_joined(run, tick):
    """Waits until the node stands with the run."""
    wait_till_stays("the node", lambda: ticks_of_nodes(run.ask("status")), [tick])


@pytest.mark.slow
def test_it_waits_for_a_run_survives_its_end_and_goes_on_with_the_next(running, launched):
    """The times of the second run begin at 0 again, as its own do."""
    node, address = attached(launched)
    with Viewer(address) as viewer:
        for _ in range(2):
            viewer.parsers.clear()
            run = running(sets=("duration=0.4", "event=[{at=0.1, pause=true}]"), pace=("--pace", "1"))
            run_id = run.live.id
            node.says(f"run {run_id}: ")
            run.stands(100)
            has_joined(run, 100)
            run.ask("resume")
            run.summary()
            node.says(f"run {run_id} is over")
            while "/plant" not in viewer.parsers or viewer.parsers["/plant"].column("timestamp")[-1] < 0.4:
                assert viewer.read(20_000), "the last sample does not come"
            stamps = viewer.parsers["/plant"].column("timestamp")
            assert np.array_equal(stamps, np.arange(round(stamps[0] * 10_000), 4001) / 10_000)
    node.signal(signal.SIGINT)
    node.end(0)
    assert "Traceback" not in node.stderr


@pytest.mark.slow
def test_a_run_that_was_named_is_the_only_one_and_its_failure_is_told(running, launched):
    run = running()
    run.reaches(200)
    node, _ = attached(launched, "--run", run.live.id)
    node.says(f"run {run.live.id}: ")
    run.send("plant", signal.SIGKILL)
    run.end(1)
    node.end(0)
    assert "The plant was killed by SIGKILL" in node.stderr


@pytest.mark.slow
def test_stopped_for_long_it_costs_the_run_nothing_and_is_told_what_it_missed(running, launched):
    """Blocks so short that there are far more of them than any queue holds."""
    run = running(sets=("duration=12", "run.block_ticks=10", "event=[{at=0.5, pause=true}]"), pace=())
    run.reaches(500)
    node, _ = attached(launched, "--run", run.live.id)
    has_joined(run, 500)
    node.signal(signal.SIGSTOP)
    run.ask("resume")
    summary = run.summary()
    node.signal(signal.SIGCONT)
    node.end(0)
    assert summary["ended"] == "done"
    [skipped] = re.findall(r"(\d+) ticks skipped", node.stderr)
    assert int(skipped) > 1000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("plotjuggler", "--run", "zzz", "--port", "0"), "No run is live"),
        (("plotjuggler", "--out", "somewhere"), "--out belongs to attach logger"),
        (("print", "--port", "9872"), "--port belongs to attach plotjuggler"),
        (("plotjuggler", "--port", "70000"), "65535"),
    ],
)
def test_wrong_use_is_a_sentence_and_exit_status_2(arguments, words):
    done = ask("attach", *arguments)
    assert (done.status, done.broken()) == (2, "")
    assert words in done.stderr
