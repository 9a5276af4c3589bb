"""The hand's force: from which time on it stays what it is."""

import math

import numpy as np
import pytest

from haploop.plant.motion.hand_force import HandForce
from haploop.protocol.scene.hand_force import Constant, MinimumJerk, Ramp, Sine, Step, Trace, constant_from_s


@pytest.mark.parametrize("force", [
    Constant(value=-1.0), Step(value=-1.0, at=0.3), Ramp(value=-1.0, rise_time=0.4),
    MinimumJerk(value=-1.0, rise_time=0.2),
])  # fmt: skip
def test_a_force_stays_from_the_time_on_that_is_told_and_no_sooner(force):
    told_s, rate = constant_from_s(force), 10_000
    values = HandForce(force, rate).at_steps(0, rate)
    changed = np.flatnonzero(np.diff(values))
    assert (changed.max() + 1 if len(changed) else 0) / rate == pytest.approx(told_s, abs=0.002)


@pytest.mark.parametrize("force", [Sine(amplitude=0.1, frequency=1.0), Trace(time=(0.0, 1.0), force=(0.0, 1.0))])
def test_a_sine_and_a_trace_are_told_to_stay_at_no_time(force):
    assert constant_from_s(force) == math.inf
