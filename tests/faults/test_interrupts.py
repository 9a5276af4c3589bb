"""Ctrl-C and SIGTERM: the first ends a run in order, with a summary of what ran; the second at once."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time

import pytest

import haploop.logger
from haploop.launch.runs.replay import replay
from helpers.live.launched import AT_REST, HAPLOOP, SCENE, log_so_far, same_bits
from helpers.live.system import processes
from helpers.live.waiting import PATIENCE_S, wait_for
from helpers.slowly import first_and_slowly

SIGNALS = first_and_slowly(signal.SIGINT, signal.SIGTERM)


def assert_stopped_in_order(run, summary, undisturbed):
    """Exit status 0 is behind us; the summary covers what the log holds, to the last bit, and says why it ended."""
    log = haploop.logger.read(run.out)
    assert summary["ended"] == "stopped"
    assert json.loads((run.out / "summary.json").read_text())["ticks"] == summary["ticks"]
    assert not log.truncated
    assert same_bits(log, undisturbed) == summary["ticks"] if summary["ticks"] else True
    assert log["/events"][-1]["stop"] is True
    assert log["/events"][-1]["tick"] == summary["ticks"]


@pytest.mark.parametrize("number", SIGNALS)
def test_the_first_signal_ends_a_run_in_order_with_a_summary_of_what_ran(number, running, undisturbed):
    """And it can be replayed, bit for bit."""
    run = running()
    done = run.reaches(200)
    run.signal(number)
    summary = run.summary()
    run.leaves_nothing()
    assert summary["ticks"] >= done
    assert replay(run.out).differences == []
    assert_stopped_in_order(run, summary, undisturbed)


@pytest.mark.slow
def test_the_first_signal_ends_a_paused_run_where_it_stands(running, undisturbed):
    run = running()
    run.reaches(200)
    run.ask("pause")
    tick = run.stands()
    run.signal(signal.SIGINT)
    summary = run.summary()
    assert summary["ticks"] == tick
    assert_stopped_in_order(run, summary, undisturbed)


@pytest.mark.slow
def test_a_signal_before_the_first_tick_ends_the_run_in_order_at_tick_0(running, undisturbed):
    run = running(sets=AT_REST)
    wait_for("the run", lambda: run.live)
    run.nodes_started("plant")
    run.signal(signal.SIGINT)
    summary = run.summary()
    run.leaves_nothing()
    assert summary["ticks"] == 0
    assert summary["verdict"] == "undecided"
    assert_stopped_in_order(run, summary, undisturbed)


@pytest.mark.slow
def test_the_second_signal_ends_a_run_at_once_that_the_first_cannot_end(running, undisturbed):
    """The logger hangs and the deadline is far away, so that the order the first signal asks for never comes."""
    run = running()
    flushed = run.has_logged(200)
    run.send("logger", signal.SIGSTOP)
    run.signal(signal.SIGINT)
    wait_for("half a second", lambda: run.stood_for(0.5))
    assert run.ask("status")
    run.signal(signal.SIGINT)
    run.end(1)
    run.leaves_nothing()
    assert "Interrupted at once" in run.stderr
    assert "Traceback" not in run.stderr
    assert same_bits(haploop.logger.read(run.out), undisturbed) >= flushed


@pytest.mark.slow
@pytest.mark.parametrize("number", SIGNALS)
def test_the_first_signal_ends_a_run_in_one_process_in_order_too(number, launched, tmp_path, undisturbed):
    out = tmp_path / "out"
    run = launched("run", str(SCENE), "--set", "duration=600", "--in-process", "--json", out=out)
    wait_for("the log", lambda: log_so_far(out).get("/controller"))
    run.signal(number)
    summary = run.summary()
    assert 0 < summary["ticks"] < 600_000
    assert_stopped_in_order(run, summary, undisturbed)
    assert replay(out).differences == []


@pytest.mark.slow
def test_one_signal_is_enough_for_a_run_in_one_process_whose_element_does_not_come_back(launched, tmp_path):
    (tmp_path / "loops.py").write_text(
        "from haploop.controller.dissipation import Element\n\nclass Loops(Element):\n    kind = 'loops'\n\n"
        "    def force(self, motion):\n        if motion.x < -0.06:\n            print('loops')\n"
        "        while motion.x < -0.06:\n            pass\n        return 0.0\n"
    )
    out = tmp_path / "out"
    words = ["--plugin", str(tmp_path / "loops.py"), "--set", 'dissipation=[{kind="loops"}]']
    run = launched("run", str(SCENE), *words, "--set", "run.deadline=0.5", "--in-process", out=out)
    wait_for("the loop", lambda: "loops" in run.stderr)
    run.signal(signal.SIGTERM)
    run.end(1)
    assert "Interrupted at once; what was logged is in" in run.stderr


@pytest.mark.parametrize(
    "moment",
    [
        # as the commands are imported
        "kept = builtins.__import__\n"
        "def met(name, *others):\n"
        "    if name == 'haploop.tools.cli.app': signal.raise_signal(signal.SIGINT)\n"
        "    return kept(name, *others)\n"
        "builtins.__import__ = met\n",
        # as soon as they have been
        "kept = LeavingAtOnce.__exit__\n"
        "def met(self, *others):\n"
        "    kept(self, *others)\n"
        "    signal.raise_signal(signal.SIGINT)\n"
        "LeavingAtOnce.__exit__ = met\n",
    ],
    ids=["in an import", "after the imports"],
)
def test_ctrl_c_before_a_command_has_begun_is_a_sentence(moment):
    start = "import builtins, signal\nfrom haploop.tools.cli.main import LeavingAtOnce, main\n"
    done = subprocess.run([sys.executable, "-c", f"{start}{moment}main()"], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "Interrupted before anything began.\n")


@pytest.mark.slow
@pytest.mark.parametrize("wait_s", [0.0, 0.2, 0.5, 1.0])
def test_ctrl_c_twice_within_ten_milliseconds_shows_no_traceback_and_ends_the_run(wait_s, tmp_path):
    """Whatever the command is at on this machine: once it has started its first process, it loads, or runs.

    The two may arrive as one, which stops a run in order. Python itself ends with the signal's status, whatever is
    asked of it, where one came while a dataclass was made.
    """
    words = ["run", str(SCENE), "--set", "duration=100", "--pace", "1", "--out", str(tmp_path / "out")]
    run = subprocess.Popen([*HAPLOOP, *words], stderr=subprocess.PIPE, text=True, start_new_session=True)
    wait_for("a process of the run", lambda: any(parent == run.pid for _, parent, *_ in processes()))
    time.sleep(wait_s)
    with contextlib.suppress(ProcessLookupError):
        for _ in range(2):
            os.killpg(run.pid, signal.SIGINT)
            time.sleep(0.01)
    _, said = run.communicate(timeout=PATIENCE_S)
    assert "Traceback" not in said
    assert run.returncode == 0 or "Interrupted" in said, (run.returncode, said)
    assert run.returncode in (0, 1, -signal.SIGINT)
