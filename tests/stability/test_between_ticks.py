"""What verdicts of slow controllers with springy cables rest on: samples at the ticks do not show every swing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from haploop.launch.runs.in_process import run_in_process
from haploop.launch.stability.between_ticks import BETWEEN_TICKS, rings_between_ticks
from haploop.launch.stability.traces import smallest_felt_m
from haploop.logger.log.recording import MemoryLog
from haploop.protocol.scene.scene import Scene
from helpers.scenes.least import KINDS, scene
from helpers.scenes.presets import loop_of

# An independent program saw its motor swing at 212 Hz, of which samples at 250 Hz make 38 Hz.
HIDDEN = {
    "duration": 3.0,
    "clock": {"control_rate": 250, "plant_rate": 10_000, "round_trip_delay": 0.0032},
    "device": {"mass": 0.05, "damping": 0.0},
    "transmission": {"motor_mass": 0.02, "motor_damping": 0.02, "stiffness": 27806.94, "damping": 0.002},
    "hand": {
        "mass": 0.03, "damping": 10.0, "stiffness": 30.0,
        "force": {"kind": "ramp", "value": -1.0, "rise_time": 0.3},
    },
    "wall": {"position": -1e-3, "stiffness": 425.51712788997924},
    "encoder": {"resolution": 5e-6},
    "dissipation": [{"kind": "damping", "damping": 2.694381211084354}],
    "run": {"verdict": "pushed"},
}  # fmt: skip


def cabled(rate: int, damping: float) -> Scene:
    loop = loop_of("premium15_cable")
    assert loop.transmission
    transmission = replace(loop.transmission, damping=damping)
    return replace(loop, clock=replace(loop.clock, control_rate=rate), transmission=transmission)


@pytest.mark.parametrize(("rate", "damping", "rings"), [(1000, 0.2, False), (250, 0.2, True), (250, 4.0, False)])
def test_a_lightly_damped_cable_is_told_where_its_mode_lies_at_half_the_control_rate_or_above(rate, damping, rings):
    """With 4300 N/m between 49.6 g and 2.9 g it is at 200 Hz, and 4 N s/m damp it by more than half of critical."""
    assert rings_between_ticks(cabled(rate, damping)) == rings


def test_a_device_without_a_cable_has_no_mode_that_its_samples_could_miss():
    assert not rings_between_ticks(replace(cabled(100, 0.2), transmission=None))


def test_a_swing_that_a_hand_feels_between_ticks_is_not_called_steady_without_saying_so():
    of = scene(**HIDDEN)
    log = MemoryLog()
    told = run_in_process(of, KINDS, memory=log)
    assert (told["verdict"], told["stability"]["felt"]) == ("steady", False)
    assert told["stability"]["provisos"] == [BETWEEN_TICKS]
    x = log.recording()["/plant"]["x"][-5000:]
    size_m = 2.0 * np.abs(np.fft.rfft((x - x.mean()) * np.hanning(len(x)))) / (0.5 * len(x))
    hertz = np.fft.rfftfreq(len(x), 1e-4)
    fast = np.flatnonzero(hertz > 125.0)
    main = fast[size_m[fast].argmax()]
    assert hertz[main] == pytest.approx(212.0, abs=4.0)
    assert size_m[main] > 2.0 * smallest_felt_m(hertz[main])
