"""Readings of an accelerometer: bias, noise, range and resolution, one after the other."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st

from haploop.plant.counters import CLIPPED
from haploop.plant.sensing.accelerometer import Accelerometer
from haploop.protocol.scene import effects
from haploop.protocol.ticks import Timebase
from helpers.runs.captured import in_blocks, of_the_scene, run
from helpers.scenes.least import PRESSED, scene

TIME = Timebase(plant_rate=10_000, control_rate=1000, delay_steps=0, ticks=10**6)
MANY = 200_000
# Five standard errors: a right program meets another 999 999 of a million seeds as well.
ERRORS = 5.0
ACCELERATIONS = st.lists(st.floats(-200, 200), min_size=1, max_size=30)


def readings(accelerations, seed: int = 1, **table: Any) -> tuple[np.ndarray, float]:
    """What is read of each, and how many were clipped."""
    sensor = Accelerometer(effects.Accelerometer(**table), seed, TIME)
    read = np.array([sensor.reading(a) for a in accelerations])
    return read, sensor.counters[CLIPPED].column(0, 10 * len(read))[-1] if "range" in table else 0


@pytest.mark.parametrize("bandwidth", [1.0, 50.0, 400.0])
def test_the_noise_of_a_bandwidth_is_the_density_over_its_first_order_response(bandwidth):
    """Variance: the integral of D^2 / (1 + (f / B)^2) over all frequencies; correlation e^{-2 pi B T} over a tick."""
    noise, _ = readings([0.0] * MANY, noise_density=0.01, bandwidth=bandwidth)
    variance, _ = scipy.integrate.quad(lambda f: 1e-4 / (1.0 + (f / bandwidth) ** 2), 0.0, math.inf)
    rho = math.exp(-math.tau * bandwidth * 1e-3)
    spread = math.sqrt((1.0 + rho**2) / (1.0 - rho**2) / MANY)
    assert abs(np.mean(noise**2) / variance - 1.0) < ERRORS * math.sqrt(2.0) * spread
    assert abs(np.mean(noise[1:] * noise[:-1]) / np.mean(noise**2) - rho) < ERRORS * math.sqrt((1 - rho**2) / MANY)


def test_without_a_bandwidth_the_noise_is_white_up_to_half_the_tick_rate():
    noise, _ = readings([0.0] * MANY, noise_density=0.01)
    assert abs(np.mean(noise**2) / (1e-4 * 500.0) - 1.0) < ERRORS * math.sqrt(2.0 / MANY)
    for distance in (1, 2, 10):
        assert abs(np.mean(noise[distance:] * noise[:-distance])) < ERRORS * 1e-4 * 500.0 / math.sqrt(MANY)


def test_seeds_differ_and_a_seed_repeats():
    first, again, other = (readings([0.0] * 100, seed, noise_density=1.0)[0] for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not (first == other).any()


@given(ACCELERATIONS, st.floats(0.1, 150), st.floats(-5, 5))
def test_the_biased_reading_is_clipped_and_every_clipped_tick_counts(accelerations, most, bias):
    read, clipped = readings(accelerations, range=most, bias=bias)
    biased = np.array(accelerations) + bias
    assert np.array_equal(read, np.clip(biased, -most, most))
    assert clipped == (np.abs(biased) > most).sum()


@given(ACCELERATIONS, st.floats(1e-3, 10))
def test_a_reading_is_the_nearest_whole_count(accelerations, resolution):
    read, _ = readings(accelerations, resolution=resolution)
    assert np.array_equal(read, resolution * np.rint(np.array(accelerations) / resolution))


@given(ACCELERATIONS, st.floats(0.1, 150), st.floats(1e-3, 0.1))
def test_no_reading_lies_beyond_the_range_and_the_last_count_within_it_is_reached(accelerations, most, resolution):
    read, clipped = readings([*accelerations, 1e9, -1e9], range=most, resolution=resolution)
    assert (np.abs(read) <= most).all()
    assert read[-2] == -read[-1] > most - resolution * (1.0 + 1e-9)
    assert clipped == (np.abs(accelerations) > most).sum() + 2
    inside = np.abs(accelerations) < most - resolution
    assert np.array_equal(read[:-2][inside], (resolution * np.rint(np.array(accelerations) / resolution))[inside])


@pytest.mark.parametrize(("most", "resolution"), [(0.3, 0.1), (0.7, 0.1), (156.96, 156.96 / 32768)])
def test_a_range_of_whole_counts_keeps_its_last_count_whatever_rounding_makes_of_the_quotient(most, resolution):
    (read,), _ = readings([1e6], range=most, resolution=resolution)
    assert read <= most
    assert read == pytest.approx(most, rel=1e-15)


def test_order_bias_noise_range_resolution():
    table = {"bias": 0.4, "noise_density": 0.1, "range": 2.0, "resolution": 0.25}
    accelerations = np.linspace(-3.0, 3.0, 601)
    noise = readings(np.zeros(601), noise_density=0.1)[0]
    read, clipped = readings(accelerations, seed=1, **table)
    full = accelerations + 0.4 + noise
    assert np.array_equal(read, 0.25 * np.rint(np.clip(full, -2.0, 2.0) / 0.25))
    assert clipped == (np.abs(full) > 2.0).sum()


@pytest.mark.parametrize("table", [{}, {"range": 1.0}, {"resolution": 0.1}, {"range": 1.0, "resolution": 0.1}])
def test_what_is_no_number_is_read_as_no_number(table):
    (read,), _ = readings([math.nan], **table)
    assert math.isnan(read)


def test_overflow_is_clipped_where_there_is_a_range_and_passed_on_where_there_is_none():
    assert readings([math.inf, -math.inf], range=2.0, resolution=0.5)[0].tolist() == [2.0, -2.0]
    assert readings([math.inf, 1e300], resolution=1e-9)[0].tolist() == [math.inf, 1e300]


FELT = PRESSED | {"acceleration": {"source": "accelerometer"}}


def test_an_accelerometer_without_faults_is_the_ideal_one():
    ideal, table = (run(scene(**FELT, **more)) for more in ({}, {"accelerometer": {"range": 1e9}}))
    assert table.summary["accelerometer"] == {"clipped_ticks": 0}
    assert np.array_equal(ideal.controller["a"], table.controller["a"])
    assert ideal.summary["trajectory_sha256"] == table.summary["trajectory_sha256"]


def test_a_run_reads_what_the_sensor_makes_of_the_true_acceleration():
    faults = {"range": 60.0, "resolution": 0.01, "noise_density": 0.05, "bias": 1.5}
    ideal, faulty = run(scene(**FELT)), run(scene(**FELT, accelerometer=faults))
    assert ideal.summary["trajectory_sha256"] == faulty.summary["trajectory_sha256"]  # nothing here acts on a
    read, clipped = readings(ideal.controller["a"], seed=5, **faults)
    assert np.array_equal(faulty.controller["a"], read)
    assert faulty.summary["accelerometer"] == {"clipped_ticks": clipped}
    assert clipped > 0


def test_an_accelerometer_no_estimate_reads_is_not_there():
    plain = {name: table for name, table in FELT.items() if name != "acceleration"}
    without, unread = (
        of_the_scene(run(scene(**plain, **more)).summary) for more in ({}, {"accelerometer": {"range": 1.0}})
    )
    assert without == unread


@pytest.mark.slow
def test_clipped_ticks_are_the_same_for_blocks_of_any_size_also_when_the_run_is_stopped_or_diverges():
    stopped = {"event": [{"at": 0.1003, "stop": True}]}
    diverging = {"hand": {"force": {"kind": "ramp", "value": -3.0, "rise_time": 0.2}}, "diverged_beyond": 0.01}
    for change, ended in (({}, "done"), (stopped, "stopped"), (diverging, "diverged")):
        limited = scene(**FELT | change, accelerometer={"range": 10.0})
        usual = in_blocks(limited, 100)
        assert usual["ended"] == ended
        assert usual["accelerometer"]["clipped_ticks"] > 0
        for block_ticks in (1, 7, 1000):
            assert in_blocks(limited, block_ticks) == usual
