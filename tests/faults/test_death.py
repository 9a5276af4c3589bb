"""A process of a run dies or hangs: the run ends, says who it was and where, and leaves nothing but its files."""

import re
import signal
from pathlib import Path

import pytest

import haploop.logger
from haploop.launch.processes import run_directory
from haploop.launch.runs.replay import replay
from helpers.live.launched import AT_REST, BRIEF, BRIEF_S, LONG, ROLES, same_bits
from helpers.live.system import alive
from helpers.live.waiting import wait_for
from helpers.slowly import first_and_slowly

NAMED = r"The {} was killed by SIGKILL; the last tick all nodes had done is (\d+) "


def common_tick(role, stderr):
    """The tick an error names, and whether it is the whole of what was said: no traceback comes with it."""
    found = re.search(NAMED.format(role), stderr)
    assert found, stderr
    assert "Traceback" not in stderr
    return int(found[1])


@pytest.mark.parametrize("role", first_and_slowly(*ROLES))
def test_a_node_killed_in_mid_run_ends_the_run_is_named_with_the_last_common_tick_and_leaves_nothing(
    role, running, undisturbed
):
    run = running()
    flushed = run.has_logged(200)
    done = run.reaches(flushed)
    run.send(role, signal.SIGKILL)
    run.end(1)
    run.leaves_nothing()
    assert common_tick(role, run.stderr) >= done
    log = haploop.logger.read(run.out)
    logged = same_bits(log, undisturbed)
    assert replay(run.out).differences == []
    if role == "logger":
        assert log.truncated
        assert logged >= flushed
    else:
        assert logged >= common_tick(role, run.stderr), "the logger was given the time to save what there was"
        assert not log.truncated


@pytest.mark.slow
@pytest.mark.parametrize("role", first_and_slowly(*ROLES))
def test_a_node_killed_as_it_starts_ends_the_run_and_is_named(role, running):
    run = running(sets=AT_REST)
    run.nodes_started(role)
    run.send(role, signal.SIGKILL)
    run.end(1)
    run.leaves_nothing()
    assert common_tick(role, run.stderr) == 0


@pytest.mark.slow
@pytest.mark.parametrize("role", first_and_slowly(*ROLES))
def test_a_node_killed_at_the_end_when_the_others_have_done_their_last_tick_is_named(role, running):
    run = running()
    run.has_logged(200)
    run.send(role, signal.SIGSTOP)
    last = run.ask("stop")["tick"]
    run.send(role, signal.SIGKILL)
    run.end(1)
    run.leaves_nothing()
    assert 200 <= common_tick(role, run.stderr) <= last
    assert len(haploop.logger.read(run.out)["/controller"]["x"]) >= 200


@pytest.mark.slow
@pytest.mark.parametrize("role", ["logger", "controller", "plant"])
def test_a_node_that_hangs_is_named_after_the_deadline_the_user_has_set(role, running, undisturbed):
    run = running(sets=(*LONG, BRIEF))
    run.has_logged(200)
    run.send(role, signal.SIGSTOP)
    run.end(1)
    run.leaves_nothing()
    assert f"The {role} has not answered for {BRIEF_S} s" in run.stderr
    assert re.search(r"the last tick all nodes had done is \d+ ", run.stderr)
    assert "run.deadline" in run.stderr
    assert not Path("/proc/self/stat").exists() or "It is stopped, by a signal or a debugger." in run.stderr
    assert same_bits(haploop.logger.read(run.out), undisturbed) >= 200


@pytest.mark.slow
@pytest.mark.parametrize("role", first_and_slowly(*reversed(ROLES)))
def test_a_node_that_hangs_for_less_than_the_deadline_costs_time_but_not_one_tick(role, running, undisturbed):
    """At a slow pace time is granted, and telemetry sent, in small pieces, and many can come together meanwhile."""
    run = running(sets=(*LONG, "run.window_blocks=8"), pace=("--pace", "1"))
    run.reaches(50)
    run.send(role, signal.SIGSTOP)
    wait_for("a while", lambda: run.stood_for(1.5))
    run.send(role, signal.SIGCONT)
    done = run.reaches(run.ask("status")["granted"] + 50)
    run.ask("stop")
    summary = run.summary()
    assert summary["lost"]["telemetry_gaps"] == 0
    assert same_bits(run.log(), undisturbed) == summary["ticks"] >= done


@pytest.mark.slow
def test_when_the_launcher_is_killed_the_nodes_end_by_themselves_and_the_next_command_clears_up(running, undisturbed):
    run = running()
    flushed = run.has_logged(200)
    sockets = run.live.sockets
    run.signal(signal.SIGKILL)
    wait_for("the end of the nodes", lambda: not alive(list(run.nodes.values())))
    assert sockets.exists()
    run.end(-signal.SIGKILL)
    assert run_directory.live_runs() == []
    run.leaves_nothing()
    assert same_bits(haploop.logger.read(run.out), undisturbed) >= flushed


@pytest.mark.slow
def test_when_the_launcher_is_killed_as_the_nodes_start_they_end_by_themselves(running):
    run = running()
    run.nodes_started()
    run.signal(signal.SIGKILL)
    wait_for("the end of the nodes", lambda: not alive(list(run.nodes.values())))
    run.end(-signal.SIGKILL)
    assert "Traceback" not in run.stderr


@pytest.mark.slow
def test_a_launcher_that_was_stopped_for_longer_than_the_deadline_blames_nobody(running, undisturbed):
    run = running(sets=(*LONG, BRIEF))
    done = run.reaches(200)
    run.signal(signal.SIGSTOP)
    wait_for("three deadlines", lambda: run.stood_for(3 * BRIEF_S))
    run.signal(signal.SIGCONT)
    run.reaches(done + 200)
    run.ask("stop")
    assert run.summary()["ended"] == "stopped"
    assert same_bits(haploop.logger.read(run.out), undisturbed) >= done
