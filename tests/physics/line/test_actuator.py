"""The actuator's steps and saturation: the force they leave, what they count, and what they let through."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.plant.counters import SATURATED
from haploop.plant.line.actuator import ActuatedLine
from haploop.plant.line.delay import DelayLine, make_line
from haploop.plant.plant import Plant
from haploop.protocol.scene import effects
from haploop.protocol.ticks import Timebase
from helpers.runs.captured import in_blocks, of_the_scene, run
from helpers.scenes.least import PRESSED, scene, typed

FORCES = st.floats(-1e3, 1e3)


def driven(forces: list[float], table: dict[str, float], delay: int = 3) -> tuple[list[float], float]:
    """Force at the step at which each command takes effect, and how many were clipped."""
    time = Timebase(plant_rate=10_000, control_rate=1000, delay_steps=delay, ticks=len(forces) + 1)
    line = ActuatedLine(DelayLine(time), effects.Actuator(**table), time)
    line.receive([*forces, 0.0])
    by_step = [force for tick in range(time.ticks) for count, force, _ in line.holds(tick) for _ in range(count)]
    clipped = line.counters[SATURATED].column(0, 10 * time.ticks)[-1] if "saturation" in table else 0
    return by_step[delay : delay + 10 * len(forces) : 10], clipped


@given(st.lists(FORCES, min_size=1, max_size=20), st.floats(1e-3, 100.0))
def test_the_force_is_the_nearest_whole_step(forces, resolution):
    for force, felt in zip(forces, driven(forces, {"resolution": resolution})[0], strict=True):
        assert felt == resolution * np.rint(force / resolution)


@given(st.lists(FORCES, min_size=1, max_size=20), st.floats(1e-3, 1e3))
def test_the_force_is_clipped_on_both_sides_and_every_clipped_command_counts_once(forces, most):
    felt, clipped = driven(forces, {"saturation": most})
    assert np.array_equal(felt, np.clip(forces, -most, most))
    assert clipped == sum(abs(force) > most for force in forces)


def test_rounding_comes_before_clipping():
    felt, clipped = driven([0.96, 1.0, 1.04, 1.06, -1.06], {"resolution": 0.1, "saturation": 1.04})
    assert felt == pytest.approx([1.0, 1.0, 1.0, 1.04, -1.04], rel=1e-12)
    assert clipped == 2


def test_a_force_with_too_many_steps_to_count_stays_itself():
    assert driven([1e300, -1e305], {"resolution": 1e-9})[0] == [1e300, -1e305]


@pytest.mark.parametrize("actuator", [{"saturation": 1e6}, {"saturation": 1e3}])
def test_an_actuator_that_limits_nothing_changes_no_bit(actuator):
    without, neutral = (of_the_scene(run(scene(**PRESSED, **table)).summary) for table in ({}, {"actuator": actuator}))
    counted = neutral.pop("actuator", {"saturated_commands": 0})
    assert counted == {"saturated_commands": 0}
    assert neutral["trajectory_sha256"] == without["trajectory_sha256"]
    assert neutral["extremes"] == without["extremes"]


def test_the_device_feels_the_limited_force_and_the_summary_says_how_often():
    ran = run(scene(**PRESSED, actuator={"saturation": 0.4, "resolution": 0.003}))
    command = ran.plant["command"][:-1].astype(int)
    commanded = np.append(ran.controller["total"], 0.0)[command]
    limited = np.clip(0.003 * np.rint(commanded / 0.003), -0.4, 0.4)
    assert np.array_equal(ran.plant["force"][:-1], limited)
    acted = np.unique(command[command >= 0])
    beyond = np.abs(0.003 * np.rint(ran.controller["total"][acted] / 0.003)) > 0.4
    assert ran.summary["actuator"] == {"saturated_commands": beyond.sum()}
    assert beyond.any()


@pytest.mark.parametrize("late", [{}, {"jitter": {"kind": "uniform", "most": 0.0}}])
@pytest.mark.parametrize(
    "actuator", [{}, {"saturation": 1.0}, {"resolution": 0.01}, {"saturation": 1.0, "resolution": 0.01}]
)
@pytest.mark.parametrize("force", [math.nan, math.inf, -math.inf])
def test_a_command_that_is_no_finite_number_ends_the_run_where_it_would_act(force, actuator, late):
    """Neither is it clipped to a force, nor rounded away."""
    limits = {"actuator": actuator} if actuator else {}
    tables = scene(duration=0.1, clock={"round_trip_delay": 0.0023}, **limits, **late)
    plant = Plant(tables, Timebase.from_scene(tables))
    plant.run_until(100, lambda tick, samples: [force if tick + i == 20 else 0.1 for i in range(len(samples))])
    assert plant.stop_reason == f"command 20 was {force}, which no device can apply, at tick 22"
    assert plant.reached == 22
    assert math.isfinite(plant.state()["x"])


def test_counts_are_the_same_for_blocks_of_any_size_also_when_the_run_is_stopped_or_diverges():
    stopped = {"event": [{"at": 0.1003, "stop": True}]}
    diverging = {"hand": {"force": {"kind": "ramp", "value": -3.0, "rise_time": 0.2}}, "diverged_beyond": 0.05}
    for change, ended in (({}, "done"), (stopped, "stopped"), (diverging, "diverged")):
        limited = scene(**PRESSED | change, actuator={"saturation": 0.4})
        usual = in_blocks(limited, 100)
        assert usual["ended"] == ended
        assert usual["actuator"]["saturated_commands"] > 0
        for block_ticks in (1, 7, 1000):
            assert in_blocks(limited, block_ticks) == usual


def test_a_command_that_never_acts_is_never_clipped():
    time = Timebase(plant_rate=10_000, control_rate=1000, delay_steps=0, ticks=10)
    line = make_line(typed(loss={"probability": 1.0}, actuator={"saturation": 1.0}), time)
    line.receive([5.0] * 10)
    assert [line.holds(tick) for tick in range(10)] == [[(10, 0.0, -1)]] * 10
    assert not line.counters[SATURATED].column(0, 100).any()
