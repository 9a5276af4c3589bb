"""The buzz of a recording: told of swings that last, at their frequency, and of nothing else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from haploop.tools.dissipate.recording.samples import Floats, Samples
from haploop.tools.dissipate.recording.stamps import Flags
from haploop.tools.dissipate.report import make_report
from haploop.tools.dissipate.swing.finder import BuzzFinder
from helpers.data.recordings import outcome, write
from helpers.data.swings import COUNT_M, S, counted, swing
from helpers.shown import shown


def finder(x_m: Floats, t_s: Floats | None = None, piece: int = 700, period_s: float = 1e-3) -> BuzzFinder:
    """Makes the finder that has read positions in pieces without a gap."""
    found, t_s = BuzzFinder(period_s), np.arange(float(len(x_m))) * period_s if t_s is None else t_s
    for at in range(0, len(x_m), piece):
        t, x = t_s[at : at + piece], x_m[at : at + piece]
        found.add(Samples(t, x, None, None, x, None, at == 0))
    return found


@pytest.mark.parametrize("frequency_Hz", [17.0, 31.0, 77.3, 180.0, 400.0])
@pytest.mark.parametrize("hand_Hz", [0.0, 0.7, 3.1])
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_a_buzz_is_told_at_its_frequency_on_a_hands_motion_noise_and_counts(
    frequency_Hz: float, hand_Hz: float, seed: int
) -> None:
    noise = 3e-6 * np.random.default_rng(seed).standard_normal(len(S))
    found = finder(counted(swing(frequency_Hz, 2e-4) + swing(hand_Hz, 3e-3) + noise))
    buzz = found.buzz()
    assert found.word() == "buzzes"
    assert buzz is not None
    assert abs(buzz.frequency_Hz - frequency_Hz) < 0.5 * buzz.within_Hz
    assert buzz.width_m == pytest.approx(4e-4, rel=0.03)
    assert buzz.stretches == ((0.0, pytest.approx(S[-1], abs=0.125)),)


def drawn(seed: int, before: bool, after: bool) -> tuple[float, BuzzFinder]:
    """A drawn short recording and how long it truly buzzes, s; with or without quiet before and after."""
    draw = np.random.default_rng(seed)
    period_s, lasts_s = float(draw.choice([1e-3, 5e-4])), draw.uniform(1.3, 3.0)
    begins_s, quiet_s = before * draw.uniform(0.6, 1.0), after * draw.uniform(0.6, 1.0)
    t: Floats = np.arange(float(round((begins_s + lasts_s + quiet_s) / period_s))) * period_s
    on = (t >= begins_s) & (t < begins_s + lasts_s)
    width = 2e-4 * np.exp(draw.uniform(-0.3, 0.3) * t) * on
    noise = 1e-6 * draw.standard_normal(len(t))
    hand = 1e-3 * np.sin(2.0 * np.pi * 0.7 * t)
    x_m = counted(width * np.sin(2.0 * np.pi * draw.uniform(20.0, 90.0) * t + draw.uniform(0.0, 6.0)) + hand + noise)
    return min(begins_s + lasts_s, float(t[-1])) - begins_s, finder(x_m, t, period_s=period_s)


@pytest.mark.parametrize(
    ("before", "after", "most"),
    [
        (False, False, 1e-9),
        pytest.param(True, True, 0.08, marks=pytest.mark.slow),
        pytest.param(True, False, 0.07, marks=pytest.mark.slow),
        pytest.param(False, True, 0.07, marks=pytest.mark.slow),
    ],
)
def test_a_buzz_lasts_as_long_as_it_does_and_to_the_very_end_of_a_short_recording(
    before: bool, after: bool, most: float
) -> None:
    errors = []
    for seed in range(12):
        lasts_s, found = drawn(seed, before, after)
        buzz = found.buzz()
        assert buzz is not None
        errors.append(buzz.lasts_s / lasts_s - 1.0)
    assert max(map(abs, errors)) < most
    assert abs(np.mean(errors)) < 0.015


@pytest.mark.parametrize("begins_s", [1.0, 1.3, 2.0, 2.4])
def test_a_buzz_begins_when_it_does_within_a_fifth_of_a_second(begins_s: float) -> None:
    buzz = finder(counted(swing(31.0, 2.6e-4) * (begins_s < S) - 2e-3 * np.minimum(S, 1.0))).buzz()
    assert buzz is not None
    assert buzz.stretches[0][0] == pytest.approx(begins_s, abs=0.2)


def test_a_buzz_that_pauses_is_told_with_all_its_stretches_also_those_that_do_not_last_alone(tmp_path: Path) -> None:
    long = np.arange(9000.0) * 1e-3
    on = (long < 2.0) | ((long >= 3.5) & (long < 4.2)) | (long >= 6.0)
    x_m = 2.6e-4 * np.sin(2.0 * np.pi * 31.0 * long) * on - 1e-3 * long
    buzz = finder(counted(x_m)).buzz()
    assert buzz is not None
    assert buzz.stretches == tuple(pytest.approx(span, abs=0.3) for span in ((0.0, 2.0), (3.5, 4.2), (6.0, 9.0)))
    said = shown(make_report(outcome(write(tmp_path / "pauses.csv", {"t": long, "x": counted(x_m)}))), 200)
    assert "31.0 Hz (give or take 1 Hz)" in said
    assert "3 times between about 0.0 s and 9.0 s, " in said
    assert "run haploop advise FILE" in said
    assert "pauses of less than half a second are not reported" in said


def test_a_gap_in_a_recording_does_not_end_its_buzz() -> None:
    x_m, found = counted(swing(31.0, 2.6e-4)), BuzzFinder(1e-3)
    for first, end in ((0, 2000), (2013, 4000)):
        t, x = S[first:end], x_m[first:end]
        found.add(Samples(t, x, None, None, x, None, True))
    buzz = found.buzz()
    assert buzz is not None
    assert buzz.stretches == ((0.0, pytest.approx(S[-1], abs=0.125)),)


def dropped(x_m: Floats, is_kept: Flags, force_N: Floats | None = None) -> BuzzFinder:
    """Makes the finder that has read the samples that are kept, in pieces between gaps."""
    found, places = BuzzFinder(1e-3), np.flatnonzero(is_kept)
    for part in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1):
        force = None if force_N is None else force_N[part]
        found.add(Samples(S[part], x_m[part], None, None, x_m[part], None, True, force_N=force))
    return found


@pytest.mark.parametrize("missing", [1, 3, 10])
@pytest.mark.parametrize("frequency_Hz", [21.0, 73.0, 180.0])
def test_a_buzz_goes_on_over_gaps_of_few_samples_with_its_frequency_and_width(
    missing: int, frequency_Hz: float
) -> None:
    """Ten samples of 1 ms are nearly two periods of the fastest."""
    lost = (S > 0.5) & (np.arange(len(S)) % 310 < missing)
    x_m = swing(frequency_Hz, 2e-4) - 2e-3 * np.minimum(S, 1.0)
    buzz = dropped(x_m, ~lost).buzz()
    assert buzz is not None
    ((from_s, to_s),) = buzz.stretches
    assert (from_s, to_s) == pytest.approx((0.0, 3.999), abs=0.01)
    assert buzz.frequency_Hz == pytest.approx(frequency_Hz, abs=0.2)
    assert buzz.width_m == pytest.approx(4e-4, rel=0.03)


@pytest.mark.parametrize("to_s", [3.0, 3.05, 3.1, 3.15, 3.2])
def test_a_buzz_that_ends_in_mid_recording_did_not_die_down_before(to_s: float) -> None:
    buzz = finder(swing(73.0, 2e-4) * (to_s > S)).buzz()
    assert buzz is not None
    assert buzz.last_m == pytest.approx(4e-4, rel=0.05)


def test_a_bridged_gap_is_no_buzz_and_where_half_is_missing_none_is_bridged() -> None:
    hand = 5e-3 * np.sin(2.0 * np.pi * 1.1 * S)
    places = np.arange(len(S))
    assert dropped(hand, places % 60 >= 5).word() == "none seen"
    assert dropped(swing(73.0, 2e-4), places % 20 >= 10).word() == "cannot say"


def test_a_force_between_gaps_is_not_said_to_have_fed_a_swing_over_them() -> None:
    force_N = -200.0 * swing(73.0, 2e-4)
    whole, broken = (dropped(swing(73.0, 2e-4), kept, force_N).buzz() for kept in (S >= 0.0, np.arange(4000) % 310 > 2))
    assert whole is not None
    assert broken is not None
    assert whole.fed_W is not None
    assert broken.fed_W is None


def test_a_buzz_whose_frequency_moves_is_told_from_its_least_to_its_greatest(tmp_path: Path) -> None:
    x_m = 5e-4 * np.sin(2.0 * np.pi * (26.0 * S + 2.0 * S**2))
    said = shown(make_report(outcome(write(tmp_path / "sweep.csv", {"t": S, "x": x_m}))))
    assert "it swings at 27 to 41 Hz, 993 µm" in said
    assert "give or take" not in said


@pytest.mark.parametrize(
    ("width", "words"),
    [(S > 1.0, "stayed as wide"), (np.exp(0.4 * S), "It grew from"), (np.exp(-0.4 * S), "It died down from")],
)
def test_a_buzz_is_told_to_grow_to_die_down_or_to_stay(tmp_path: Path, width: Floats, words: str) -> None:
    path = write(tmp_path / "course.csv", {"t": S, "x": counted(swing(31.0, 2.6e-4) * width)})
    assert words in shown(make_report(outcome(path)), 400)


def test_the_frequency_is_that_of_the_times_where_they_jitter() -> None:
    t = np.sort(1.01 * S + np.random.default_rng(2).uniform(-1e-4, 1e-4, len(S)))
    buzz = finder(2e-4 * np.sin(2.0 * np.pi * 300.0 * t), t).buzz()
    assert buzz is not None
    assert buzz.frequency_Hz == pytest.approx(300.0, abs=0.5)


def _ring(t: Floats, frequency_Hz: float, decay_s: float) -> Floats:
    return np.where(t > 0.0, np.exp(-np.maximum(t, 0.0) / decay_s) * np.sin(2.0 * np.pi * frequency_Hz * t), 0.0)


def _waves(frequency_Hz: float) -> list[Floats]:
    sine = np.sin(2.0 * np.pi * frequency_Hz * S)
    return [sine, np.arcsin(sine) / 1.6, np.maximum(sine, 0.0), np.clip(2.0 * sine, -1.0, 1.0), sine**3]


STILL: dict[str, Callable[[], list[Floats]]] = {
    "hand": lambda: [3e-3 * wave for f in (0.3, 2.0, 4.5, 8.0, 10.0) for wave in _waves(f)],
    "ramp": lambda: [v * of for v in (1e-3, 5e-3, 2e-2) for of in (S, np.minimum(S, 2.0), np.abs(S - 2.0), S**2)],
    "tap": lambda: [1e-3 * _ring(S - 1.0, f, tau) for f in (20.0, 40.0, 100.0) for tau in (0.05, 0.1, 0.3)],
    "taps": lambda: [
        sum((1e-3 * _ring(S - at, f, 0.05) for at in (0.5, 1.1, 1.7, 2.2, 2.9, 3.4)), np.zeros(len(S)))
        for f in (20.0, 40.0)
    ],
    "rest": lambda: [np.zeros(len(S))],
}


@pytest.mark.parametrize("name", STILL)
def test_what_a_hand_does_or_is_struck_is_no_buzz_be_it_rounded_or_not(name: str) -> None:
    for x in STILL[name]():
        assert finder(x).word() == "none seen"
        assert finder(counted(x)).word() == "none seen"


def test_the_overtone_of_a_slower_swing_whose_frequency_changes_is_no_buzz() -> None:
    phase = 2.0 * np.pi * (8.5 * S - 0.2 * S**2)
    assert finder(1e-3 * np.sin(phase) + 2e-4 * np.sin(2.0 * phase) - 3e-3 * S).word() == "none seen"


def test_a_swing_left_out_near_a_multiple_of_a_slower_one_is_told_beside_that_none_was_seen(tmp_path: Path) -> None:
    path = write(tmp_path / "beside.csv", {"t": S, "x": swing(12.33, 5e-4) + swing(37.0, 1e-4)})
    found = outcome(path)
    assert found.buzz is None
    assert "A swing at 37.0 Hz, 200 µm peak to peak, was left out: near 3 times 12.3 Hz" in shown(
        make_report(found), 400
    )
    assert found.as_data()["left_out"]["frequency_Hz"] == pytest.approx(37.0, abs=0.1)
    alone = outcome(write(tmp_path / "alone.csv", {"t": S, "x": swing(12.33, 5e-4)}))
    assert "left out" not in shown(make_report(alone), 400)


@pytest.mark.parametrize("period_s", [5e-3, 1e-3, pytest.param(1e-4, marks=pytest.mark.slow)])
def test_noise_is_no_buzz(period_s: float) -> None:
    for seed in range(4):
        random, count = np.random.default_rng(seed), round(4.0 / period_s)
        white = np.asarray(COUNT_M * random.standard_normal(count), float)
        for x in (white, np.cumsum(white), counted(white), counted(COUNT_M * random.random(count))):
            assert finder(x, period_s=period_s).word() == "none seen"


def test_of_a_short_slow_or_broken_recording_it_cannot_be_said() -> None:
    assert finder(np.zeros(900)).word() == "cannot say"
    assert finder(np.zeros(900), period_s=1e-2).word() == "cannot say"
    found = BuzzFinder(1e-3)
    for at in (0, 600, 1200):
        found.add(Samples(S[at : at + 500], S[at : at + 500], None, None, S[at : at + 500], None, True))
    assert found.word() == "cannot say"


@pytest.mark.slow
def test_of_a_swing_within_the_counts_it_is_said_that_they_decide_and_not_that_it_is_not_felt(tmp_path: Path) -> None:
    x = swing(200.0, 8e-6) + 1e-3 * S
    coarse = outcome(write(tmp_path / "coarse.csv", {"t": S, "x": np.round(x / 1e-5) * 1e-5}))
    said = shown(make_report(coarse), 600)
    assert "cannot be said: a swing at 200." in said
    assert "within 2 counts of the positions, 10.0 µm each" in said
    assert "No swing" not in said
    assert coarse.as_data()["hidden"]["count_m"] == pytest.approx(1e-5)
    fine = outcome(write(tmp_path / "fine.csv", {"t": S, "x": np.round(x / 1e-6) * 1e-6}))
    assert (fine.buzz_word, fine.hidden) == ("buzzes", None)
    for beside in (3e-3 * np.sin(2.0 * np.pi * 0.7 * S), 1e-3 * S):
        path = write(tmp_path / "beside.csv", {"t": S, "x": np.round((swing(200.0, 8e-6) + beside) / 1e-5) * 1e-5})
        assert outcome(path).buzz_word == "cannot say"
    for speed_m_s in (1e-4, 7e-4):
        creeps = outcome(write(tmp_path / "creeps.csv", {"t": S, "x": np.round(speed_m_s * S / 1e-5) * 1e-5}))
        assert (creeps.buzz_word, creeps.hidden) == ("none seen", None)
