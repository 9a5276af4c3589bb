"""Simulated time after a hundred million plant steps is as exact as at the start."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from haploop.logger.log.channels import Channels
from haploop.logger.log.recording import MemoryLog
from haploop.plant.line.delay import DelayLine
from haploop.protocol.scene.scene import Clock
from haploop.protocol.ticks import Timebase, whole_count

RATE, CONTROL = 10_000, 1_000
FAR = 100_000_000  # steps: 10 000 s
LONG = Clock(plant_rate=RATE, control_rate=CONTROL, round_trip_delay=0.0013)


@pytest.mark.slow
def test_every_tick_of_a_hundred_million_steps_falls_on_its_step_to_the_last_bit():
    """Step k n and tick k divide to the same float: both are the rounded value of one rational number."""
    ticks = np.arange(FAR // 10 + 1)
    assert np.array_equal(ticks * 10 / RATE, ticks / CONTROL)


def test_adding_up_the_step_does_not():
    """The wrong way: after a minute already most ticks are found on another step."""
    times = np.cumsum(np.full(600_000, 1.0 / RATE))
    found = (times[9::10] / (1.0 / CONTROL)).astype(int)
    assert np.count_nonzero(found != np.arange(1, 60_001)) > 10_000


@pytest.mark.parametrize("tick", [1, 9_999_999, 9_999_998, 7_654_321, 3])
def test_a_tick_far_out_is_found_from_its_time_and_has_its_whole_nanoseconds(tick):
    time = Timebase.from_clock(LONG, FAR / RATE)
    assert time.ticks == FAR // 10
    assert time.first_tick_at(tick / CONTROL) == tick
    assert time.first_tick_at(math.nextafter(tick / CONTROL, 0.0)) == tick
    assert time.first_tick_at((tick - 0.5) / CONTROL) == tick
    assert time.tick_ns(tick) == int(Fraction(tick, CONTROL) * 10**9)


def test_the_line_delays_the_two_hundred_thousandth_command_as_it_does_the_first():
    """Command k from step k n + 13 on: three steps of the one before the last, seven of the last but one tick ago."""
    line = DelayLine(Timebase.from_clock(LONG, FAR / RATE))
    line.receive([0.0])
    for tick in range(199_999):
        line.receive([float(tick + 1)])
        line.holds(tick)
    assert line.holds(199_999) == [(3, 199_997.0, 199_997), (7, 199_998.0, 199_998)]


@pytest.mark.parametrize("tick", [0, 12_345, 9_300_000_000, 10**10 - 2])
def test_the_log_stamps_every_tick_that_a_run_may_have_with_its_whole_nanoseconds(tick):
    """Ticks times 10^9 pass 2^63 from 9.2 10^9 ticks on."""
    time, log = Timebase.from_clock(Clock(control_rate=3_000, plant_rate=30_000), 1.0), MemoryLog()
    kept = []
    log.write = lambda channel, log_times_ns, values: kept.extend(log_times_ns.tolist())
    Channels(log, time, every_step=False).energy(tick, {"wall": np.zeros(2)})
    assert kept == [time.tick_ns(tick), time.tick_ns(tick + 1)]


def test_of_a_delay_that_is_no_whole_number_of_steps_no_plant_rate_is_offered_that_a_scene_may_not_have():
    for rate, offered in ((2_000_000, " With clock.plant_rate = 4000000 it is 1 of them."), (6_000_000, "")):
        complaints = []
        whole_count(0.5 / rate, rate, "It", "plant steps", complaints)
        assert complaints[0].endswith(f"nearest legal values are 0 s and {1 / rate:.9g} s.{offered}")
