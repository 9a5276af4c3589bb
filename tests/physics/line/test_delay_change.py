"""A delay set while the loop runs: the first command it holds for, what it overtakes, and that the books stay exact."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.protocol.scene.scene import Scene
from helpers.runs.captured import Captured, in_blocks, run
from helpers.scenes.least import PRESSED, mistakes, scene

BRAKED = {key: table for key, table in PRESSED.items() if key != "clock"}
BRAKED |= {"duration": 0.12, "encoder": {"resolution": 1e-5}, "dissipation": [{"kind": "damping", "damping": 0.3}]}
N, TICKS = 10, 120
FRICTION = {"friction": {"kinetic": 0.02}}


def changing(delays: list[tuple[int, int]], integrator: str = "exact", **tables: Any) -> Scene:
    """The pressed device with the delay in plant steps from each of these ticks on; the first from 0 on."""
    (_, first), *later = delays
    events = [{"at": tick / 1000, "set": {"clock.round_trip_delay": steps / 10_000}} for tick, steps in later]
    return scene(
        **{**BRAKED, **tables}, clock={"round_trip_delay": first / 10_000, "integrator": integrator}, event=events
    )


def by_the_rule(delays: list[tuple[int, int]]) -> tuple[list[int], int]:
    """Looks at all commands at once: command k acts from k n + d on, with the delay of its tick, unless a later one
    has begun before; the command in effect at every step, and how many never had their turn."""
    own = [next(steps for tick, steps in reversed(delays) if tick <= k) for k in range(TICKS)]
    effects = [k * N + d for k, d in enumerate(own)]
    end = TICKS * N
    command = [max((k for k in range(TICKS) if effects[k] <= step), default=-1) for step in range(end)]
    overtaken = [any(effects[later] < effects[k] < end for later in range(k, TICKS)) for k in range(TICKS)]
    return command, sum(overtaken)


def assert_by_the_rule(ran: Captured, delays: list[tuple[int, int]]) -> None:
    command, dropped = by_the_rule(delays)
    assert ran.plant["command"][:-1].tolist() == command
    total = np.append(ran.controller["total"], 0.0)  # at -1: before the first
    assert np.array_equal(ran.plant["force"][:-1], total[command])
    assert ran.summary["lost"]["commands_dropped"] == dropped
    assert ran.summary["energy"]["residual_J"] <= 1e-12 * ran.summary["energy"]["moved_J"]


DELAYS = st.lists(
    st.tuples(st.integers(0, TICKS - 1), st.integers(0, 45)), min_size=2, max_size=5, unique_by=lambda pair: pair[0]
).map(lambda pairs: [(0, pairs[0][1]), *sorted(pair for pair in pairs[1:] if pair[0])])


@pytest.mark.slow
@given(DELAYS)
def test_every_step_feels_the_command_of_the_rule_and_the_books_close(delays):
    assert_by_the_rule(run(changing(delays)), delays)


@pytest.mark.parametrize("tables", [FRICTION, {"actuator": {"saturation": 0.4}}, {"integrator": "rk4"}])
def test_the_rule_holds_for_every_kind_of_motion_and_for_an_actuator_at_the_end_of_the_line(tables):
    delays = [(0, 40), (40, 3), (80, 37)]
    ran = run(changing(delays, **tables))
    command, dropped = by_the_rule(delays)
    assert dropped == 3
    assert ran.plant["command"][:-1].tolist() == command
    assert ran.summary["lost"]["commands_dropped"] == dropped


def test_a_delay_set_to_what_it_was_changes_no_bit():
    changed, unchanged = run(changing([(0, 13), (60, 13)])), run(changing([(0, 13)]))
    assert changed.summary["trajectory_sha256"] == unchanged.summary["trajectory_sha256"]


def test_the_exact_flow_and_another_method_agree_about_a_motion_whose_delay_changes():
    """DOP853 knows nothing of the parts in which the exact flow fills in what it recorded."""
    delays = [(0, 40), (40, 3), (80, 37)]
    exact, integrated = (run(changing(delays, method)) for method in ("exact", "dop853"))
    assert np.abs(exact.plant["x"] - integrated.plant["x"]).max() < 1e-9
    assert np.abs(exact.plant["v"] - integrated.plant["v"]).max() < 1e-6


def test_jitter_comes_on_top_of_the_delay_of_the_moment():
    delays = [(0, 40), (40, 3), (80, 37)]
    ran = run(changing(delays, jitter={"kind": "uniform", "most": 0.0}))
    assert ran.plant["command"][:-1].tolist() == by_the_rule(delays)[0]


def test_blocks_of_any_size_give_the_same_summary():
    resolved = changing([(0, 20), (40, 3), (41, 0), (80, 37)])
    usual = in_blocks(resolved, 100)
    assert usual["lost"]["commands_dropped"] > 0
    for block_ticks in (1, 7, 1000):
        assert in_blocks(resolved, block_ticks) == usual


def test_a_delay_of_no_whole_number_of_steps_is_refused_with_the_nearest_two():
    events = [{"at": 0.05, "set": {"clock.round_trip_delay": "0.25 ms"}}]
    (complaint,) = mistakes(**BRAKED, event=events)
    assert "0.0002 s and 0.0003 s" in complaint
