"""Swings at several frequencies at once, one after the other, or just slower than a buzz: told as what they are."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from haploop.tools.cli.app import app
from haploop.tools.dissipate.recording.samples import Floats, Samples
from haploop.tools.dissipate.report import make_report
from haploop.tools.dissipate.swing.finder import BuzzFinder
from helpers.data.recordings import outcome, write
from helpers.scenes.effect_tables import slowly
from helpers.shown import shown

S: Floats = np.arange(4000.0) * 1e-3
ON = (S >= 0.5) & (S < 3.5)
COUNT_M = 11e-6
SEVERAL = "buzzes at several frequencies"


def sine(frequency_Hz: float, width_m: float) -> Floats:
    return 0.5 * width_m * np.sin(2.0 * np.pi * frequency_Hz * S)


def finder(x_m: Floats) -> BuzzFinder:
    found = BuzzFinder(1e-3)
    found.add(Samples(S, x_m, None, None, x_m, None, True))
    return found


def said(path: Path, x_m: Floats) -> str:
    return shown(make_report(outcome(write(path / "drawn.csv", {"t": S, "x": x_m}))), 600)


def test_two_buzzes_at_once_are_told_with_the_width_of_each_and_of_both(tmp_path: Path) -> None:
    words = said(tmp_path, ON * (sine(38.0, 5e-4) + sine(83.0, 5e-4)))
    assert words.startswith("The recording buzzes at several frequencies at once: ")
    assert "38.0 Hz, 500 µm and 83.0 Hz, 500 µm peak to peak at most, together up to 1.00 mm" in words
    assert "from about 0.5 s to 3.5 s" in words
    assert "run haploop advise FILE" in words
    ran = CliRunner().invoke(app, ["dissipate", str(tmp_path / "drawn.csv"), "--json"])
    data = json.loads(ran.stdout)
    assert data["buzz_word"] == SEVERAL
    assert [line[0] for line in data["several"]["lines"]] == [
        pytest.approx(38.0, abs=0.1),
        pytest.approx(83.0, abs=0.1),
    ]
    assert data["several"]["width_m"] == pytest.approx(1e-3, rel=0.01)


@pytest.mark.parametrize("seed", [*range(4), *slowly(range(4, 12))])
def test_two_buzzes_are_told_whatever_their_frequencies_beside_a_hands_motion_noise_and_counts(seed: int) -> None:
    draw = np.random.default_rng(seed)
    first_Hz, apart_Hz, share = draw.uniform(18.0, 90.0), draw.uniform(10.0, 60.0), draw.uniform(0.7, 1.0)
    both = ON * (sine(first_Hz, 4e-4) + sine(first_Hz + apart_Hz, 4e-4 * share))
    hand = sine(draw.uniform(0.3, 1.2), 3e-3) + 2e-6 * draw.standard_normal(len(S))
    found = finder(np.round((both + hand) / COUNT_M) * COUNT_M)
    several = found.several()
    assert found.word() == SEVERAL
    assert several is not None
    assert sorted(line[0] for line in several.lines) == pytest.approx([first_Hz, first_Hz + apart_Hz], abs=0.5)


@pytest.mark.parametrize("seed", [*range(4), *slowly(range(4, 24))])
def test_two_buzzes_of_one_width_that_beat_at_four_and_a_half_hertz_or_more_are_never_called_none(seed: int) -> None:
    """They part by little more than a line of the spectrum is wide; at 3 to 4 Hz some have an r.m.s. alone."""
    draw = np.random.default_rng(seed)
    first_Hz, apart_Hz = draw.uniform(18.0, 200.0), draw.uniform(4.5, 7.0)
    turned = np.sin(2.0 * np.pi * (first_Hz + apart_Hz) * S + draw.uniform(0.0, 6.0))
    found = finder(sine(first_Hz, 2e-4) + 1e-4 * turned + 5e-7 * draw.standard_normal(len(S)))
    assert found.word() in ("buzzes", SEVERAL)


def _taps(draw: np.random.Generator) -> Floats:
    every = draw.choice([0.15, 0.25, 0.4, 4.0])
    taps = np.zeros(len(S))
    for at in np.arange(0.1, 4.0, every):
        since = np.maximum(S - at, 0.0)
        decay = np.exp(-since / draw.choice([0.03, 0.05, 0.1, 0.3]))
        taps += decay * sum(2e-4 * np.sin(2.0 * np.pi * draw.uniform(16.0, 150.0) * since) for _ in range(3))
    return taps


def _steps(draw: np.random.Generator) -> Floats:
    places, rises_s = draw.uniform(0.0, 4.0, 8), draw.choice([1e-3, 5e-3, 2e-2, 8e-2], 8)
    each = zip(places, rises_s, draw.uniform(-2e-3, 2e-3, 8), strict=True)
    return sum((height * np.clip((S - at) / rise, 0.0, 1.0) for at, rise, height in each), np.zeros(len(S)))


def _tremor(draw: np.random.Generator) -> Floats:
    wander = 0.25 * np.cumsum(draw.standard_normal(len(S))) * 1e-3
    phase, widths = 2.0 * np.pi * (draw.uniform(6.0, 12.0) * S + wander), draw.uniform(1.5e-4, 5e-4, 6)
    overtones = (width / k**2 * np.sin(k * phase + draw.uniform(0.0, 6.0)) for k, width in enumerate(widths, 1))
    return sum(overtones, sine(0.7, 4e-3))


def _chirp(draw: np.random.Generator) -> Floats:
    from_Hz, to_Hz = draw.uniform(1.0, 20.0), draw.uniform(100.0, 200.0)
    return 5e-4 * np.sin(2.0 * np.pi * (from_Hz + (to_Hz - from_Hz) / 8.0 * S) * S)


STILL: dict[str, Callable[[np.random.Generator], Floats]] = {
    "noise of a count": lambda draw: COUNT_M * draw.standard_normal(len(S)),
    "noise through a filter": lambda draw: np.convolve(
        3.0 * COUNT_M * draw.standard_normal(len(S)), np.ones(5), "same"
    ),
    "steps": _steps,
    "taps": _taps,
    "tremor": _tremor,
    "chirp": _chirp,
    "hand": lambda draw: np.abs(sum(sine(draw.uniform(0.2, 6.0), draw.uniform(0.0, 6e-3)) for _ in range(4))),
    "fast hand": lambda draw: (
        8e-3 * np.tanh(draw.uniform(1.0, 20.0) * np.sin(2.0 * np.pi * draw.uniform(2.6, 7.0) * S))
    ),
}


def drawn(name: str) -> Iterator[Floats]:
    for seed in range(12):
        x_m = STILL[name](np.random.default_rng(seed))
        yield x_m
        yield np.round(x_m / COUNT_M) * COUNT_M


_FIRST = ("steps", "noise of a count")


@pytest.mark.parametrize("name", [*_FIRST, *slowly(name for name in STILL if name not in _FIRST)])
def test_what_is_no_buzz_is_none_at_several_frequencies_either(name: str) -> None:
    assert {finder(x_m).word() for x_m in drawn(name)} == {"none seen"}


def test_what_is_left_out_as_the_shape_of_a_fast_hands_motion_is_told() -> None:
    found = finder(8e-3 * np.tanh(9.0 * np.sin(2.0 * np.pi * 5.3 * S)))
    left_out = found.overtone()
    assert found.word() == "none seen"
    assert left_out is not None
    assert left_out.slower_Hz == pytest.approx(5.3, abs=0.1)


def test_buzzes_one_after_the_other_are_told_with_the_frequency_and_time_of_each(tmp_path: Path) -> None:
    words = said(tmp_path, sine(38.0, 5e-4) * (S < 1.6) + sine(83.0, 3e-4) * (S > 2.3))
    assert "it swings at 38 to 83 Hz, 500 µm peak to peak at most" in words
    assert "38.0 Hz (500 µm) from about 0.0 s to 1.6 s and 83." in words
    assert " Hz (300 µm) from about 2.2 s to 4.0 s" in words
    assert "2 times" not in words
    at_once = finder(sine(38.0, 5e-4) * (S < 1.9) + sine(83.0, 5e-4) * (S >= 1.9)).buzz()
    assert at_once is not None
    assert [span.least_Hz for span in at_once.spans] == pytest.approx([38.0, 83.0], abs=1.0)


@pytest.mark.parametrize("frequency_Hz", [5.2, 14.7])
def test_a_swing_just_slower_than_a_buzz_is_told_beside_a_wider_and_slower_one(
    tmp_path: Path, frequency_Hz: float
) -> None:
    words = said(tmp_path, ON * sine(frequency_Hz, 6e-4) + sine(0.7, 1e-3))
    assert words.startswith("No swing above 15 Hz was seen")
    assert f"It swings at {frequency_Hz:.1f} Hz (give or take 0.5 Hz), 60" in words
    assert "a hand's own motion, its tremor or a slow limit cycle, which a recording alone cannot tell apart" in words
    assert "Its widest swing is at 0.70" in words
    assert "It swings at" not in said(tmp_path, sine(0.7, 1e-3))


def test_motion_without_a_frequency_is_told_with_its_size_where_it_is_felt_and_beyond_the_noise(tmp_path: Path) -> None:
    draw = np.random.default_rng(3)
    phase = 2.0 * np.pi * np.cumsum(45.0 + 20.0 * np.sin(2.0 * np.pi * 4.0 * S + draw.uniform(0.0, 6.0))) * 1e-3
    wandering = finder(5e-4 * np.sin(phase))
    assert wandering.word() == "none seen"
    assert wandering.fast_rms_m() == pytest.approx(5e-4 / np.sqrt(2.0), rel=0.05)
    assert "It moves by 35" in said(tmp_path, 5e-4 * np.sin(phase))
    for x_m in (COUNT_M * draw.standard_normal(len(S)), sine(0.7, 1e-2), sine(14.0, 6e-4)):
        assert "at no frequency that lasts" not in said(tmp_path, x_m)
