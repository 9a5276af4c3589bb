"""Words of the page about a loop as it goes: no word before it can be told, none that the picture contradicts."""

import numpy as np
import pytest

from haploop.logger.verdict.spectrum import amplitudes, main_line
from haploop.view.look.sight import see
from haploop.view.store.history import History
from helpers.runs.seen import COUNT_M, TIME, deep, history_of, seen, sine
from helpers.scenes.effect_tables import slowly


@pytest.mark.parametrize("f", [3.3, 37.25, 200.1])
def test_a_sine_is_one_line_of_its_frequency_and_width(f):
    t = np.arange(2000) / 1000
    line = main_line(0.2 * np.sin(2 * np.pi * f * t + 0.3) + 3 * t, 1000.0)
    assert line
    assert line.frequency_Hz == pytest.approx(f, abs=0.005)
    assert line.width == pytest.approx(0.4, rel=0.005)
    at, height = amplitudes(0.2 * np.sin(2 * np.pi * 50.0 * t), 1000.0)
    assert height[np.argmin(abs(at - 50.0))] == pytest.approx(0.2, rel=1e-3)


def test_noise_a_constant_and_less_than_two_periods_have_no_line():
    noise = np.random.default_rng(1).normal(size=2000)
    assert main_line(noise, 1000.0) is None
    assert main_line(np.ones(2000), 1000.0) is None
    assert main_line(np.sin(2 * np.pi * 0.4 * np.arange(2000) / 1000), 1000.0) is None


def test_before_half_a_second_in_one_regime_there_is_no_word():
    """After the start, after a change, and after contact where there was none."""
    swing = sine(40.0, 1e-3)
    assert seen(swing, end=499).word == "settling"
    assert seen(swing, end=500).word == "swinging"
    assert seen(swing, since=2600).word == "settling"
    assert seen(swing, since=2500).word == "swinging"

    def arrives(t):
        return np.where(t < 2.7, 1e-3, -1e-3)

    early = seen(arrives)
    assert (early.word, early.from_s, early.so_far) == ("settling", 2.7, True)
    assert seen(arrives, end=2600).word == "no contact"


def test_a_swing_that_has_no_word_yet_is_told_from_what_rests():
    swings = seen(sine(41.0, 1e-3), since=2850)
    assert (swings.word, swings.so_far_word) == ("settling", "swinging")
    assert swings.oscillation_m == pytest.approx(2e-3, rel=0.1)
    assert seen(deep, since=2850).so_far_word == "no swing seen"
    assert seen(deep, lambda t: 0.1 + 0.05 * np.sin(300 * t), since=2850).so_far_word == "force ripples"


@pytest.mark.parametrize("f", [2.3, 7.99, 30.2])
def test_the_width_of_a_steady_swing_is_that_of_the_swing_wherever_the_window_cuts_it_off(f):
    """Its straight trend by itself makes it up to a quarter wider."""
    assert seen(sine(f, 1e-3), end=2813).oscillation_m == pytest.approx(2e-3, rel=1e-3)
    drifts = seen(lambda t: sine(30.2, 1e-3)(t) + 4e-3 * t)
    assert drifts.oscillation_m == pytest.approx(2e-3, rel=0.08)


def test_what_bounces_on_and_off_the_wall_is_one_regime():
    assert seen(lambda t: 2e-3 * np.sin(2 * np.pi * 8.0 * t)).word == "swinging"


def test_no_swing_is_said_to_be_unseen_that_a_picture_of_two_seconds_shows():
    """Of 1 to 3 Hz half a second has fewer than four crossings, which is no swing to the window's rule."""
    words = {f: seen(sine(f, 1e-3)).word for f in (0.3, 0.7, 1.0, 1.5, 3.0, 8.0, 100.0)}
    assert "no swing seen" not in words.values()
    assert words[1.5] == words[3.0] == words[100.0] == "swinging"
    assert words[0.3] == "moving"


def test_a_force_that_buzzes_while_the_position_rests_is_told():
    quiet, loud = (seen(deep, lambda t, size=size: 0.5 + size * np.sign(np.sin(700.0 * t))) for size in (1e-4, 0.1))
    assert quiet.word == "no swing seen"
    assert loud.word == "force ripples"
    assert loud.ripple_N == pytest.approx(0.2, rel=0.02)
    assert loud.frequency_Hz == pytest.approx(700.0 / (2 * np.pi), rel=0.01)


def test_what_was_not_received_is_no_number_that_is_not_finite():
    """A page that joins, or lost some telemetry, holds rows that nobody sent: another regime begins after them."""
    for missing in (0, 1500, 2700):
        history, held = history_of(sine(40.0, 1e-3), lambda t: 0.1), History(TIME, 0)
        gap = range(missing, missing + 100)
        for first, end in ((0, missing), (missing + 100, 3000)):
            for own, its in zip(held.all_series[:2], history.all_series[:2], strict=True):
                if first < end:
                    own.append(first, dict(zip(its.names, its.rows(its.names, first, end), strict=True)))
        held.at_work = history.at_work
        held.ticks.begin(0)
        found = see(held, 0, 3000, COUNT_M)
        assert found
        assert (found.word, found.from_s) == (("settling", 2.8) if missing == 2700 else ("swinging", 2.5)), gap


def test_growth_and_decay_have_words_of_their_own():
    def grows(rate):
        return lambda t: -5e-3 + 1e-4 * np.exp(rate * (t - 3.0)) * np.sin(2 * np.pi * 30 * t)

    assert [seen(grows(rate)).word for rate in (4.0, 0.0, -4.0)] == ["growing", "swinging", "dying away"]
    assert seen(lambda t: np.where(t > 2.9, np.nan, -1e-3)).word == "not finite"


