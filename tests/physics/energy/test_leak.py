"""The leak of a virtual spring, which gives back more than it took: closed forms of the whole and of its parts."""

from __future__ import annotations

import numpy as np
import pytest

from helpers.runs.captured import run
from helpers.runs.given_motion import books_along
from helpers.scenes.least import scene

K, SPEED, PERIOD_S, STEPS = 200.0, 0.1, 1e-3, 10
WALL = {"position": 0.0, "stiffness": K}


def pressed_and_back(samples_deep: int, samples_beyond: int) -> np.ndarray:
    """Down into the wall at constant speed for so many samples, back, and on outside."""
    step = np.arange((2 * samples_deep + samples_beyond) * STEPS + 1)
    return SPEED * PERIOD_S / STEPS * (np.abs(step - samples_deep * STEPS) - samples_deep * STEPS)


def leak_along(x: np.ndarray, **tables):
    duration = (len(x) - 1) / 10_000
    return books_along(scene(duration=duration, wall=WALL, **tables), x)[1]["wall"]


@pytest.mark.parametrize("deep", [1, 7, 100])
def test_at_constant_speed_sampling_and_hold_leak_stiffness_times_depth_times_speed_times_period(deep):
    wall = leak_along(pressed_and_back(deep, 1))
    expected = -K * (deep * SPEED * PERIOD_S) * SPEED * PERIOD_S
    assert wall["true_J"] == pytest.approx(expected, rel=1e-12)
    assert wall["leak"]["total_J"] == pytest.approx(expected, rel=1e-12)
    assert wall["leak"]["sampling_and_hold_J"] == pytest.approx(expected, rel=1e-12)
    assert wall["leak"]["delay_J"] == wall["leak"]["quantisation_J"] == 0.0


@pytest.mark.parametrize("late", [1, 2, 5])
def test_at_constant_speed_a_delay_of_whole_samples_adds_its_closed_form(late):
    """With N samples down and D of delay: K (v T)^2 (2 N D - D^2 - D) more, by summing the held forces."""
    deep = 40
    x = pressed_and_back(deep, late + 1)
    wall = leak_along(x, clock={"round_trip_delay": late * PERIOD_S})
    quantum = K * (SPEED * PERIOD_S) ** 2
    assert wall["leak"]["sampling_and_hold_J"] == pytest.approx(-quantum * deep, rel=1e-12)
    assert wall["leak"]["delay_J"] == pytest.approx(-quantum * (2 * deep * late - late**2 - late), rel=1e-12)
    assert wall["leak"]["total_J"] == pytest.approx(wall["true_J"], abs=1e-18)


def test_the_sampled_book_sees_neither_the_hold_nor_the_delay():
    """From samples alone the same press seems to leak the same, whatever the delay."""
    books = [leak_along(pressed_and_back(40, 6), clock={"round_trip_delay": d * PERIOD_S}) for d in (0, 1, 5)]
    assert books[0]["sampled_J"] == books[1]["sampled_J"] == books[2]["sampled_J"]
    assert books[2]["true_J"] < 5 * books[0]["true_J"] < 0


def coasting(position: float, velocity: float):
    """A device so heavy that no wall slows it, for 0.1 s."""
    device = {"mass": 1e6, "damping": 0.0, "position": position, "velocity": velocity}
    return run(scene(duration=0.1, device=device, wall=WALL))


def test_a_heavy_device_coasting_in_and_out_leaks_the_closed_form():
    """The press of the first test as two runs of the whole loop."""
    depth = SPEED * 0.1
    walls = [coasting(0.0, -SPEED).energy["wall"], coasting(-depth, SPEED).energy["wall"]]
    leak = sum(wall["leak"]["total_J"] for wall in walls)
    assert leak == pytest.approx(-K * depth * SPEED * PERIOD_S, rel=1e-6)
    assert sum(wall["ideal_J"] for wall in walls) == pytest.approx(0.0, abs=1e-6 * K * depth**2)


