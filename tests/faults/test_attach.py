"""A second logger that joins a run: it logs the same numbers, and whatever becomes of it, the run does not mind."""

import json
import signal

import numpy as np
import pytest

import haploop.logger
from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.runs.replay import ReplayError, replay
from haploop.launch.scene.file import load
from helpers.live.launched import BRIEF, BRIEF_S, SCENE
from helpers.live.system import alive
from helpers.live.waiting import wait_for
from helpers.slowly import first_and_slowly

KINDS = registry()
# It stands still at tick 500, so that it is surely still there when something joins it.
SHORT = ("duration=3", "event=[{at=0.5, pause=true}]")
# Nobody waits so long: what does not depend on the deadline must not need it.
NEVER = "run.deadline=600"


@pytest.fixture(scope="module")
def alone():
    """The digest of the short run when nothing joins it."""
    return run_in_process(load(SCENE, SHORT, KINDS), KINDS)["trajectory_sha256"]


@pytest.fixture
def attached(launched, tmp_path):
    """Attach a logger to a run; returns it once it has begun."""

    def attach(run, **options):
        out = tmp_path / "second"
        logger = launched("attach", "logger", "--run", run.live.id, out=out, **options)
        logger.says("logging run")
        return logger

    return attach


def assert_same_from_its_first_tick_on(own, second):
    """Plant and controller bit for bit; energies but for what they were at its first tick."""
    rows = len(second["/controller"]["x"])
    first = len(own["/controller"]["x"]) - rows
    assert rows > 0
    assert first > 0, "it joined in mid-run"
    assert second["/controller"].keys() == own["/controller"].keys()
    for name, column in second["/controller"].items():
        assert column.tobytes() == own["/controller"][name][first:].tobytes(), name
    for name, column in second["/plant"].items():
        assert column.tobytes() == own["/plant"][name][10 * first :].tobytes(), name
    scale = np.abs(own["/energy"]["moved"]).max()
    for name in second["/energy"].keys() - {"timestamp", "residual"}:
        its, runs = second["/energy"][name], own["/energy"][name][first:]
        opened = np.isfinite(its)
        assert np.array_equal(opened, np.isfinite(runs)), name
        difference = (its - runs)[opened]
        assert np.abs(difference - difference[0]).max() <= 1e-13 * scale, name
    return first


@pytest.mark.slow
@pytest.mark.parametrize("delay", first_and_slowly("2 ms", "0.3 ms", "0 ms"))
def test_a_logger_that_joins_in_mid_run_logs_the_same_numbers_from_its_first_tick_on(delay, running, attached):
    """The swap after it has joined stands in its log too, the books it opens as well."""
    run = running(sets=("duration=600", NEVER, f"clock.round_trip_delay={delay}", "wall.position=-0.001"))
    run.reaches(500)
    second = attached(run)
    run.ask("swap", swap={"kind": "damping", "damping": 0.2})
    run.reaches(run.ask("status")["granted"] + 300)
    run.ask("stop")
    summary = run.summary()
    second.end(0)
    own, log = run.log(), haploop.logger.read(second.out)
    first = assert_same_from_its_first_tick_on(own, log)
    assert log["/events"] == own["/events"]
    its = json.loads((second.out / "summary.json").read_text())
    assert its["from_tick"] == first
    assert its["ticks"] == summary["ticks"] - first
    assert its["final"] == summary["final"]
    assert its["lost"] == summary["lost"] == {"commands_dropped": 0, "commands_lost": 0, "telemetry_gaps": 0}
    with pytest.raises(ReplayError, match=f"was logged from {first / 1000:g} s on"):
        replay(second.out)
    assert its["energy"]["residual_J"] <= 1e-12 * its["energy"]["moved_J"]


@pytest.mark.slow
def test_a_logger_can_join_a_run_that_stands_still_and_misses_nothing_though_it_is_stopped_as_the_run_ends(
    running, attached, alone
):
    run = running(sets=(*SHORT, NEVER))
    run.reaches(500)
    second = attached(run)
    run.stands(at=run.ask("step", ticks=1500)["tick"])
    second.signal(signal.SIGSTOP)
    run.ask("resume")
    wait_for("more than its processes would wait for by themselves", lambda: second.stood_for(1.5))
    second.signal(signal.SIGCONT)
    assert run.summary()["trajectory_sha256"] == alone
    second.end(0)
    assert assert_same_from_its_first_tick_on(run.log(), haploop.logger.read(second.out)) == 500