def test_a_swing_that_goes_on_after_what_the_contact_set_off_has_died_is_not_said_to_die_away():
    """In the half second the second half is a tenth as wide as the first, and no longer decays."""
    wide = lambda t: 1e-4 + 1e-3 * np.exp(-20.0 * np.maximum(t - 2.5, 0.0))  # noqa: E731
    assert seen(lambda t: -5e-3 + wide(t) * np.sin(2 * np.pi * 30 * t)).word == "swinging"


def test_a_swing_that_is_over_is_told_to_have_died_until_two_seconds_show_none_of_it():
    def stops(at_s):
        return seen(lambda t: -5e-3 + np.where(t < at_s, 1e-3 * np.sin(2 * np.pi * 30 * t), 0.0))

    over, gone = stops(2.45), stops(0.99)
    assert (over.word, over.oscillation_m, over.rests) == ("died away", 0.0, True)
    assert "by more than 10 µm; in the last 0.5 s it did not." in over.why
    assert (gone.word, gone.oscillation_m, gone.frequency_Hz) == ("no swing seen", 0.0, None)
    assert "In the last 2 s the position stayed within 0 µm" in gone.why
    assert (stops(2.55).word, stops(2.55).rests) == ("dying away", False)


def test_a_swing_of_the_force_that_is_over_is_told_too_until_two_seconds_show_none_of_it():
    def stops(at_s):
        return seen(deep, lambda t: 0.5 + np.where(t < at_s, 0.1 * np.sin(700.0 * t), 0.0))

    over, gone = stops(2.45), stops(0.99)
    assert (over.word, over.ripple_N) == ("died away", pytest.approx(0.0, abs=1e-12))
    assert over.why.endswith("in the last 2 s the force rippled by 0.202 N, in the last 0.5 s by 0 N.")
    assert (stops(2.7).word, gone.word) == ("force ripples", "no swing seen")


@pytest.mark.parametrize("seed", [*range(10), *slowly(range(10, 30))])
def test_whatever_moved_or_rippled_in_the_last_two_seconds_is_never_unseen(seed):
    """Pushes, bursts of a buzz, also between ticks, slow swings and ripples of the force, drawn."""
    draw = np.random.default_rng(seed)
    begins, lasts = draw.uniform(1.05, 2.9), draw.uniform(0.02, 0.5)
    size = np.exp(draw.uniform(np.log(2.5), np.log(200.0))) * COUNT_M
    f = draw.choice([1000.0, np.exp(draw.uniform(np.log(4.0), np.log(200.0)))])

    def moves(t, kind):
        on = (t > begins) & (t < begins + lasts)
        shapes = {
            "push": np.clip((t - begins) / lasts, 0.0, 1.0),
            "burst": on * np.sin(2 * np.pi * f * (t - begins)),
            "slow": np.sin(2 * np.pi * draw.uniform(0.3, 4.0) * t),
        }
        return shapes[kind]

    for kind in ("push", "burst", "slow"):
        found = seen(lambda t, kind=kind: -5e-3 + size * moves(t, kind))
        assert found.word in ("swinging", "growing", "dying away", "died away", "moving"), kind
    ripple = seen(deep, lambda t: 0.5 + 0.1 * moves(t, "burst"))
    assert ripple.word in ("died away", "force ripples")


@pytest.mark.parametrize("seed", [*range(10), *slowly(range(10, 30))])
def test_what_is_said_to_rest_moved_no_further_than_told_in_the_time_told(seed):
    """Some motions are a little wider than what counts, others a little narrower; a flicker by one count is rest."""
    draw = np.random.default_rng(seed)
    size, f, since = draw.uniform(0.2, 4.0) * COUNT_M, draw.uniform(0.05, 0.4), int(draw.integers(0, 2400))
    flickers = draw.integers(0, 2, 30_000) * COUNT_M

    def drifts(t):
        return -5e-3 + 0.5 * size * np.sin(2 * np.pi * f * t)

    found = seen(drifts, since=since)
    width = np.ptp(drifts(np.arange(round(found.from_s * 1e4), round(found.to_s * 1e4)) / 1e4))
    assert found.from_s == max(since, 1000) / 1e3
    assert (found.word == "no swing seen") == (width <= 2.0 * COUNT_M)
    if found.word == "no swing seen":
        assert f"the position stayed within {width * 1e6:.3g} µm" in found.why
    rests = seen(lambda t: -5e-3 + flickers[np.rint(t * 1e4).astype(int)], since=since)
    assert (rests.word, rests.rests) == ("no swing seen", True)


def test_what_swings_without_a_line_has_a_frequency_by_its_crossings_and_what_is_not_seen_to_swing_has_none():
    """A buzz while a tap is in the wall; a swing within two counts of the encoder."""

    def buzzing(t):
        tap = np.sin(2.0 * np.pi * 2.0 * t)
        return 5e-3 * tap + 5e-3 * np.where(tap < 0.0, np.sin(2.0 * np.pi * (60.0 + 40.0 * np.sin(9.0 * t)) * t), 0.0)

    for motion, words in ((buzzing, {"swinging", "growing"}), (sine(7.7, 0.4 * COUNT_M), {"no swing seen"})):
        seen = see(history_of(motion, lambda t: 0.1), 0, 3000, COUNT_M)
        assert seen
        assert seen.word in words
        assert (seen.frequency_Hz is None) == ("no swing seen" in words)
