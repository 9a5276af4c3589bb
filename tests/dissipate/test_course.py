"""The width of a buzz: told to grow or to die down only where it does so all the way; its widest."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from haploop.tools.cli.app import app
from haploop.tools.dissipate.recording.samples import Floats, Samples
from haploop.tools.dissipate.report import make_report
from haploop.tools.dissipate.swing.buzz import Buzz
from haploop.tools.dissipate.swing.finder import BuzzFinder
from helpers.data.recordings import outcome, write
from helpers.scenes.effect_tables import slowly
from helpers.shown import shown

S: Floats = np.arange(6000.0) * 1e-3
WIDE_M = 4e-4


def buzz_of(x_m: Floats) -> Buzz | None:
    finder = BuzzFinder(1e-3)
    finder.add(Samples(S, x_m, None, None, x_m, None, True))
    return finder.buzz()


def drawn(seed: int, width_m: Floats) -> Buzz:
    """The buzz of a drawn frequency and phase with a width along time, beside noise, a drift and counts of a micron."""
    draw = np.random.default_rng(seed)
    swing = 0.5 * width_m * np.sin(2.0 * np.pi * draw.uniform(20.0, 150.0) * S + draw.uniform(0.0, 6.0))
    noise = draw.choice([0.0, 3e-6]) * draw.standard_normal(len(S)) + 1e-3 * np.sin(2.0 * np.pi * 0.6 * S)
    found = buzz_of(np.round((swing + noise) / 1e-6) * 1e-6)
    assert found
    return found


@pytest.mark.parametrize("seed", [*range(6), *slowly(range(6, 30))])
def test_what_grows_dies_down_stays_or_is_modulated_is_told_as_that_and_no_narrower_than_it_was(seed: int) -> None:
    draw = np.random.default_rng(100 + seed)
    rate, slow_Hz, depth = draw.uniform(0.15, 0.5), draw.uniform(0.4, 4.0), draw.uniform(0.2, 0.7)
    courses = {
        "stayed": np.ones(len(S)),
        "grew": np.exp(rate * (S - S[-1])),
        "died down": np.exp(-rate * S),
        "varied": 1.0 + depth * np.sin(2.0 * np.pi * slow_Hz * S),
    }
    for word, along in courses.items():
        found = drawn(seed, WIDE_M * along)
        assert found.course == word, (word, slow_Hz, depth)
        # Noise of 3 um adds to the widest of many places.
        assert -0.04 * WIDE_M < found.width_m - WIDE_M * along.max() < 0.02 * WIDE_M + 12e-6
        if word != "stayed":
            assert abs(found.least_m - WIDE_M * along.min()) < 0.04 * WIDE_M
            assert found.spans[0].width_m == found.width_m


@pytest.mark.parametrize("apart_Hz", [1.0, 2.0, 3.0, *slowly([1.5, 4.0, 5.0, 6.0, 8.0])])
@pytest.mark.parametrize("share", [0.5, 0.8])
def test_of_two_buzzes_too_close_to_be_told_apart_the_width_varies_up_to_that_of_both(
    apart_Hz: float, share: float
) -> None:
    both = np.sin(2.0 * np.pi * 41.0 * S) + share * np.sin(2.0 * np.pi * (41.0 + apart_Hz) * S)
    found = buzz_of(1.5e-4 * both)
    if apart_Hz > 3.0 and share > 0.5:  # then no line holds enough of it, and it is told as several, or not
        return
    assert found
    assert found.course == "varied"
    assert found.width_m == pytest.approx(3e-4 * (1.0 + share), rel=0.08)
    if apart_Hz < 8.0:  # a beat as fast is narrowest for less time than the width is fitted over
        assert found.least_m == pytest.approx(3e-4 * (1.0 - share), abs=4e-5)


@pytest.mark.parametrize("frequency_Hz", [18.0, 40.0])
@pytest.mark.parametrize("within_s", [0.6, 0.8, 1.0, 1.5])
def test_of_a_swing_that_dies_soon_after_its_onset_it_is_never_told_that_it_stayed_as_wide(
    frequency_Hz: float, within_s: float
) -> None:
    for begins_s in (0.0, 0.87, 1.0):
        since_s = S - begins_s
        along_m = 3e-3 * (since_s >= 0.0) * np.exp(-np.maximum(since_s, 0.0) / within_s)
        x_m = 0.5 * along_m * np.sin(2.0 * np.pi * frequency_Hz * since_s) - 1e-2 * np.clip(S, 0.0, begins_s)
        found = buzz_of(np.round(x_m / 1e-5) * 1e-5)
        assert found is None or found.course in ("died down", None)


def test_report_and_json_say_of_a_beating_buzz_that_its_width_varied_and_do_not_say_that_it_grew(
    tmp_path: Path,
) -> None:
    x = 1.5e-4 * np.sin(2.0 * np.pi * 41.0 * S) + 1.2e-4 * np.sin(2.0 * np.pi * 44.0 * S)
    path = write(tmp_path / "beats.csv", {"t": S, "x": x})
    said = shown(make_report(outcome(path)), 600)
    assert "Its width varied from " in said
    assert "It grew" not in said
    data = json.loads(CliRunner().invoke(app, ["dissipate", str(path), "--json"]).stdout)["buzz"]
    assert data["course"] == "varied"
    assert data["width_m"] == pytest.approx(5.4e-4, rel=0.03)
    assert data["least_m"] == pytest.approx(6e-5, abs=2e-5)


def test_of_a_buzz_that_begins_in_mid_recording_what_it_does_not_fill_is_no_growth() -> None:
    for begins_s in (0.2, 0.5, 1.1, 2.3):
        found = buzz_of(2e-4 * np.sin(2.0 * np.pi * 41.0 * S) * (begins_s < S))
        assert found
        assert found.course == "stayed"
        assert found.width_m == pytest.approx(WIDE_M, rel=0.01)
