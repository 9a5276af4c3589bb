"""Band-limited noise on the measured position: its statistics, and where it goes in."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy

from haploop.launch.runs.replay import replay
from haploop.launch.runs.start import prepare
from haploop.launch.runs.start import run as run_prepared
from haploop.plant.sensing.noise import NoisyPositionSensor
from haploop.protocol.scene import effects
from helpers.runs.captured import in_blocks, of_the_scene, run
from helpers.scenes.least import PRESSED, scene

PERIOD_S = 1e-3
MANY = 200_000
# Five standard errors: a right program meets another 999 999 of a million seeds as well.
ERRORS = 5.0


def noise(cutoff: float, deviation: float = 1.0, seed: int = 1, count: int = MANY) -> np.ndarray:
    sensor = NoisyPositionSensor(None, effects.Noise(deviation=deviation, cutoff=cutoff), seed, PERIOD_S)
    return np.array([sensor.reading(0.0) for _ in range(count)])


@pytest.mark.parametrize("cutoff", [0.5, 10.0, 100.0, 450.0, 1e4])
def test_the_deviation_is_the_one_asked_for_whatever_the_cutoff(cutoff):
    """The mean square of a first-order process has the variance 2 sigma^4 / N (1 + rho^2) / (1 - rho^2)."""
    n, rho = noise(cutoff, deviation=3e-6), math.exp(-math.tau * cutoff * PERIOD_S)
    error = math.sqrt(2.0 / MANY * (1.0 + rho**2) / (1.0 - rho**2))
    assert abs(np.mean(n**2) / 9e-12 - 1.0) < ERRORS * error


@pytest.mark.parametrize("cutoff", [1.0, 10.0, 100.0, 300.0])
def test_the_autocorrelation_is_rho_to_the_distance(cutoff):
    """Within five of Bartlett's standard errors of a first-order process (Bartlett 1946)."""
    n, rho = noise(cutoff), math.exp(-math.tau * cutoff * PERIOD_S)
    for j in (1, 2, 3, 5, 10, 30):
        found = np.mean(n[j:] * n[:-j]) / np.mean(n**2)
        spread = (1 + rho**2) * (1 - rho ** (2 * j)) / (1 - rho**2) - 2 * j * rho ** (2 * j)
        assert abs(found - rho**j) < ERRORS * math.sqrt(spread / MANY), j


@pytest.mark.parametrize("cutoff", [1.0, 100.0])
def test_what_is_new_at_each_tick_is_white_and_normal(cutoff):
    n, rho = noise(cutoff), math.exp(-math.tau * cutoff * PERIOD_S)
    new = (n[1:] - rho * n[:-1]) / math.sqrt(1.0 - rho**2)
    assert scipy.stats.kstest(new, scipy.stats.norm.cdf).pvalue > 1e-6
    assert abs(np.mean(new[1:] * new[:-1])) < ERRORS / math.sqrt(MANY)


def test_the_spectrum_falls_to_half_at_the_cutoff():
    """Against 2 / (pi cutoff) / (1 + (f / cutoff)^2) per Hz, one-sided, far below half the tick rate."""
    cutoff, segment = 20.0, 2000
    frequency, power = scipy.signal.welch(noise(cutoff), 1.0 / PERIOD_S, nperseg=segment)
    averages = 2 * MANY / segment * 0.9  # of half-overlapping segments under Hann's window
    for f in (1.0, 5.0, 20.0, 40.0):
        expected = 2.0 / (math.pi * cutoff) / (1.0 + (f / cutoff) ** 2)
        near = np.abs(frequency - f) < 0.25
        assert power[near] == pytest.approx(expected, rel=ERRORS / math.sqrt(averages))


def test_it_is_stationary_from_tick_0_on():
    """Over many seeds, tick by tick; a noise that started from 0 would have but 1 - rho^(2 k) of it at tick k."""
    seeds = 2000
    n = np.array([noise(1.0, seed=seed, count=4) for seed in range(seeds)])
    assert np.abs(np.mean(n**2, axis=0) - 1.0).max() < ERRORS * math.sqrt(2.0 / seeds)
    assert np.mean((n[:, 3] - n[:, 2]) ** 2) < 0.02


NOISE = {"deviation": 2e-5, "cutoff": 200.0}


@pytest.mark.parametrize("rounding", ["nearest", "floor"])
def test_it_is_added_before_the_encoder_rounds(rounding):
    resolution = 1e-5
    ran = run(scene(**PRESSED, noise=NOISE, encoder={"resolution": resolution, "rounding": rounding}))
    x, seen = ran.plant["x"][:-1:10], ran.controller["x"]
    sensor = NoisyPositionSensor(None, effects.Noise(**NOISE), 5, PERIOD_S)
    whole = np.rint if rounding == "nearest" else np.floor
    assert np.array_equal(seen, [resolution * whole(sensor.reading(at) / resolution) for at in x])
    assert np.std(seen - x) > 1.5e-5


def test_noise_of_no_deviation_is_no_noise():
    without = of_the_scene(run(scene(**PRESSED, encoder={"resolution": 1e-5})).summary)
    neutral = scene(**PRESSED, encoder={"resolution": 1e-5}, noise={"deviation": 0.0, "cutoff": 50.0})
    assert of_the_scene(run(neutral).summary) == without


def test_another_seed_is_another_run_and_the_same_seed_the_same():
    hashes = [run(scene(**PRESSED | {"seed": seed}, noise=NOISE)).summary["trajectory_sha256"] for seed in (1, 2, 1)]
    assert hashes[0] == hashes[2] != hashes[1]


NOISY = """
title = "everything the sensors, the line and the actuator do at once"
duration = 0.6
seed = 7
[clock]
round_trip_delay = "1.3 ms"
[device]
mass = 0.01
damping = 0.1
velocity = -0.1
[hand]
mass = 0.01
stiffness = 10.0
force = { kind = "constant", value = -0.5 }
[wall]
position = -0.002
stiffness = 150.0
[encoder]
resolution = 1e-5
[noise]
deviation = "20 um"
cutoff = 200.0
[acceleration]
source = "accelerometer"
[accelerometer]
range = 15.0
resolution = 0.01
noise_density = 0.05
bias = 0.3
[actuator]
saturation = 0.6
resolution = 0.001
[jitter]
kind = "uniform"
most = "3 ms"
[loss]
probability = 0.1
[[dissipation]]
kind = "unidirectional-inertia"
mass = 0.005
acts = "always"
"""


@pytest.mark.slow
def test_blocks_processes_and_a_replay_give_the_same_bits_and_counts(tmp_path):
    file = tmp_path / "noisy.toml"
    file.write_text(NOISY, encoding="utf-8")
    alone = prepare(file, ["run.verdict=window"], out=tmp_path / "one")
    usual = of_the_scene(run_prepared(alone, in_process=True))
    assert usual["actuator"]["saturated_commands"] > 0
    assert usual["accelerometer"]["clipped_ticks"] > 0
    assert usual["lost"]["commands_dropped"] > 0
    assert usual["lost"]["commands_lost"] > 0
    assert usual["energy"]["residual_J"] < 1e-12 * usual["energy"]["moved_J"]
    for block_ticks in (1, 7, 1000):
        assert in_blocks(alone.scene, block_ticks) == usual
    cut = ["run.verdict=window", "run.block_ticks=7", "run.window_blocks=1"]
    assert of_the_scene(run_prepared(prepare(file, cut, out=tmp_path / "many"), in_process=False)) == usual
    assert replay(tmp_path / "many").differences == []
