"""Units of text recordings: found or given, and asked after where they can hardly be meant."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from haploop.launch.scene.reading.delimited import RecordingError
from haploop.launch.scene.units import name_and_unit
from haploop.tools.dissipate.recording.text_recording import Layout
from haploop.tools.dissipate.report import make_report, note_sentences
from helpers.data.recordings import T, X, outcome, true_J, write
from helpers.shown import shown


@pytest.mark.parametrize(
    ("columns", "layout"),
    [
        ({"t (ms)": T * 1e3, "x (mm)": X * 1e3}, Layout()),
        ({"t [ms]": T * 1e3, "x [um]": X * 1e6}, Layout()),
        ({"t_ms": T * 1e3, "Position_mm": X * 1e3}, Layout()),
        ({"t_us": T * 1e6, "tip_x_um": X * 1e6}, Layout(position="tip_x_um")),
        ({"t": T * 1e3, "x": X * 1e3}, Layout(length="mm", time_unit="ms")),
        ({"t": T, "x": X / 2.87e-5}, Layout(length="2.87e-5")),
        ({"t (s)": T, "x (mm)": X}, Layout(length="m")),
    ],
)
def test_units_come_from_the_header_or_are_given(
    plain: Path, tmp_path: Path, columns: dict[str, np.ndarray], layout: Layout
) -> None:
    path = write(tmp_path / "units.csv", columns)
    assert true_J(path, layout) == pytest.approx(true_J(plain), rel=1e-9)


@pytest.mark.parametrize(
    ("head", "unit"),
    [
        ("v_mm/s", "mm/s"),
        ("a_m/s^2", "m/s^2"),
        ("F_mN", "mN"),
        ("F_cN", "cN"),
        ("F_kgf", "kgf"),
        ("F_lbf", "lbf"),
        ("v_m_s", "m/s"),
        ("tip_v_mm_s", "mm/s"),
        ("a_mm_s2", "mm/s2"),
        ("x_mm_V", ""),
        ("x_mm_filtered", ""),
        ("x_M", ""),
        ("_m", ""),
    ],
)
def test_a_unit_after_an_underscore_is_one_unless_another_word_follows(head: str, unit: str) -> None:
    assert name_and_unit(head) == (head, unit)


def test_recorded_rates_have_the_units_of_the_lengths(tmp_path: Path) -> None:
    v, a = np.gradient(X, 1e-3), np.gradient(np.gradient(X, 1e-3), 1e-3)
    si = write(tmp_path / "si.csv", {"t": T, "x": X, "v": v, "a": a})
    mm = write(tmp_path / "mm.csv", {"t": T, "x": X * 1e3, "v (mm/s)": v * 1e3, "a": a * 1e3})
    layout = Layout(velocity="v", acceleration="a")
    selection: dict[str, Any] = {"dampings": ["1.0"], "masses": ["0.01"]}
    expected = [element.true_J for element in outcome(si, layout=layout, **selection).elements]
    in_mm = Layout(velocity="v", acceleration="a", length="mm", acceleration_unit="mm/s^2")
    found = outcome(mm, layout=in_mm, **selection)
    assert [element.true_J for element in found.elements] == pytest.approx(expected, rel=1e-9)
    assert found.recording.recorded == {"acceleration", "velocity"}


@pytest.mark.parametrize("name", ["t", "time", "Stamp"])
def test_times_far_apart_without_a_unit_are_asked_after(tmp_path: Path, name: str) -> None:
    path = write(tmp_path / "ticks.csv", {name: 1001.0 + np.arange(200.0), "x": X})
    layout = Layout(time=name)
    with pytest.raises(RecordingError, match=r"1001, 1002 and so on, seconds, milliseconds or microseconds\? Give"):
        outcome(path, layout=layout, dampings=["1.0"])
    broken_ms = write(tmp_path / "broken_ms.csv", {name: 1001.25 + np.arange(200.0), "x": X})
    with pytest.raises(RecordingError, match=r"1001\.25, 1002\.25 and so on, seconds, milliseconds"):
        outcome(broken_ms, layout=layout, dampings=["1.0"])
    given = Layout(time=name, time_unit="ms")
    assert outcome(path, layout=given, dampings=["1.0"]).recording.period_s == pytest.approx(1e-3)
    seconds = write(tmp_path / "seconds.csv", {"time_s": 1001.0 + np.arange(200.0), "x": X})
    assert outcome(seconds, dampings=["1.0"]).recording.period_s == 1.0


def test_positions_too_far_apart_for_metres_are_asked_after_unless_a_unit_says_so(tmp_path: Path) -> None:
    columns = {"t": T, "position": X / np.ptp(X)}
    path = write(tmp_path / "mm.csv", {**columns, "position": 4.0 * columns["position"]})
    with pytest.raises(RecordingError, match=r"metres, millimetres or counts\? Give --unit m, mm or metres per count"):
        outcome(path, dampings=["1.0"])
    for unit in ("mm", "0.001"):
        assert not outcome(path, layout=Layout(length=unit), dampings=["1.0"]).recording.notes.remarks
    doubtful = write(tmp_path / "doubtful.csv", {**columns, "position": 0.5 * columns["position"]})
    assert any("taken as metres, 0.5 m" in words for words in note_sentences(outcome(doubtful, dampings=["1.0"])))
    named = write(tmp_path / "named.csv", {"t": T, "x_m": 0.5 * columns["position"]})
    assert not any("taken as metres" in words for words in note_sentences(outcome(named, dampings=["1.0"])))


F = 4.0 * np.sin(2.0 * np.pi * 15.0 * T)


@pytest.mark.parametrize(
    ("columns", "hardly"),
    [
        ({"t (s)": T, "x (m)": X, "F (N)": F}, []),
        ({"t (ms)": 1e3 * T, "x (mm)": 1e3 * X, "F (mN)": 1e3 * F}, []),
        ({"t (s)": T, "x (m)": 0.5 * np.sin(2.0 * T), "F (N)": F}, []),
        ({"t (s)": T, "x (m)": 1e3 * X, "F (N)": F}, ["moves 4.00 m in all", "moves at"]),
        ({"t (s)": T, "x (m)": 200 * X, "F (N)": F}, ["moves at"]),
        ({"t (s)": T, "x (mm)": X, "F (N)": F}, ["moves 4.00 µm in all"]),
        ({"t (s)": 1e3 * T, "x (m)": X, "F (N)": F}, ["samples 1.00 s apart"]),
        ({"t (ms)": T, "x (m)": X, "F (N)": F}, ["samples 1.00 µs apart"]),
        ({"t (s)": T, "x (m)": X, "F (mN)": F}, ["force of 4.00 mN at most"]),
        ({"t (s)": T, "x (m)": X, "F (N)": 1e3 * F}, ["force of 4.00 kN at most"]),
    ],
)
def test_a_unit_that_makes_of_the_numbers_what_no_device_does_is_asked_after(
    tmp_path: Path, columns: dict[str, np.ndarray], hardly: list[str]
) -> None:
    path = write(tmp_path / "declared.csv", columns)
    remarks = outcome(path, layout=Layout(force="F"), dampings=["1.0"]).recording.notes.remarks
    assert len(remarks) == len(hardly), remarks
    for words, remark in zip(hardly, remarks, strict=True):
        assert words in remark
        assert remark.startswith("Can this be right")


def test_a_unit_of_recorded_rates_is_asked_after_too(tmp_path: Path) -> None:
    columns = {"t": T, "x": X, "v (m/s)": 1e3 * np.gradient(X, 1e-3), "a (m/s^2)": np.full(200, 9810.0)}
    layout = Layout(velocity="v", acceleration="a")
    remarks = outcome(write(tmp_path / "rates.csv", columns), layout=layout, dampings=["1.0"]).recording.notes.remarks
    assert ["velocity of 188 m/s" in remarks[0], "acceleration of 9.81 km/s²" in remarks[1]] == [True, True], remarks


def test_counts_are_asked_what_one_of_them_is_and_it_may_have_a_unit(tmp_path: Path) -> None:
    path = write(tmp_path / "counts.csv", {"t (s)": T, "pos [counts]": X / 11e-6})
    with pytest.raises(
        RecordingError, match='Give --unit: a unit, or m per count, as a number or text such as "11 um"'
    ):
        outcome(path, dampings=["1"])
    with pytest.raises(RecordingError, match="A unit cannot be 0 m"):
        outcome(path, dampings=["1"], layout=Layout(length="0 um"))
    found = [
        outcome(path, dampings=["1"], layout=Layout(length=count)).elements[0].true_J
        for count in ("11e-6", "11 um", "45.056 mm / 4096")
    ]
    assert found[1:] == pytest.approx(2 * found[:1], rel=1e-12)


def test_a_mass_that_may_be_in_grams_is_asked_after(plain: Path) -> None:
    assert any("a mass without a unit is in kg" in words for words in note_sentences(outcome(plain, masses=["1.8"])))
    assert not any("without a unit" in words for words in note_sentences(outcome(plain, masses=["1.8 g"])))


def test_what_cannot_be_meant_is_said_before_anything_else(tmp_path: Path) -> None:
    doubtful = outcome(write(tmp_path / "metres.csv", {"t (s)": T, "x (m)": 1e3 * X}), dampings=["1.0"])
    assert shown(make_report(doubtful), 200).startswith("Can this be right: a device that moves 4.00 m in all?")
    meant = outcome(write(tmp_path / "mm.csv", {"t (s)": T, "x (mm)": 1e3 * X}), dampings=["1.0"])
    assert shown(make_report(meant), 200).splitlines()[1].startswith("mm.csv: damping")
