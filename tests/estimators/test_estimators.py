"""Velocity and acceleration estimates: delay, noise gain and start of each, held against closed forms."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.launch.runs.start import prepare, run
from haploop.protocol.scene.scene import accelerometer_is_used
from helpers.runs.estimates import COUNT, ENCODER, EVERYTHING, FUSED, KALMAN, SIGMA, T, estimates, floats
from helpers.scenes.least import typed

SCENE = Path(__file__).parents[2] / "launch/scenes/fig6c.toml"


def low_pass_gain(cutoff: float) -> float:
    return 1.0 - np.exp(-2.0 * np.pi * cutoff * T)


DELAYS = [
    ({}, 0.5),
    ({"estimator": "window", "ticks": 8}, 4.0),
    ({"estimator": "foaw", "ticks": 12, "bound": EVERYTHING}, 6.0),
    ({"estimator": "foaw", "ticks": 12, "bound": EVERYTHING, "fit": "best"}, 6.0),
]


@pytest.mark.parametrize(("table", "ticks"), DELAYS)
@pytest.mark.parametrize("cutoff", [None, 60.0])
def test_a_growing_velocity_is_seen_as_late_as_the_docstrings_say(table, ticks, cutoff):
    """On x = t^2 / 2 the velocity t is late by d: v[k] = t - d; a low-pass adds T / gain - T."""
    t = np.arange(600) * T
    late = ticks + (1.0 / low_pass_gain(cutoff) - 1.0 if cutoff else 0.0)
    v, a = estimates(floats(t * t / 2), velocity=table | ({"cutoff": cutoff} if cutoff else {}))
    assert t[-1] - v[-1] == pytest.approx(late * T, rel=1e-6)
    assert a[-1] == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize(("table", "ticks"), DELAYS)
def test_a_growing_acceleration_is_late_by_the_delays_of_both_estimates(table, ticks):
    t = np.arange(400) * T
    _, a = estimates(floats(t**3 / 6), velocity={"estimator": "window", "ticks": 5}, acceleration=table)
    assert t[-1] - a[-1] == pytest.approx((2.5 + ticks) * T, rel=1e-5)


@pytest.mark.parametrize(
    ("table", "gain"),
    [
        ({}, np.sqrt(2)),
        ({"estimator": "window", "ticks": 8}, np.sqrt(2) / 8),
        ({"estimator": "foaw", "ticks": 12, "bound": EVERYTHING}, np.sqrt(2) / 12),
        ({"estimator": "foaw", "ticks": 12, "bound": EVERYTHING, "fit": "best"}, np.sqrt(12 / (12 * 13 * 14))),
    ],
)
def test_white_noise_becomes_as_much_noise_of_the_velocity_as_the_docstrings_say(table, gain):
    """40000 loops at once; five standard errors of a standard deviation."""
    loops = 40_000
    noise = np.random.default_rng(1).normal(0.0, SIGMA, (14, loops))
    v, _ = estimates(list(noise), velocity=table)
    assert v[-1].std() == pytest.approx(gain * SIGMA / T, rel=5 / np.sqrt(2 * loops))


def test_a_low_pass_lets_through_the_noise_its_docstring_says():
    """The differences of white noise alternate, so the low-pass is measured on an accelerometer's white readings."""
    loops, cutoff = 40_000, 60.0
    noise = np.random.default_rng(2).normal(0.0, 1.0, (60, loops))
    table = {"source": "accelerometer", "cutoff": cutoff}
    _, a = estimates([*np.zeros_like(noise)], [*noise], acceleration=table)
    gain = low_pass_gain(cutoff)
    assert a[-1].std() == pytest.approx(np.sqrt(gain / (2 - gain)), rel=5 / np.sqrt(2 * loops))


_COUNTS = st.lists(st.integers(-3, 3), min_size=2, max_size=40).map(np.cumsum)


@given(_COUNTS)
def test_a_window_of_one_tick_is_the_difference_to_the_bit(counts):
    x = [COUNT * count for count in floats(counts)]
    window = {"estimator": "window", "ticks": 1}
    plain, windowed = estimates(x), estimates(x, velocity=window, acceleration=window)
    assert np.array_equal(plain, windowed)


def test_a_window_reaches_back_as_far_as_there_is_at_first():
    x = [0.0, 1.0, 4.0, 9.0, 16.0, 25.0]
    v, _ = estimates(x, velocity={"estimator": "window", "ticks": 3})
    assert v == pytest.approx([0.0, 1 / T, 4 / (2 * T), 9 / (3 * T), 15 / (3 * T), 21 / (3 * T)])


