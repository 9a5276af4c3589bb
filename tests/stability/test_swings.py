"""Swings, measured and put into words: how wide, how fast they grow, which of them a hand feels."""

from __future__ import annotations

import numpy as np
import pytest

from haploop.launch.stability.decide import decide
from haploop.launch.stability.swing import Pushed, Swing, measure
from haploop.launch.stability.traces import (
    frequency_Hz,
    is_felt,
    level_widths,
    most_felt,
    sizes,
    smallest_felt_m,
    trend,
    widths,
)
from haploop.logger.verdict.ripple import ripple
from haploop.tools.render.report import finding_table
from helpers.shown import shown


def swing_of(x: np.ndarray, rate: float, command: np.ndarray | None = None) -> Swing:
    """The measures of a loop that swings so after the larger push, a tenth as wide after the smaller one."""
    one, large = np.ones(1), x[None]
    held = large if command is None else command[None]
    [swing] = measure(Pushed(0.1 * large, large, held, one, 0.0 * one, one > 0, one > 0, one > 0), rate)
    return swing


def test_what_a_finger_feels_is_that_of_the_source_and_falls_with_frequency():
    assert [smallest_felt_m(f) for f in (10.0, 20.0, 320.0)] == pytest.approx([26e-6, 8.5e-6, 0.06e-6])
    assert smallest_felt_m(5.0) > 26e-6 > smallest_felt_m(100.0) > smallest_felt_m(400.0)
    assert is_felt(3e-6, 120.0)
    assert not is_felt(3e-6, 20.0)


def test_growth_frequency_and_ripple_of_a_sine_are_its_own():
    rate = 1000
    t = np.arange(4000) / rate
    x = 1e-4 * np.exp(0.3 * t) * np.sin(2 * np.pi * 40.0 * t) + 5e-3 * t
    found_trend = trend(widths(x, 200), 0.2)
    assert found_trend.rate_1_s == pytest.approx(0.3, abs=3 * float(found_trend.error_1_s))
    assert found_trend.rate_1_s == pytest.approx(0.3, rel=0.05)
    assert frequency_Hz(x - 5e-3 * t, rate) == pytest.approx(40.0, abs=0.3)
    force = 2.0 * np.sin(2 * np.pi * 97.0 * t) + 7.0 * np.sin(2 * np.pi * 5.0 * t)
    assert ripple(force, rate) == pytest.approx(4.0, rel=0.02)


@pytest.mark.parametrize("frequency", [6.3, 24.97, 25.5, 61.44, 320.2])
def test_a_frequency_is_told_between_the_lines_of_its_spectrum(frequency: float):
    """Half a second has a line every 2 Hz; a loop that swung at 25.0 Hz was said to swing at 26.0."""
    t = np.arange(500) / 1000.0
    x = 1e-4 * np.sin(2 * np.pi * frequency * t + 0.4) + 3e-4
    assert frequency_Hz(x, 1000.0) == pytest.approx(frequency, abs=0.05)


def test_the_width_that_is_told_of_a_swing_is_its_own_wherever_its_pieces_begin():
    """Beside a hand that comes to rest slowly; about straight lines that the swing tilts it is up to a tenth more."""
    t = np.arange(4000) / 1000.0
    for periods in np.arange(4.0, 12.0, 0.3):
        swing = 1e-3 * np.sin(2.0 * np.pi * periods / 0.332 * t) + 2e-3 * np.exp(-1.5 * t)
        assert level_widths(swing, 332)[-3:].mean() == pytest.approx(2e-3, rel=0.03)
    assert widths(1e-3 * np.sin(2.0 * np.pi * 2.8 / 0.166 * t), 166).max() > 1.08 * 2e-3


def test_the_force_ripple_is_that_of_the_last_quarter():
    """A buzz of the command that ends before it leaves none, though the swing of the device goes on."""
    t = np.arange(4000) / 1000.0
    command = np.where(t < 2.9, np.sin(2 * np.pi * 100.0 * t), 0.0)
    swing = swing_of(1e-4 * np.sin(2 * np.pi * 40.0 * t), 1000.0, command)
    assert swing.ripple_N == 0.0
    assert swing.frequency_Hz == pytest.approx(40.0)


