"""Printing of a run: shown to its end, with how it ended; the run does not mind."""

from __future__ import annotations

import signal

import pytest

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from helpers.live.launched import SCENE
from helpers.live.waiting import wait_for, wait_till_stays

KINDS = registry()
# It stands still at tick 500, so that it is surely still there when something joins it.
SHORT = ("duration=1.5", "event=[{at=0.5, pause=true}]")


@pytest.fixture
def printing(launched):
    """Print a run that stands at tick 500, once the clock knows of it."""

    def attach(run):
        printer = launched("attach", "print", "--run", run.live.id)
        ticks = lambda: [n["tick"] for n in run.ask("status")["nodes"] if n["role"] == "print"]  # noqa: E731
        wait_till_stays("the printer", ticks, [500])
        return printer

    return attach


@pytest.mark.slow
def test_a_run_is_printed_to_its_end_with_its_changes_and_final_verdict(running, printing):
    run = running(sets=SHORT, pace=("--pace", "5"))
    run.reaches(500)
    printer = printing(run)
    run.ask("swap", swap={"kind": "damping", "damping": 0.2}, element=0)
    run.ask("resume")
    summary = run.summary()
    lines = printer.end(0).splitlines()
    assert "0.500 s  element 0 becomes damping (damping 0.2)" in lines
    assert lines[-1].startswith("1.500 s  x ")
    assert summary["verdict"] in lines[-1] or "no swing seen" in lines[-1] or "swinging" in lines[-1]
    assert "ended at tick 1500, 1.5 s." in printer.stderr
    assert "Traceback" not in printer.stderr


@pytest.mark.slow
def test_a_printer_costs_the_run_no_bit_and_leaves_at_an_interrupt(running, printing):
    run = running(sets=SHORT, pace=())
    run.reaches(500)
    printer = printing(run)
    printer.signal(signal.SIGINT)
    printer.end(0)
    wait_for("its leaving", lambda: "print" not in {node["role"] for node in run.ask("status")["nodes"]})
    run.ask("resume")
    alone = run_in_process(load(SCENE, SHORT, KINDS), KINDS)
    assert run.summary()["trajectory_sha256"] == alone["trajectory_sha256"]
    assert "Traceback" not in printer.stderr


@pytest.mark.slow
def test_a_run_that_fails_is_told_with_the_reason_and_exit_status_1(running, printing):
    run = running(sets=("duration=600", "event=[{at=0.5, pause=true}]"))
    run.reaches(500)
    printer = printing(run)
    run.send("plant", signal.SIGKILL)
    run.end(1)
    printer.end(1)
    assert "(failed): The plant was killed by SIGKILL" in printer.stderr


@pytest.mark.slow
def test_a_printer_whose_run_vanishes_ends_by_itself(running, printing):
    run = running(sets=("duration=600", "event=[{at=0.5, pause=true}]"))
    run.reaches(500)
    printer = printing(run)
    run.signal(signal.SIGKILL)
    run.end(-signal.SIGKILL)
    printer.end(1)
    assert "(failed): Its launcher has ended without a word." in printer.stderr
