"""Words and figure on the buzz of a recording."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from haploop.tools.cli.app import app
from haploop.tools.dissipate.figure import make_figure
from haploop.tools.dissipate.report import make_report, note_sentences
from helpers.data.recordings import outcome, write
from helpers.data.swings import S, counted, swing
from helpers.shown import artists, shown


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    return write(tmp_path / "buzz.csv", {"t": S, "x": counted(swing(31.0, 2.6e-4) * (S > 2.0) - 1e-3 * S)})


def test_the_buzz_is_the_first_thing_said_also_without_an_element(recording: Path) -> None:
    said = "The recording buzzes: it swings at 31.0 Hz (give or take 1 Hz), 5"
    booked = outcome(recording, dampings=["2"])
    assert shown(make_report(booked), 200).startswith(said)
    assert any(text.get_text().startswith(said) for part in make_figure(booked).subfigs for text in part.texts)
    result = CliRunner().invoke(app, ["dissipate", str(recording)])
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith(said)
    assert "what each available element would have taken" in result.stdout
    assert result.stdout.index("damping") < result.stdout.index("--damping 2.7")
    data = json.loads(CliRunner().invoke(app, ["dissipate", str(recording), "--json"]).stdout)
    assert (data["buzz_word"], data["elements"]) == ("buzzes", [])
    assert Path(data["figure"]).stat().st_size > 20_000
    assert data["buzz"]["frequency_Hz"] == pytest.approx(31.0, abs=1.0) == data["main_Hz"]


def test_a_slower_swing_is_told_beside_a_buzz_though_the_buzz_comes_first(tmp_path: Path) -> None:
    found = outcome(write(tmp_path / "both.csv", {"t": S, "x": swing(9.0, 1e-4) + swing(83.0, 2e-5)}))
    said = shown(make_report(found), 600)
    assert said.startswith("The recording buzzes: it swings at 83.0 Hz")
    assert "It also swings at 9.0 Hz (give or take 0.5 Hz), 20" in said
    alone = outcome(write(tmp_path / "one.csv", {"t": S, "x": counted(swing(31.0, 2.6e-4) * (S > 2.0) - 1e-3 * S)}))
    assert "also swings" not in shown(make_report(alone), 600)


@pytest.mark.parametrize("frequency_Hz", [15.2, 15.5, 16.0])
def test_a_buzz_at_the_border_of_both_bands_is_told_once(tmp_path: Path, frequency_Hz: float) -> None:
    found = outcome(write(tmp_path / "border.csv", {"t": S, "x": swing(frequency_Hz, 5e-4)}))
    said = shown(make_report(found), 600)
    assert said.startswith("The recording buzzes")
    assert "also swings" not in said


def test_where_gaps_leave_only_short_parts_that_swing_that_no_buzz_was_seen_is_not_all_that_is_said(
    tmp_path: Path,
) -> None:
    swings = swing(83.0, 4e-4) * (S > 1.5)
    cut = [part for first in (1.4, 2.1, 2.8, 3.5) for part in (first, first + 0.04)]
    kept = ~((cut[0] < S) & (cut[1] > S) | (cut[2] < S) & (cut[3] > S) | (cut[4] < S) & (cut[5] > S))
    kept &= ~((cut[6] < S) & (cut[7] > S))
    said = shown(make_report(outcome(write(tmp_path / "gaps.csv", {"t": S[kept], "x": swings[kept]}))), 600)
    assert said.startswith("No swing above 15 Hz was seen")
    assert "Parts between gaps that last less than 1 s, 2.44 s in all, are too short to tell" in said
    whole = shown(make_report(outcome(write(tmp_path / "whole.csv", {"t": S, "x": 0.0 * S + 1e-4 * S}))), 600)
    assert "too short to tell" not in whole


@pytest.mark.slow
@pytest.mark.parametrize("dampings", [[], ["2"]])
def test_the_figure_marks_when_and_at_how_many_hertz_it_buzzes(tmp_path: Path, dampings: list[str]) -> None:
    x = swing(45.0, 3e-4) * (S < 1.5) + swing(110.0, 2e-4) * (S > 2.5)
    figure = make_figure(outcome(write(tmp_path / "turns.csv", {"t": S, "x": x}), dampings=dampings))
    bars = [(bar.get_x(), bar.get_x() + bar.get_width()) for bar in artists(figure, "buzz")]
    assert bars == [pytest.approx((0.0, 1.5), abs=0.2), pytest.approx((2.5, 4.0), abs=0.2)]
    hertz = [float(text.get_text().removesuffix(" Hz")) for text in artists(figure, "hertz")]
    assert hertz == pytest.approx([45.0, 110.0], abs=0.2)
    still = make_figure(outcome(write(tmp_path / "still.csv", {"t": S, "x": swing(8.0, 1e-3)}), dampings=dampings))
    assert not artists(still, "buzz")


def test_a_swing_as_slow_as_a_hands_is_told_as_what_it_is(tmp_path: Path) -> None:
    said = shown(
        make_report(outcome(write(tmp_path / "slow.csv", {"t": S, "x": swing(8.0, 1e-3)}), dampings=["2"])), 600
    )
    assert said.startswith("No swing above 15 Hz was seen")
    assert "It swings at 8.0 Hz (give or take 0.5 Hz), 2.00 mm peak to peak at most, from about 0.0 s to 4.0 s" in said
    assert "which a recording alone cannot tell apart" in said


def test_the_advised_low_pass_leaves_the_swing_of_the_motion_in(recording: Path, tmp_path: Path) -> None:
    notes = note_sentences(outcome(recording, masses=["0.01"]))
    assert any("acceleration.cutoff=93 or --set velocity.cutoff=93" in sentence for sentence in notes)
    fast = write(tmp_path / "fast.csv", {"t": S, "x": counted(swing(180.0, 1e-4))})
    assert any(
        "No low-pass of the estimates is suitable" in each for each in note_sentences(outcome(fast, masses=["0.01"]))
    )


@pytest.mark.parametrize(("cutoff", "is_told"), [("20", True), ("30", True), ("93", False)])
def test_a_low_pass_that_filters_the_swing_out_is_told(recording: Path, cutoff: str, is_told: bool) -> None:
    report = shown(make_report(outcome(recording, masses=["0.01"], overrides=[f"acceleration.cutoff={cutoff}"])), 200)
    assert (f"acceleration.cutoff = {cutoff} Hz is no more than the 31 Hz" in report) == is_told


def test_the_figure_has_the_hertz_of_the_sentence_also_of_a_buzz_that_beats(tmp_path: Path) -> None:
    found = outcome(write(tmp_path / "beat.csv", {"t": S, "x": swing(41.0, 1.5e-4) + swing(44.0, 1.2e-4)}))
    [hertz] = [text.get_text() for text in artists(make_figure(found), "hertz")]
    assert f"it swings at {hertz} (" in shown(make_report(found), 200)