def smooth_press(control_rate: int, delay: float = 0.0) -> tuple[dict, float]:
    """A press along (1 - cos) / 2, 5 mm deep, and the leak that T/2 + delay gives it to first order."""
    rate, depth, duration = 40_000, 0.005, 0.2
    t = np.arange(round(duration * rate) + 1) / rate
    x = -depth * (1 - np.cos(2 * np.pi * t / duration)) / 2
    clock = {"plant_rate": rate, "control_rate": control_rate, "round_trip_delay": delay}
    wall = books_along(scene(duration=duration, wall=WALL, clock=clock), x)[1]["wall"]
    square_J = K * (np.pi * depth / duration) ** 2 * duration / 2
    return wall["leak"], -(0.5 / control_rate + delay) * square_J


def test_the_leak_vanishes_linearly_with_the_period():
    """It is K T/2 times the integral of v^2, to first order in T: fine sampling makes a spring of the wall."""
    errors = []
    for control_rate in (1_000, 2_000, 10_000, 40_000):
        leak, first_order = smooth_press(control_rate)
        errors.append(abs(leak["total_J"] / first_order - 1.0))
        assert errors[-1] < 5e-3
    assert errors[-1] < 1e-4


@pytest.mark.parametrize("delay", [2.5e-5, 1e-3, 2e-3])
def test_a_delay_leaks_like_a_period_twice_as_long(delay):
    leak, first_order = smooth_press(10_000, delay)
    assert leak["total_J"] == pytest.approx(first_order, rel=4 * np.pi * delay / 0.2)


def tap(**tables):
    """A hand taps a wall, with tables on top."""
    push = {"kind": "sine", "offset": -5.0, "amplitude": 5.0, "frequency": 5.0, "phase": np.pi / 2}
    hand = {"mass": 0.01, "damping": 10.0, "stiffness": 1000.0, "force": push}
    wall = {"position": -0.00501, "stiffness": 100.0}
    return run(scene(duration=0.2, hand=hand, wall=wall, **tables)).energy["wall"]


def test_every_part_of_the_leak_comes_from_its_cause_and_the_parts_add_up():
    plain = tap()["leak"]
    coarse = tap(encoder={"resolution": 1e-4, "rounding": "floor"})["leak"]
    late = tap(clock={"round_trip_delay": 0.0013})["leak"]
    everything = tap(encoder={"resolution": 1e-4}, clock={"round_trip_delay": 0.0013})["leak"]
    assert plain["quantisation_J"] == plain["delay_J"] == coarse["delay_J"] == late["quantisation_J"] == 0.0
    assert abs(coarse["quantisation_J"]) > 1e-7
    assert late["delay_J"] < -1e-5
    for leak in (plain, coarse, late, everything):
        parts = [value for name, value in leak.items() if name != "total_J"]
        assert sum(parts) == pytest.approx(leak["total_J"], rel=1e-13)
        assert leak["sampling_and_hold_J"] < 0


def test_a_wall_made_stiffer_in_contact_is_no_leak_and_nothing_is_held_once_the_device_has_left():
    """leak = true - (ideal - changes); outside the wall an ideal spring holds nothing, however it came there."""
    push = {"kind": "trace", "time": [0.0, 0.5, 0.6, 0.8], "force": [-1.0, -1.0, -1.0, 1.0]}
    hand = {"mass": 0.01, "damping": 10.0, "stiffness": 1.0, "force": push}
    change = {"at": 0.4, "set": {"wall.stiffness": 200.0}}
    ran = run(scene(duration=1.2, hand=hand, wall={"position": 0.0, "stiffness": 100.0}, event=[change]))
    wall = ran.energy["wall"]
    assert ran.controller["in_contact"][400]
    assert not ran.controller["in_contact"][-1]
    assert wall["changes_J"] == pytest.approx(50.0 * ran.plant["x"][4000] ** 2, rel=1e-12)
    assert wall["ideal_J"] == pytest.approx(0.0, abs=1e-12 * ran.energy["moved_J"])
    assert wall["leak"]["total_J"] == pytest.approx(wall["true_J"] - wall["ideal_J"] + wall["changes_J"], rel=1e-9)
    assert abs(wall["leak"]["total_J"]) < 0.1 * wall["changes_J"]
