"""The share of a swing that is the loop's own, and what moved the run beside it."""

from __future__ import annotations

import pytest

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.stability.finding import Finding
from helpers.scenes.least import scene
from helpers.scenes.pressed import pressed


@pytest.mark.parametrize(("stiffness", "least", "most"), [(500.0, 0.0, 0.1), (1100.0, 0.8, 1.0)])
def test_the_share_of_a_swing_that_is_the_loops_own_is_what_remains_of_it(stiffness, least, most):
    """A hand that trembles on a wall that rests but for its encoder's counts, and on one that buzzes."""
    force = {"kind": "sine", "amplitude": 0.05, "frequency": 5.0, "offset": -1.0}
    tables = {**pressed(), "hand": {"force": force}, "wall": {"position": 0.0, "stiffness": stiffness}}
    summary = run_in_process(scene(**tables, encoder={"resolution": 2e-5}, run={"verdict": "pushed"}), registry())
    assert least <= summary["stability"]["own_share"] <= most


def test_a_steady_loop_that_noise_shakes_tells_the_ripple_of_the_run_and_what_moved_it():
    tables = {**pressed(), "wall": {"position": 0.0, "stiffness": 500.0}, "run": {"verdict": "pushed"}}
    still = run_in_process(scene(**tables), registry())
    shaken = run_in_process(scene(**tables, noise={"deviation": 3e-5, "cutoff": 400.0}), registry())
    assert {still["verdict"], shaken["verdict"]} == {"steady"}
    assert still["window"]["force_ripple_N"] < 0.01 < 0.05 < shaken["window"]["force_ripple_N"]
    assert (still["stability"]["moved_beside"], shaken["stability"]["moved_beside"]) == ([], ["noise"])
    assert shaken["stability"]["force_ripple_N"] < 0.001


def test_of_a_swing_that_nothing_beside_the_loop_moves_no_share_is_told():
    finding = Finding("limit-cycle", "lasts", width_m=1e-3)
    assert finding.entries(1.2e-3)["stability"]["own_share"] is None
    assert finding.entries(1.2e-3, ["noise"])["stability"]["own_share"] == pytest.approx(1 / 1.2)


def test_no_share_is_told_of_a_run_that_swung_less_than_its_loop_does():
    finding = Finding("limit-cycle", "lasts", width_m=1e-3)
    assert finding.own_share(2e-3) == 0.5
    assert finding.own_share(5e-4) is None
    assert finding.own_share(0.0) is None
    assert Finding("growing", "grows", width_m=1e-3).own_share(2e-3) is None