@pytest.mark.parametrize(("fast_m", "word"), [(2e-6, "limit-cycle"), (2e-8, "steady")])
def test_a_fast_chatter_that_is_felt_is_not_hidden_by_a_slow_swing_that_is_not(fast_m, word):
    """Of 10 um at 6 Hz nothing is felt, of 4 um at 150 Hz much: 0.23 um of amplitude are (Israr et al. 2006)."""
    t = np.arange(8000) / 1000.0
    x = 5e-6 * np.sin(2 * np.pi * 6.0 * t) + fast_m * np.sin(2 * np.pi * 150.0 * t)
    one = np.ones(1)
    alike = Pushed(x[None], x[None], x[None], one, 1e-5 * one, one > 0, one > 0, one > 0)
    [swing] = measure(alike, 1000.0)
    assert swing.times_felt == pytest.approx(np.hypot(fast_m / 0.233e-6, 5e-6 / 59.3e-6), rel=0.02)
    finding = decide(swing, last=False)
    assert (finding.word, finding.felt) == (word, word == "limit-cycle")
    assert finding.frequency_Hz == pytest.approx(150.0 if finding.felt else 6.0)


def test_what_is_felt_adds_over_the_frequencies_and_is_that_of_a_sine_alone():
    t = np.arange(4000) / 1000.0
    sines = [1e-6 * np.sin(2 * np.pi * f * t) for f in (100.0, 200.0)]
    one, two, both = (float(most_felt(x, 1000.0)[0]) for x in (*sines, sines[0] + sines[1]))
    assert one == pytest.approx(1e-6 / smallest_felt_m(100.0), rel=1e-3)
    assert both == pytest.approx(np.hypot(one, two), rel=1e-3)


@pytest.mark.parametrize("frequency", [0.1, 0.25, 0.375, 0.6])
def test_a_slow_swing_that_grows_is_not_taken_for_one_that_dies_unfelt(frequency):
    """What a hand feels at a quarter of a hertz is wide, and half a period may fall while its growing."""
    for seconds in (1.0, 2.0, 4.0, 8.0, 16.0):
        t = np.arange(round(1000.0 * seconds)) / 1000.0
        for phase in np.arange(12.0) / 2.0:
            x = 2e-3 * np.exp(0.0105 * t) * np.sin(2 * np.pi * frequency * t + phase)
            finding = decide(swing_of(x, 1000.0), last=seconds == 16.0)
            assert finding.word in ("undecided", "growing"), (seconds, phase, finding.sentence())


def test_a_swing_said_to_last_is_bounded_by_the_one_of_the_two_that_changes_more():
    t = np.arange(8000) / 1000.0
    sine, one = 2e-2 * np.sin(2 * np.pi * 7.9 * t)[None], np.ones(1)
    small, is_so = np.exp(0.0009 * t) * sine, one > 0
    [swing] = measure(Pushed(small, sine, sine, one, 0.0 * one, is_so, is_so, is_so), 1000.0)
    finding = decide(swing, last=False)
    assert finding.why == "lasts"
    assert finding.rate_1_s is not None
    assert finding.error_1_s is not None
    assert finding.most_1_s is not None
    of_the_steadier = abs(finding.rate_1_s) + 2.0 * finding.error_1_s
    assert finding.most_1_s == pytest.approx(of_the_steadier + 0.0009, rel=0.02)
    bound = f"the one that may change more grows or decays by no more than {finding.most_1_s:.2g} 1/s"
    assert bound in finding.sentence()
    told = shown(finding_table(finding, finding.entries()["stability"]), 200)
    assert f"of the steadier swing {finding.rate_1_s:.3g} +- " in told


