"""When things happen: samples, commands, holds, estimates, contacts and events, to the step."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers.runs.captured import run
from helpers.scenes.least import scene

DELAYS = [0, 1, 3, 9, 10, 11, 13, 20, 25, 50]
PRESSED = {
    "duration": 0.1,
    "device": {"mass": 0.01, "damping": 0.1, "velocity": -0.1},
    "hand": {"mass": 0.01, "stiffness": 10.0, "force": {"kind": "constant", "value": -0.5}},
    "wall": {"position": -1e-4, "stiffness": 100.0},
    "dissipation": [{"kind": "damping", "damping": 0.1, "acts": "always"}],
}


@pytest.mark.parametrize("delay", DELAYS)
def test_command_k_acts_from_step_k_n_plus_d_until_the_next_and_nothing_acts_before_the_first(delay):
    ran = run(scene(**PRESSED, clock={"round_trip_delay": delay / 10_000}))
    force, command, total = ran.plant["force"][:-1], ran.plant["command"][:-1], ran.controller["total"]
    assert len(np.unique(total[1:])) == len(total) - 1  # every command is told from every other
    for step in range(len(force)):
        k = (step - delay) // 10
        assert command[step] == max(k, -1)
        assert force[step] == (total[k] if k >= 0 else 0.0)
    assert not force[:delay].any()


@pytest.mark.parametrize(("plant_rate", "control_rate"), [(1_000, 1_000), (2_000, 1_000), (8_000, 500)])
def test_the_same_holds_at_other_rates(plant_rate, control_rate):
    n, delay = plant_rate // control_rate, 7
    clock = {"plant_rate": plant_rate, "control_rate": control_rate, "round_trip_delay": delay / plant_rate}
    ran = run(scene(**PRESSED, clock=clock))
    expected = [max((step - delay) // n, -1) for step in range(len(ran.plant["command"]) - 1)]
    assert np.array_equal(ran.plant["command"][:-1], expected)
    assert np.array_equal(ran.controller["x"], ran.plant["x"][:-1:n])


def test_sample_k_is_the_position_at_step_k_n_and_estimates_are_backward_differences_that_start_at_0():
    ran = run(scene(**PRESSED))
    x, v, a = (ran.controller[name] for name in "xva")
    assert np.array_equal(x, ran.plant["x"][:-1:10])
    assert v[0] == a[0] == 0.0
    assert np.array_equal(v[1:], (x[1:] - x[:-1]) / 1e-3)
    assert np.array_equal(a[1:], (v[1:] - v[:-1]) / 1e-3)
    assert a[1] == v[1] / 1e-3  # the device moved from the start: its first velocity is a first acceleration


def test_a_low_pass_starts_at_its_first_input_and_the_acceleration_is_differenced_after_it():
    ran = run(scene(**PRESSED, velocity={"cutoff": 100.0}, acceleration={"cutoff": 50.0}))
    x, v, a = (ran.controller[name] for name in "xva")
    keep_v, keep_a = math.exp(-math.tau * 0.1), math.exp(-math.tau * 0.05)
    assert v[0] == a[0] == 0.0
    for k in range(1, len(x)):
        assert v[k] == pytest.approx(keep_v * v[k - 1] + (1 - keep_v) * (x[k] - x[k - 1]) / 1e-3, rel=1e-11)
        assert a[k] == pytest.approx(keep_a * a[k - 1] + (1 - keep_a) * (v[k] - v[k - 1]) / 1e-3, rel=1e-9, abs=1e-12)


def test_the_unidirectional_inertia_sees_no_acceleration_before_the_first_tick():
    """At tick 1 it is v[1] a[0] = 0, not below 0, that lets it act; at tick 0 all are 0."""
    element = {"kind": "unidirectional-inertia", "mass": 0.001, "acts": "always"}
    ran = run(scene(**PRESSED | {"dissipation": [element]}))
    v, a, force = ran.controller["v"], ran.controller["a"], ran.forces[0]
    before = np.concatenate([[0.0], a[:-1]])
    assert force[0] == 0.0
    assert force[1] == -0.001 * a[1] != 0.0
    assert np.array_equal(force, np.where(v * before >= 0, -0.001 * a, 0.0))


@pytest.mark.parametrize("delay", [0, 3, 25])
def test_the_accelerometer_reads_the_plant_at_the_tick_under_the_force_of_the_step_that_ends_there(delay):
    clock = {"round_trip_delay": delay / 10_000}
    ran = run(scene(**PRESSED, clock=clock, acceleration={"source": "accelerometer"}))
    x, v, a = ran.plant["x"][:-1:10], ran.plant["v"][:-1:10], ran.controller["a"]
    last_force = np.concatenate([[0.0], ran.plant["force"][9:-1:10][: len(x) - 1]])
    assert a == pytest.approx((last_force - 0.5 - 0.1 * v - 10.0 * x) / 0.02, rel=1e-12, abs=1e-12)
    assert a[0] == pytest.approx((-0.5 + 0.1 * 0.1) / 0.02, rel=1e-12)


SURFACE = 0.0625  # exact in binary, as are whole counts of the resolutions below


@pytest.mark.parametrize(("side", "occupies"), [(-1.0, "below"), (1.0, "above")])
def test_contact_is_strictly_inside_and_an_element_in_contact_acts_there_alone(side, occupies):
    """A device that rests on the surface, or that an encoder puts there, is not in contact."""

    def resting_at(x: float, **encoder):
        elements = [{"kind": "damping", "damping": 0.1, "acts": acts} for acts in ("in-contact", "always")]
        device = {"mass": 1e6, "damping": 0.0, "position": x, "velocity": side * 1e-9}
        wall = {"position": side * SURFACE, "stiffness": 100.0, "occupies": occupies}
        return run(scene(duration=0.005, device=device, wall=wall, dissipation=elements, **encoder))

    outside, inside = resting_at(side * 0.05), resting_at(side * (SURFACE + 0.01))
    assert not outside.controller["in_contact"].any()
    assert not outside.controller["wall"].any()
    assert inside.controller["in_contact"].all()
    assert inside.controller["wall"] == pytest.approx(-side * 1.0, rel=1e-9)
    for ran, touching in ((outside, False), (inside, True)):
        assert ran.forces[0][1:].any() == touching
        assert ran.forces[1][1:].all()
    for resolution in (2.0**-17, 2.0**-14):  # whole counts are the surface itself
        on_it = resting_at(side * (SURFACE + 0.3 * resolution), encoder={"resolution": resolution})
        assert not on_it.controller["in_contact"].any(), resolution
        one_in = resting_at(side * (SURFACE + 0.7 * resolution), encoder={"resolution": resolution})
        assert one_in.controller["in_contact"].all(), resolution


def equal_counts(resolution: float):
    """A heavy device that moves on by exactly three counts a tick, behind a unidirectional inertia."""
    device = {"mass": 1e6, "damping": 0.0, "position": 1e4 * resolution, "velocity": 3.0 * resolution / 1e-3}
    element = {"kind": "unidirectional-inertia", "mass": 0.01, "acts": "always"}
    tables = {"device": device, "dissipation": [element], "diverged_beyond": 1e6}
    ran = run(scene(duration=0.5, encoder={"resolution": resolution}, **tables))
    assert ran.controller["v"][1:] == pytest.approx(3.0 * resolution / 1e-3, rel=1e-10)
    return ran


@pytest.mark.parametrize("resolution", [2.0**-17, 3 * 2.0**-20])
def test_equal_steps_of_an_encoder_are_no_acceleration_where_its_resolution_is_exact_in_binary(resolution):
    ran = equal_counts(resolution)
    assert np.abs(ran.controller["a"][2:]).max() < 1e-10 * resolution / 1e-6


@pytest.mark.parametrize("resolution", [1e-5, 2.87e-5, 3e-7])
def test_a_decimal_resolution_leaves_rounding_in_the_second_difference_which_the_gate_can_see_but_no_force_can(
    resolution,
):
    """q rint(x/q) is rounded: equal counts differ in the last bits, and the sign of v a hangs on them. Known, kept."""
    ran = equal_counts(resolution)
    noise = ran.controller["a"][2:]
    assert noise.any()
    assert np.abs(noise).max() < 1e-9 * resolution / 1e-6
    gated = ran.forces[0][2:] == 0.0
    assert gated.any()
    assert not gated.all()


def test_a_step_of_the_hand_force_has_its_value_at_its_time_and_rises_over_the_plant_step_before():
    """Half a step of acceleration by then: v = F h / (2 m)."""
    push = {"kind": "step", "value": 0.4, "at": 0.0123}
    ran = run(scene(duration=0.02, device={"mass": 0.01, "damping": 0.0}, hand={"force": push}))
    v = ran.plant["v"]
    assert not v[:123].any()
    assert v[123] == pytest.approx(0.4 * 1e-4 / 0.02, rel=1e-12)
    assert v[124] - v[123] == pytest.approx(0.4 * 1e-4 / 0.01, rel=1e-12)
