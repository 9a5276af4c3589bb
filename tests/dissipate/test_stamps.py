"""Times that are rounded more coarsely than their samples lie apart, and those that are uneven."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from haploop.tools.dissipate.figure import make_figure
from haploop.tools.dissipate.recording.samples import Floats
from haploop.tools.dissipate.recording.stamps import stamps
from haploop.tools.dissipate.recording.text_recording import Layout
from haploop.tools.dissipate.report import doubtful, make_report, note_sentences
from helpers.data.recordings import outcome, write
from helpers.shown import shown


def motion(t: Floats) -> Floats:
    return 1e-3 * np.sin(2.0 * np.pi * 7.0 * t)


def damped_J(path: Path, layout: Layout | None = None) -> float:
    return outcome(path, layout=layout or Layout(), dampings=["2"]).elements[0].true_J


@pytest.mark.parametrize(
    ("rate_Hz", "step_s", "name", "rounding"),
    [
        (400.0, 1e-3, "t (ms)", np.round),
        (600.0, 1e-3, "t (s)", np.floor),
        (950.0, 1e-4, "t (s)", np.ceil),
        (333.7, 1e-3, "t (us)", np.floor),
        (61.0, 1e-2, "t (s)", np.ceil),
    ],
)
def test_even_samples_with_rounded_times_keep_their_rate_and_energy(
    tmp_path: Path, rate_Hz: float, step_s: float, name: str, rounding: Callable[[Floats], Floats]
) -> None:
    t = np.arange(1600) / rate_Hz
    unit = {"t (ms)": 1e3, "t (us)": 1e6}.get(name, 1.0)
    stamped = np.round(rounding(t / step_s + 1e-9) * step_s * unit, 6)
    even = damped_J(write(tmp_path / "even.csv", {"x": motion(t)}), Layout(rate_Hz=rate_Hz))
    path = write(tmp_path / "rounded.csv", {name: stamped, "x (m)": motion(t)})
    found = outcome(path, dampings=["2"])
    assert 1.0 / found.recording.period_s == pytest.approx(rate_Hz, rel=1e-4)
    assert found.elements[0].true_J == pytest.approx(even, rel=1e-4)
    notes = found.recording.notes
    assert (notes.uneven, notes.gaps, notes.bridged, notes.rounded_s) == (0, 0, 0, pytest.approx(step_s))
    assert any("The times are rounded to" in sentence for sentence in note_sentences(found))
    assert not doubtful(found)


@pytest.mark.parametrize("begins_s", [0.0, 10.0])
def test_rounded_times_are_recognised_in_a_recording_shorter_than_a_second(begins_s: float) -> None:
    """0 is a multiple of every power of ten: below 1 s all times seemed to be multiples of a million."""
    times = np.asarray(np.round(begins_s + 1.3e-3 * np.arange(500), 3), float)
    found = stamps(times, 1.0)
    assert found.rounded_s == 1e-3
    assert found.period_s == pytest.approx(1.3e-3, rel=1e-6)


def test_a_missing_sample_and_a_gap_are_found_between_rounded_times(tmp_path: Path) -> None:
    kept = np.r_[0:400, 401:700, 740:1600]
    t = np.arange(1600)[kept] / 400.0
    found = outcome(write(tmp_path / "holes.csv", {"t (ms)": np.round(t * 1e3), "x (m)": motion(t)}), dampings=["2"])
    assert 1.0 / found.recording.period_s == pytest.approx(400.0)
    notes = found.recording.notes
    assert (notes.uneven, notes.gaps, notes.bridged) == (0, 1, 1)


def test_single_missing_samples_are_found_between_times_rounded_to_more_than_half_a_period(tmp_path: Path) -> None:
    """At 617 Hz in whole ms steps are 1 or 2 ms, and one that spans a missing sample may be 3 ms beside one of 1 ms."""
    kept = np.ones(1600, bool)
    kept[100:1500:11] = False
    t = np.arange(1600)[kept] / 617.0
    found = outcome(write(tmp_path / "holes.csv", {"t (ms)": np.round(t * 1e3), "x (m)": motion(t)}), dampings=["2"])
    assert (found.recording.notes.uneven, found.recording.notes.gaps) == (0, 0)
    assert found.recording.notes.bridged == (~kept).sum()


def test_times_that_are_uneven_are_the_first_thing_said_and_that_energies_may_be_wrong(tmp_path: Path) -> None:
    jitter = np.random.default_rng(3).uniform(-1e-3, 1e-3, 1600)
    t = np.round(np.arange(1600) * 2.5e-3 + jitter, 4)
    found = outcome(write(tmp_path / "jitter.csv", {"t": t, "x": motion(t)}), dampings=["2"])
    assert found.recording.notes.rounded_s == 0.0
    assert shown(make_report(found), 400).startswith("Energies and rate may be wrong: ")
    words = [text.get_text() for part in make_figure(found).subfigs for text in part.texts]
    assert any(each.startswith("Energies and rate may be wrong: ") for each in words)
    assert found.as_data()["times_may_be_wrong"]


@pytest.mark.parametrize("missing", [0, 5])
def test_the_rate_of_scattered_times_is_that_of_their_mean_and_only_what_is_missing_is_told(
    tmp_path: Path, missing: int
) -> None:
    scatter = np.random.default_rng(4).uniform(-0.3e-3, 0.3e-3, 6000)
    kept = np.ones(6000, bool)
    kept[1000 : 1000 * missing + 1 : 1000] = False
    t = (np.arange(6000) * 1e-3 + scatter)[kept]
    found = outcome(write(tmp_path / "scattered.csv", {"t": t, "x": motion(t)}), dampings=["2"])
    assert 1.0 / found.recording.period_s == pytest.approx(1000.0, rel=1e-3)
    assert (found.recording.notes.gaps, found.recording.notes.bridged) == (0, missing)


def test_even_times_are_said_to_be_nothing_else(tmp_path: Path) -> None:
    t: Floats = np.round(np.arange(1600.0) * 1e-3, 3)
    found = outcome(write(tmp_path / "even.csv", {"t": t, "x": motion(t)}), dampings=["2"])
    assert found.recording.period_s == pytest.approx(1e-3, rel=1e-12)
    assert "rounded" not in shown(make_report(found), 400)