@pytest.mark.parametrize("rate_1_s", [-0.0045, -0.0033, 0.0033])
def test_a_swing_that_surely_changes_is_not_said_to_last_however_slowly_it_does(rate_1_s):
    """Both copies swing alike, as where what the run had set going is wider than what the pushes add."""
    for seconds in (4.0, 8.0, 16.0):
        t = np.arange(round(1000.0 * seconds)) / 1000.0
        x, one = 2e-2 * np.exp(rate_1_s * t) * np.sin(2 * np.pi * 7.9 * t)[None], np.ones(1)
        alike = Pushed(0.75 * x, x, x, one, 0.0 * one, one > 0, one > 0, one > 0)
        [swing] = measure(alike, 1000.0)
        assert decide(swing, last=seconds == 16.0).word != "limit-cycle"


def test_a_slow_creep_that_grows_is_not_taken_for_rest():
    """Its pieces are straight lines to less than a nanometre."""
    for seconds in (1.0, 2.0, 4.0):
        t = np.arange(round(1000.0 * seconds)) / 1000.0
        assert decide(swing_of(1e-2 * np.exp(0.01 * t), 1000.0), last=False).word == "undecided"


@pytest.mark.parametrize("periods", [2.0, 2.3, 3.1, 4.05, 7.02])
def test_a_sine_that_does_not_grow_is_not_said_to_however_its_pieces_fall(periods):
    """The widths alone, of pieces that do not hold whole periods, seem to grow by several of their standard errors."""
    rate, seconds = 1000.0, 4.8
    t = np.arange(round(seconds * rate)) / rate
    said = {sizes: 0.0, widths: 0.0}
    for phase in np.arange(12.0) / 2.0:
        x = 1e-4 * np.sin(2 * np.pi * periods * t / 0.2 + phase)
        for measured in said:
            growth = trend(measured(x, 200)[12:], 0.2)
            said[measured] = max(said[measured], abs(float(growth.change)))
        swing = swing_of(x, rate)
        assert all(abs(change) < 3.0 * error for change, error in zip(swing.changes, swing.errors, strict=True))
        assert abs(swing.changes[0]) < 0.03
    assert said[sizes] < 0.4 * said[widths]


@pytest.mark.parametrize(("rate_1_s", "word"), [(0.02, "growing"), (-0.02, "steady")])
def test_how_a_swing_of_eight_periods_goes_on_is_told_from_turn_to_turn(rate_1_s, word):
    """Pieces of sixteen seconds that cover two periods each would ask for twice as many."""
    t = np.arange(16_000) / 1000.0
    for phase in np.arange(12.0) / 2.0:
        swing = swing_of(2e-2 * np.exp(rate_1_s * t) * np.sin(2 * np.pi * 0.5 * t + phase), 1000.0)
        finding = decide(swing, last=True)
        assert finding.word == word, finding.sentence()
        assert finding.rate_1_s == pytest.approx(rate_1_s, abs=1e-4)
        assert finding.frequency_Hz == pytest.approx(0.5, abs=1e-3)


def test_turns_of_something_faster_do_not_tell_how_a_slow_swing_goes_on():
    """Of 7 mm that grow at 5 Hz under 20 mm that die at 0.5 Hz."""
    t = np.arange(16_000) / 1000.0
    slow = 2e-2 * np.exp(-0.02 * t) * np.sin(2 * np.pi * 0.5 * t)
    assert decide(swing_of(slow, 1000.0), last=True).word == "steady"
    fast = 3.5e-3 * np.exp(0.02 * t) * np.sin(2 * np.pi * 5.0 * t)
    assert decide(swing_of(slow + fast, 1000.0), last=True).word not in ("steady", "limit-cycle")


@pytest.mark.parametrize(("count_m", "word"), [(1e-6, "growing"), (1e-5, "undecided")])
def test_a_chatter_within_the_counts_of_an_encoder_is_not_said_to_grow_for_good_before_the_last_look(count_m, word):
    t, one = np.arange(8_000) / 1000.0, np.ones(1)
    x = 3e-6 * np.exp(0.05 * t) * np.sin(2 * np.pi * 100.0 * t)[None]
    [swing] = measure(Pushed(x, x, x, one, count_m * one, one > 0, one > 0, one > 0), 1000.0)
    assert decide(swing, last=False).word == word
    assert decide(swing, last=True).word == "growing"