EVERY: dict[str, dict[str, Any]] = {
    "difference": {},
    "low-passed": {"velocity": {"cutoff": 80.0}, "acceleration": {"source": "encoder", "cutoff": 50.0}},
    "accelerometer": {"acceleration": {"source": "accelerometer", "cutoff": 50.0}},
    "window": {
        "velocity": {"estimator": "window", "ticks": 4, "cutoff": 200.0},
        "acceleration": {"source": "encoder", "estimator": "window", "ticks": 3},
    },
    "foaw": {
        "velocity": {"estimator": "foaw", "ticks": 9},
        "acceleration": {"source": "encoder", "estimator": "foaw", "ticks": 6, "bound": 2e-3, "fit": "best"},
    },
    "kalman": {"velocity": KALMAN | {"cutoff": 300.0}, "acceleration": {"source": "kalman"}},
    "fused": {"velocity": FUSED, "acceleration": {"source": "kalman", "cutoff": 100.0}},
}


@pytest.mark.parametrize("tables", EVERY.values(), ids=EVERY)
def test_many_loops_in_arrays_give_the_bits_of_each_loop_alone(tables):
    rng = np.random.default_rng(9)
    x = COUNT * np.cumsum(rng.integers(-2, 4, (80, 7)), axis=0)
    readings = rng.normal(0, 3.0, x.shape) if accelerometer_is_used(typed(**tables)) else np.zeros((0, 7))
    together = estimates([*x], [*readings], encoder=ENCODER, **tables)
    for loop in range(x.shape[1]):
        alone = estimates(floats(x[:, loop]), floats(readings[:, loop]), encoder=ENCODER, **tables)
        for many, one in zip(together, alone, strict=True):
            assert many[:, loop].tobytes() == one.tobytes()


@pytest.mark.parametrize("tables", EVERY.values(), ids=EVERY)
def test_both_estimates_are_0_at_the_first_tick_and_an_accelerometers_its_reading(tables):
    readings = [2.5, 1.0] if accelerometer_is_used(typed(**tables)) else []
    v, a = estimates([-0.06, -0.0598], readings, encoder=ENCODER, **tables)
    assert (v[0], a[0]) == (0.0, readings[0] if readings else 0.0)
    assert v[1] != 0.0


def test_only_an_estimate_that_reads_the_accelerometer_has_it_sampled():
    using = [name for name, tables in EVERY.items() if accelerometer_is_used(typed(**tables))]
    assert using == ["accelerometer", "fused"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "sets",
    [
        ["velocity.estimator=window", "velocity.ticks=3", "acceleration.estimator=window", "acceleration.ticks=2"],
        ["velocity.estimator=foaw", "velocity.ticks=8", "velocity.cutoff=200"],
        ["velocity.estimator=kalman", "velocity.jerk_density=50", "acceleration.source=kalman"],
        ["velocity.estimator=kalman", "velocity.jerk_density=50", "velocity.accelerometer=true"],
    ],
    ids=["window", "foaw", "kalman", "fused"],
)
def test_a_scene_with_each_estimator_gives_the_same_bits_as_processes_and_in_one(sets, tmp_path):
    of_time = ["duration=0.6", "wall.position=-0.01"]
    plain = run(prepare(SCENE, of_time, out=tmp_path / "plain"), in_process=True)
    summaries = [
        run(prepare(SCENE, [*of_time, *sets], out=tmp_path / way), in_process=way == "one") for way in ("one", "many")
    ]
    one, many = (summary["trajectory_sha256"] for summary in summaries)
    assert one == many != plain["trajectory_sha256"]


def test_a_scene_that_names_no_estimator_loads_none():
    code = """if True:
        import sys
        from haploop.controller.controller import Controller
        from haploop.protocol.ticks import Timebase
        from haploop.protocol.scene.scene import Scene
        tables = {"velocity": {"cutoff": 50.0}, "acceleration": {"source": "accelerometer"}}
        device = {"mass": 0.01, "damping": 0.1}
        scene = Scene.from_dict({"title": "", "duration": 0.01, "device": device, **tables})
        Controller(scene, Timebase(10_000, 1_000, 0, 10), {}).answer([(0.0, 0.0)])
        print([name for name in sys.modules if name.split(".")[-1] in ("windows", "kalman", "scipy")])
    """
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout == "[]\n"
