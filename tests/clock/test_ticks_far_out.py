"""Simulated time after a hundred million plant steps is as exact as at the start."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from haploop.plant.line.delay import DelayLine
from haploop.protocol.scene.scene import Clock
from haploop.protocol.ticks import Timebase

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