@pytest.mark.slow
def test_a_logger_that_leaves_by_an_interrupt_has_a_whole_log_and_the_run_goes_on(running, attached, alone):
    run = running(sets=(*SHORT, NEVER))
    run.reaches(500)
    second = attached(run)
    run.stands(at=run.ask("step", ticks=200)["tick"])
    second.signal(signal.SIGINT)
    second.end(0)
    assert {node["role"] for node in run.ask("status")["nodes"]} == {"plant", "controller", "logger"}
    run.ask("resume")
    assert run.summary()["trajectory_sha256"] == alone
    log, its = haploop.logger.read(second.out), json.loads((second.out / "summary.json").read_text())
    assert not log.truncated
    assert (its["ended"], its["ticks"], len(log["/controller"]["x"])) == ("stopped", 200, 200)


@pytest.mark.slow
def test_a_logger_that_is_killed_does_not_hold_the_run_up_until_the_deadline(running, attached, alone):
    """Not even when the run is waiting for it already, a window of 4 blocks of 50 ticks ahead."""
    run = running(sets=(*SHORT, NEVER, "run.block_ticks=50", "run.window_blocks=4"))
    run.reaches(500)
    second = attached(run)
    second.signal(signal.SIGSTOP)
    run.ask("resume")
    assert run.reaches(700) == run.ask("status")["granted"] == 700
    second.signal(signal.SIGKILL)
    second.end(-signal.SIGKILL)
    assert run.summary()["trajectory_sha256"] == alone
    assert haploop.logger.read(second.out).truncated


@pytest.mark.slow
def test_a_logger_that_hangs_holds_the_run_up_until_the_deadline_and_is_then_dropped(running, attached, alone):
    """The run waits for it first: a lossless logger may be slow. Woken up, it says that the run went on without it."""
    run = running(sets=(*SHORT, BRIEF))
    run.reaches(500)
    second = attached(run)
    run.stands(at=run.ask("step", ticks=200)["tick"])
    second.signal(signal.SIGSTOP)
    run.ask("resume")
    assert run.summary()["trajectory_sha256"] == alone
    # Its silence counts from its last answer to a probe, which came before it was stopped.
    assert second.stood_for(BRIEF_S - 1)
    assert second.is_there()
    second.signal(signal.SIGCONT)
    second.end(1)
    assert "Traceback" not in second.stderr
    assert same_bits_so_far(run, second) > 0


def same_bits_so_far(run, second):
    """Ticks in the second log, all of them the run's."""
    own, log = run.log()["/controller"], haploop.logger.read(second.out)["/controller"]
    first = int(np.searchsorted(own["timestamp"], log["timestamp"][0]))
    for name in ("timestamp", "x", "total"):
        assert log[name].tobytes() == own[name][first : first + len(log[name])].tobytes()
    return len(log["x"])


@pytest.mark.slow
def test_a_logger_whose_run_vanishes_ends_by_itself_and_its_log_reads(running, attached):
    run = running()
    run.reaches(200)
    second = attached(run)
    run.reaches(run.ask("status")["granted"] + 1)
    run.signal(signal.SIGKILL)
    run.end(-signal.SIGKILL)
    second.end(1)
    assert "has ended without a word" in second.stderr
    wait_for("the end of the nodes", lambda: not alive(list(run.nodes.values())))
    assert not haploop.logger.read(second.out).truncated


@pytest.mark.slow
def test_a_logger_whose_run_fails_says_why(running, attached):
    run = running()
    run.reaches(200)
    second = attached(run)
    run.send("plant", signal.SIGKILL)
    run.end(1)
    second.end(1)
    assert "The plant was killed by SIGKILL" in second.stderr
    assert json.loads((second.out / "summary.json").read_text())["ended"] == "failed"


@pytest.mark.slow
def test_a_directory_that_holds_something_is_refused_by_attach_too(running, launched, tmp_path):
    (tmp_path / "kept.txt").touch()
    run = running()
    run.reaches(1)
    second = launched("attach", "logger", out=tmp_path)
    second.end(2)
    assert "must be new or empty" in second.stderr
    assert {node["role"] for node in run.ask("status")["nodes"]} == {"plant", "controller", "logger"}
