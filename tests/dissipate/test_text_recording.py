"""Text recordings: columns, what is missing, what is out of order, and what is said about it."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from haploop.controller.dissipation import ElementError
from haploop.launch.scene.reading.delimited import RecordingError
from haploop.tools.dissipate.recording.text_recording import Layout, TextRecording
from haploop.tools.dissipate.report import note_sentences
from helpers.data.recordings import T, X, outcome, true_J, write


def test_columns_are_found_by_name_number_or_guess(plain: Path, tmp_path: Path) -> None:
    other = write(tmp_path / "other.csv", {"Stamp": T, "Handle": X, "noise": X * 7})
    expected = true_J(plain)
    for layout in (Layout("Handle", "Stamp"), Layout("handle", "stamp"), Layout("2", "1"), Layout("2", rate_Hz=1000.0)):
        assert true_J(other, layout) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("mark", [",", "\t", ";", " "])
def test_cells_may_be_set_apart_by_any_usual_mark(plain: Path, tmp_path: Path, mark: str) -> None:
    assert true_J(write(tmp_path / "marked.txt", {"t": T, "x": X}, mark)) == pytest.approx(true_J(plain), rel=1e-12)


def test_with_semicolons_a_comma_is_the_decimal_point(plain: Path, tmp_path: Path) -> None:
    rows = [f"{t!r};{x!r}".replace(".", ",") for t, x in zip(T.tolist(), X.tolist(), strict=True)]
    path = tmp_path / "german.csv"
    path.write_text("\n".join(["Zeit;Weg", *rows]), encoding="utf-8-sig")
    assert true_J(path, Layout("Weg", "Zeit")) == pytest.approx(true_J(plain), rel=1e-12)


@pytest.mark.parametrize("head", ["", "# t x\n", "# made by hand\n\n"])
def test_a_file_without_a_header_has_columns_by_number(plain: Path, tmp_path: Path, head: str) -> None:
    path = tmp_path / "bare.txt"
    path.write_text(head + "\n".join(f"{t!r} {x!r}" for t, x in zip(T.tolist(), X.tolist(), strict=True)))
    assert true_J(path, Layout("2", "1")) == pytest.approx(true_J(plain), rel=1e-12)
    if head.startswith("# t x"):
        assert true_J(path) == pytest.approx(true_J(plain), rel=1e-12)


def test_what_is_missing_is_a_gap_and_counted(tmp_path: Path) -> None:
    t, x = T.copy(), X.copy()
    x[50:52], x[60:62] = np.nan, np.inf
    keep = np.r_[0:100, 130:200]
    path = write(tmp_path / "gaps.csv", {"t": t[keep], "x": x[keep]})
    path.write_text(path.read_text().replace("nan", ""))
    notes = outcome(path, dampings=["1.0"]).recording.notes
    assert (notes.rows, notes.unusable_rows, notes.gaps, notes.bridged) == (166, 4, 3, 0)
    assert notes.missing_s == pytest.approx(3e-3 + 3e-3 + 31e-3)
    assert notes.gaps_s[2] == pytest.approx((0.099, 0.130))


def test_after_a_gap_no_force_is_booked_that_would_need_the_motion_within_it(tmp_path: Path) -> None:
    """A device at 0.1 m/s throughout: an estimate that starts at rest would book m v^2 for an inertia."""
    x = 0.1 * T
    kept = np.r_[0:80, 120:200]
    whole, gap = (
        write(tmp_path / "whole.csv", {"t": T, "x": x}),
        write(tmp_path / "gap.csv", {"t": T[kept], "x": x[kept]}),
    )
    inertia_J = [outcome(path, masses=["0.01"]).elements[0].true_J for path in (whole, gap)]
    assert inertia_J[1] == pytest.approx(inertia_J[0], abs=1e-9)
    damped_J = [true_J(path) for path in (whole, gap)]
    assert damped_J[1] == pytest.approx(damped_J[0] * (78 + 77) / 198, rel=1e-9)


def test_one_missing_sample_is_bridged_and_a_percent_of_them_changes_little(tmp_path: Path) -> None:
    whole = write(tmp_path / "whole.csv", {"t": T, "x": X})
    x = X.copy()
    x[[40, 77, 123]] = np.nan
    holes = write(tmp_path / "holes.csv", {"t": T, "x": x})
    notes = outcome(holes, masses=["0.01"]).recording.notes
    assert (notes.rows, notes.unusable_rows, notes.gaps, notes.bridged) == (197, 3, 0, 3)
    assert true_J(holes) == pytest.approx(true_J(whole), rel=0.02)
    by_rate = outcome(write(tmp_path / "x.csv", {"x": x}), layout=Layout(rate_Hz=1000.0), dampings=["2.7"])
    assert by_rate.elements[0].true_J == pytest.approx(true_J(holes), rel=1e-9)


def test_samples_that_repeat_in_mid_motion_are_counted_and_a_device_at_rest_is_not(tmp_path: Path) -> None:
    x = np.round(X / 1e-6) * 1e-6
    x[150:] = x[150]
    assert outcome(write(tmp_path / "once.csv", {"t": T, "x": x}), masses=["0.01"]).recording.notes.repeated == 0
    x[5:150:7] = x[4:149:7]
    found = outcome(write(tmp_path / "twice.csv", {"t": T, "x": x}), masses=["0.01"])
    assert 15 <= found.recording.notes.repeated <= 21
    assert any("repeat the one before" in sentence for sentence in note_sentences(found))


@pytest.mark.parametrize("period", [1.25, 2.0, 3.0])
def test_of_a_sensor_that_is_read_faster_than_it_measures_the_repeats_are_counted(
    tmp_path: Path, period: float
) -> None:
    t = np.arange(3000.0) * 1e-3
    measured_s = np.floor(np.arange(3000.0) / period + 1e-9) * period * 1e-3
    x = np.round(2e-3 * np.sin(2.0 * np.pi * 8.0 * measured_s) / 1e-6) * 1e-6
    found = outcome(write(tmp_path / "slow_sensor.csv", {"t": t, "x": x}))
    assert found.recording.notes.repeated > 0.5 * 3000.0 * (1.0 - 1.0 / period)


@pytest.mark.parametrize("frequency_Hz", [15.0, 41.0, 97.0])
def test_a_motion_that_is_rounded_where_it_turns_or_creeps_repeats_nothing(tmp_path: Path, frequency_Hz: float) -> None:
    t = np.arange(3000.0) * 1e-3
    for noise in (0.0, 0.5, 1.0):
        motion = 2.7e-4 * np.sin(2.0 * np.pi * frequency_Hz * t) + 2e-3 * np.sin(2.0 * np.pi * 0.7 * t)
        x = np.round(motion / 1e-5 + noise * np.random.default_rng(1).standard_normal(len(t))) * 1e-5
        assert outcome(write(tmp_path / "rounded.csv", {"t": t, "x": x})).recording.notes.repeated == 0


def test_uneven_times_are_counted_and_change_nothing(plain: Path, tmp_path: Path) -> None:
    t = T + 3e-4 * np.sin(np.arange(200.0) * 1.3)
    path = write(tmp_path / "uneven.csv", {"t": t, "x": X})
    found = outcome(path, layout=Layout(), dampings=["2.7"])
    assert found.recording.notes.uneven > 50
    assert found.recording.notes.gaps == 0
    even = true_J(plain)
    assert found.elements[0].true_J == pytest.approx(even * 1e-3 / found.recording.period_s, rel=1e-9)


def test_a_rate_need_be_no_whole_number_of_hertz(tmp_path: Path) -> None:
    period_s = 1.0 / 833.3
    path = write(tmp_path / "odd.csv", {"t": np.arange(200) * period_s, "x": X})
    found = outcome(path, dampings=["2.7"])
    assert found.recording.period_s == pytest.approx(period_s, rel=1e-9)
    by_hand = float(2.7 * np.diff(X)[:-1] @ np.diff(X)[1:]) / period_s
    assert found.elements[0].true_J == pytest.approx(by_hand, rel=1e-9)


def broken(tmp_path: Path, text: str | bytes, layout: Layout | None = None) -> str:
    path = tmp_path / "broken.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(RecordingError) as caught:
        outcome(path, layout=layout, dampings=["1.0"])
    sentence = str(caught.value)
    assert sentence.endswith(".")
    return sentence


@pytest.mark.parametrize(
    ("text", "layout", "words"),
    [
        ("", None, ["is empty"]),
        ("# only a comment\n\n", None, ["is empty"]),
        ("t,x\n", None, ["fewer than two samples"]),
        ("t,x\n0,0\n", None, ["fewer than two samples"]),
        ("t,x\n0,\n1,\n", None, ["fewer than two samples"]),
        ("t,x\n0,0\n0.001,0.1\n0.0005,0.2\n", None, ["Line 4", "must increase", "0.0005 s follows 0.001 s"]),
        ("t,x\n0,0\n0,0.1\n0,0.2\n", None, ["do not increase", "--rate"]),
        ("t,x\n0.002,0\n0.001,0.1\n0,0.2\n", None, ["do not increase", "sort its rows by time"]),
        ("t,x\n0,0\n0.001,much\n0.002,0\n", None, ["Line 3", "column x", "'much'"]),
        ("t,posn\n0,0\n1,1\n", Layout("position"), ["'position'", "Did you mean posn?", "There are: t, posn"]),
        ("t,y\n0,0\n1,1\n", None, ["Which column", "--position", "There are: t, y"]),
        ("a,x\n0,0\n1,1\n", None, ["is the time", "--time or --rate"]),
        ("t,x\n0,0\n1,1\n", Layout(time="t", rate_Hz=100.0), ["not both"]),
        ("t,x\n0,0\n1,1\n", Layout(length="parsec2"), ["'parsec2' is not a unit"]),
        ("t,x\n0,0\n1,1\n", Layout(length="s"), ["'s' is not a unit for numbers in m"]),
        ("t,x,a\n0,0,0\n1,1,0\n", Layout(acceleration="a", length="mm"), ["which unit", "--acceleration-unit"]),
        ("t,x,x\n0,0,0\n1,1,1\n", Layout("x"), ["2 columns 'x'", "by its number"]),
        ("t,x\n0,0\n1e-9,1\n2e-9,1\n", None, ["1e-09 s apart", "--time-unit"]),
        ("t,x\n0,0\n0.001,1e200\n0.002,0\n", None, ["Line 3", "position", "1e+200 in SI units", "give the unit"]),
        (b"\xff\xfet\x00,\x00x\x00\n\x00", None, ["UTF-8"]),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, text: str | bytes, layout: Layout | None, words: list[str]) -> None:
    sentence = broken(tmp_path, text, layout)
    assert all(word in sentence for word in words), sentence


@given(
    st.lists(
        st.lists(
            st.sampled_from(["0", "1", "2", "0.5", "-3", "nan", "inf", "", "x", "1e308", '"', "1,5", "1e999"]),
            max_size=4,
        ),
        max_size=8,
    ),
    st.sampled_from([",", ";", "\t", " "]),
    st.booleans(),
)
@example([["0.5", "1e308"], ["1", "1e308"], ["1", "0"]], ",", False)
@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_stands_in_a_file_it_is_booked_or_refused(
    tmp_path: Path, rows: list[list[str]], mark: str, has_header: bool
) -> None:
    lines = [mark.join(["t", "x", "v"])] * has_header + [mark.join(row) for row in rows]
    path = tmp_path / "any.csv"
    path.write_text("\n".join(lines))
    try:
        found = outcome(path, layout=Layout("2", "1"), dampings=["1.0"])
    except (RecordingError, ElementError):
        return
    assert found.recording.notes.rows >= 2


@pytest.mark.slow
def test_disorder_is_found_wherever_it_is(tmp_path: Path) -> None:
    t = np.arange(40_000) * 1e-3
    t[16_384] = t[16_383]  # the first of a block
    path = write(tmp_path / "late.csv", {"t": t, "x": np.zeros(40_000)})
    with pytest.raises(RecordingError, match="Line 16386 "):
        outcome(path, dampings=["1.0"])


def test_a_row_that_was_cut_off_at_the_end_is_left_out(plain: Path) -> None:
    last = plain.read_text().rindex(",")
    plain.write_text(plain.read_text()[:last])
    notes = outcome(plain, dampings=["1.0"]).recording.notes
    assert (notes.rows, notes.unusable_rows) == (199, 1)


@pytest.mark.slow
def test_memory_does_not_grow_with_the_recording(tmp_path: Path) -> None:
    peaks = []
    for rows in (20_000, 40_000):
        t = np.arange(rows) * 1e-3
        path = write(tmp_path / f"{rows}.csv", {"t": t, "x": np.sin(t * 50.0) * 1e-3})
        tracemalloc.start()
        outcome(path, dampings=["1.0"], masses=["0.01"])
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0]


@pytest.mark.slow
def test_the_whole_of_a_long_recording_is_in_the_line_that_is_drawn(tmp_path: Path) -> None:
    t = np.arange(60_000) * 1e-3
    x = np.sin(t * 3.0) * 1e-3
    x[34_567] = 0.5
    lines = outcome(write(tmp_path / "long.csv", {"t": t, "x": x}), dampings=["1.0"]).trace.lines()
    assert lines.shape[1] < 20_000
    assert lines[1].max() == 0.5
    assert lines[0, np.argmax(lines[1])] == pytest.approx(34.567, abs=0.05)
    assert (lines[0, 0], lines[0, -1]) == pytest.approx((0.0, 59.999))
    assert (np.diff(lines[0]) >= 0.0).all()


def test_the_period_is_the_median_of_the_first_periods(tmp_path: Path) -> None:
    t = np.cumsum(np.where(np.arange(300) % 50 == 49, 0.5, 2e-3))
    recording = TextRecording(write(tmp_path / "bursts.csv", {"t": t, "x": np.zeros(300)}), Layout(), 0.0)
    assert recording.period_s == pytest.approx(2e-3)
