"""A buzz is told from a hand that sways over a coarse encoder, by turns, and felt by motion and by force."""

import numpy as np
import pytest

from haploop.tools.advise.walls.felt import TURNS, buzz, felt_force_N, felt_m, ripple
from helpers.scenes.least import scene

RATE, T = 1000.0, np.arange(250) / 1000.0
FREE = scene(device={"mass": 0.05, "damping": 0.0}, wall={"position": 0.0, "stiffness": 1.0})
FELT_N = felt_force_N(FREE)


def seen(x, q=0.0, stiffness=3000.0):
    x = np.reshape(x, (len(T), -1))
    measured = q * np.rint(x / q) if q else x
    return buzz(x, measured, -stiffness * measured, RATE, FELT_N)


def test_a_staircase_under_a_swaying_hand_is_no_buzz_though_its_force_steps():
    x, q = -3e-4 - 1e-4 * np.sin(np.pi * T[:, None]), 28.7e-6
    sway = seen(x, q)
    assert ripple(-3000.0 * q * np.rint(x / q), RATE)[0][0] > 0.08
    assert sway.turns[0] < TURNS
    assert sway.times_felt[0] == 0.0


def test_chatter_between_two_counts_is_a_buzz_by_its_force_where_no_motion_is_felt():
    q = 28.7e-6
    x = -10.5 * q + 0.01e-6 * np.sin(2 * np.pi * 100.0 * T)  # 0.02 um wide, about the border of two counts
    chatter = seen(x, q=q)
    assert chatter.motion_m[0] < felt_m(np.array([100.0]))[0]
    assert chatter.force_N[0] > 0.9 * 3000.0 * q
    assert chatter.by_force[0]
    assert chatter.times_felt[0] > 1.0


@pytest.mark.parametrize("frequency", [20.0, 100.0, 320.0])
@pytest.mark.parametrize(("share", "is_felt"), [(0.9, False), (1.1, True)])
def test_a_sine_is_felt_from_the_width_of_israr_choi_and_tan_on(frequency, share, is_felt):
    t = np.arange(1000) / 1000.0
    x = (share * felt_m(np.array([frequency]))[0] / 2.0 * np.sin(2 * np.pi * frequency * t + 0.3))[:, None]
    found = buzz(x, x, 0.0 * x, RATE, FELT_N)
    assert (found.times_felt[0] >= 1.0) == is_felt
    assert found.frequency_Hz[0] == pytest.approx(frequency, abs=1.0)


def test_the_threshold_at_the_points_of_the_source_is_theirs():
    assert felt_m(np.array([10.0, 20.0, 320.0])) == pytest.approx([52e-6, 17e-6, 0.12e-6])


def test_the_threshold_of_the_force_moves_a_free_mass_by_what_is_felt():
    frequencies = np.array([30.0, 100.0, 300.0])
    assert FELT_N(frequencies) == pytest.approx(0.05 * (2 * np.pi * frequencies) ** 2 * felt_m(frequencies), rel=1e-9)


def test_three_micrometres_at_120_hz_are_felt_six_times_over_although_a_count_is_ten():
    found = seen(1.5e-6 * np.sin(2 * np.pi * 120.0 * T), stiffness=0.0)
    assert 3.0 < found.times_felt[0] < 12.0
    assert not found.by_force[0]


def test_a_swing_has_a_line_and_spikes_a_frequency_apart_from_nothing_have_none():
    assert seen(1e-4 * np.sin(2 * np.pi * 37.0 * T)).is_line[0]
    assert seen(-10.4 * 30e-6 + 20e-6 * np.sign(np.sin(2 * np.pi * 26.0 * T)), q=30e-6).is_line[0]
    x = np.full(len(T), -1e-4)
    x[[40, 41, 90, 93, 130, 200, 202]] += 25e-6
    spikes = seen(x, q=25e-6)
    assert spikes.turns[0] >= TURNS
    assert spikes.times_felt[0] >= 1.0
    assert not spikes.is_line[0]


def test_what_is_felt_by_force_and_by_motion_is_told_as_both():
    wide = seen(1e-3 * np.sin(2 * np.pi * 37.0 * T))
    assert wide.times_felt[0] >= wide.other_felt[0] >= 1.0
    fine = seen(-10.5 * 28.7e-6 + 0.01e-6 * np.sin(2 * np.pi * 100.0 * T), q=28.7e-6)
    assert fine.times_felt[0] >= 1.0 > fine.other_felt[0]
