"""The verdict of a run, from signals whose verdict is plain."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from haploop.logger.verdict.measures import swings
from haploop.logger.verdict.ripple import above, ripple
from haploop.logger.verdict.window import Window
from haploop.protocol.ticks import Timebase

RATE, N = 10_000, 10
WALL = -0.06


def judged(x_of_t, seconds: float = 1.0, resolution: float = 0.0, pieces: int = 7, diverged: str | None = None):
    """Verdict and figures of a device that moved as ``x_of_t`` says; the wall below ``WALL``, force 100 N/m deep."""
    ticks = round(seconds * RATE / N)
    window = Window(Timebase(RATE, RATE // N, 0, ticks), resolution)
    bounds = [ticks * i // pieces for i in range(pieces + 1)]
    for first, last in pairwise(bounds):
        x = x_of_t(np.arange(first * N, last * N + 1) / RATE)
        at_ticks = x[:-1:N]
        depth = np.maximum(0.0, WALL - at_ticks)
        rows = {"x": at_ticks, "total": 100.0 * depth, "in_contact": (depth > 0).astype(float)}
        rows |= {"wall_position": np.full(len(at_ticks), WALL)}
        window.add(x[:, None], 100.0 * depth[:, None], {name: column[:, None] for name, column in rows.items()})
    (measures,) = window.measures()
    return measures.verdict(diverged).word, measures.window.figures, measures.extremes


def test_a_device_at_rest_in_the_wall_is_steady_and_shows_the_stiffness_of_the_wall():
    word, figures, extremes = judged(lambda t: np.full_like(t, -0.061))
    assert word == "no-swing-seen"
    assert figures.oscillation_m == 0.0
    assert figures.outside_fraction == 0.0
    assert figures.displayed_stiffness_N_m == pytest.approx(100.0)
    assert (extremes.x_min_m, extremes.x_max_m) == (-0.061, -0.061)
    assert extremes.force_max_N == pytest.approx(0.1)


@pytest.mark.parametrize("hz", [5.0, 60.0, 300.0])
def test_a_swing_that_goes_on_is_a_limit_cycle_and_its_width_is_the_oscillation(hz):
    word, figures, _ = judged(lambda t: -0.061 + 1e-3 * np.sin(2 * math.pi * hz * t))
    assert word == "swinging"
    assert figures.oscillation_m == pytest.approx(2e-3, rel=1e-3)
    assert figures.force_ripple_N == pytest.approx(0.2 if hz > 30.0 else 0.0, rel=0.05, abs=4e-3)


@pytest.mark.parametrize("hz", [29.7, 30.0, 30.3, 31.0])
def test_no_ripple_is_larger_than_what_the_force_itself_swings_by(hz):
    """Pulses of a wall, bounced off at the edge of the filter: what it lets pass is wider than the pulses."""
    force = np.maximum(0.0, np.sin(2 * math.pi * hz * np.arange(500) / 1000.0) - 0.5)
    wider = np.ptp(above(force, 1000.0)) > np.ptp(force)
    assert ripple(force, 1000.0) <= np.ptp(force)
    assert wider or hz != 30.0, "the filter alone would tell more"
    figures = judged(lambda t: WALL - 1e-3 * np.maximum(0.0, np.sin(2 * math.pi * hz * t) - 0.5))[1]
    assert figures.force_swing_N == pytest.approx(0.05, rel=0.01)
    assert figures.force_ripple_N <= figures.force_swing_N


def test_a_swing_that_dies_away_is_steady():
    assert judged(lambda t: -0.061 + 1e-3 * np.exp(-8 * t) * np.sin(2 * math.pi * 60 * t))[0] == "no-swing-seen"


def test_a_slow_way_into_the_wall_is_no_limit_cycle_however_long_it_is():
    word, figures, _ = judged(lambda t: -0.0601 - 5e-3 * t)
    assert word == "no-swing-seen"
    assert figures.force_ripple_N < 1e-12
    assert judged(lambda t: -0.0601 - 5e-3 * t + 1e-4 * np.sin(400 * t))[0] == "swinging"


def test_swings_within_one_encoder_step_either_way_do_not_count():
    def chatter(t):
        return -0.061 + 0.9e-5 * np.sign(np.sin(500 * t))

    assert judged(chatter, resolution=1e-5)[0] == "no-swing-seen"
    assert judged(chatter, resolution=0.5e-5)[0] == "swinging"


def test_a_device_that_has_left_for_good_is_not_called_steady():
    word, figures, _ = judged(lambda t: -0.061 + 0.1 * np.maximum(0, t - 0.3))
    assert word == "no-contact"
    assert figures.outside_fraction == 1.0
    assert figures.displayed_stiffness_N_m is None


def test_a_plant_that_ended_by_itself_has_diverged_whatever_the_window_shows():
    assert judged(lambda t: np.full_like(t, -0.061), diverged="it was at 2 m, at tick 7")[0] == "diverged"


@pytest.mark.parametrize(("seconds", "start"), [(2.0, 1.5), (0.5, 0.0), (0.6, 0.1), (0.4, 0.2), (0.001, 0.0005)])
def test_the_window_is_the_last_half_second_or_the_second_half_of_a_shorter_run(seconds, start):
    _, figures, _ = judged(lambda t: -0.061 + 1e-3 * t, seconds, pieces=1 if seconds < 0.01 else 7)
    assert figures.from_s == pytest.approx(start)
    assert figures.oscillation_m == pytest.approx(1e-3 * (seconds - start), rel=1e-6)


@pytest.mark.parametrize("rate", [-3.0, 0.0, 2.0])
def test_the_rate_at_which_swings_grow_is_that_of_their_envelope(rate):
    """Within 0.1 / s: the halves of the window hold no whole number of swings."""
    figures = judged(lambda t: -0.061 + 1e-3 * np.exp(rate * (t - 1.0)) * np.sin(2000 * t), 1.0)[1]
    assert figures.growth_1_s == pytest.approx(rate, abs=0.1)
    assert judged(lambda t: -0.061 + 1e-3 * t, 1.0)[1].growth_1_s is None


@pytest.mark.parametrize(("hertz", "within"), [(8.3, 0.1), (30.4, 0.01), (194.4, 0.01), (700.0, 1.0)])
def test_the_frequency_of_the_window_is_that_of_its_swings_and_a_slow_motion_has_none(hertz, within):
    """Between the ticks, which show 700 Hz as 300 Hz, the swing is counted."""

    def moving(t):
        return -0.061 + 1e-3 * np.sin(2.0 * np.pi * hertz * t) + 2e-3 * t

    assert judged(moving, 1.3)[1].frequency_Hz == pytest.approx(hertz, abs=within)
    assert judged(lambda t: -0.061 + 1e-3 * np.sin(3.0 * t), 1.3)[1].frequency_Hz is None


def test_the_frequency_of_a_swing_that_crosses_its_middle_four_times_a_period_is_that_of_its_period():
    """A swing of 2.34 mm at 9.4 Hz that bounced on its wall was said to be at about 20 Hz."""

    def bouncing(t):
        return -0.061 + 1e-3 * (np.sin(2.0 * np.pi * 20.3 * t) + 0.9 * np.sin(4.0 * np.pi * 20.3 * t))

    assert judged(bouncing)[1].frequency_Hz == pytest.approx(20.3, abs=0.1)


def test_of_a_swing_without_a_main_line_the_frequency_is_half_its_crossings_a_second():
    lines = np.random.default_rng(3).uniform(20.0, 400.0, 40)

    def moving(t):
        return -0.061 + 1e-4 * np.sin(2.0 * np.pi * lines[:, None] * t).sum(axis=0)

    hertz = judged(moving)[1].frequency_Hz
    assert hertz is not None
    assert 2.0 * hertz * 0.5001 == pytest.approx(round(2.0 * hertz * 0.5001))
    assert 100.0 < hertz < 300.0


@pytest.mark.parametrize("pieces", [1, 3, 100])
def test_how_the_run_is_cut_changes_nothing(pieces):
    def moving(t):
        return -0.0605 + 1e-3 * np.sin(300 * t + t * t)

    assert judged(moving, 1.3, pieces=pieces)[1] == judged(moving, 1.3, pieces=13)[1]


def test_a_position_on_the_face_but_for_rounding_counts_for_no_stiffness():
    """1e-5 * -6000 is -0.060000000000000005: force over that penetration would be anything."""
    window = Window(Timebase(RATE, RATE // N, 0, 600), 1e-5)
    x = np.full(6001, 1e-5 * -6000)
    rows = {"x": x[:-1:N], "total": np.full(600, 0.3), "in_contact": np.ones(600), "wall_position": np.full(600, WALL)}
    window.add(x[:, None], np.zeros((6000, 1)), {name: column[:, None] for name, column in rows.items()})
    (measures,) = window.measures()
    assert measures.window.figures.displayed_stiffness_N_m is None


def test_crossings_are_counted_from_beyond_one_side_to_beyond_the_other():
    x = np.array([0.0, 2.0, 0.5, 2.0, -2.0, 0.5, -2.0, 2.0, -2.0, 0.0])
    assert swings(x[None], np.ones(1))[0] == [3]
    assert swings(np.zeros((1, 3)), np.ones(1)) == ([0], [0.0])
