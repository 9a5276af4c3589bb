"""What stands above the numbers of a text recording: a title, a header, a row of units."""

from __future__ import annotations

from pathlib import Path

import pytest

from haploop.tools.dissipate.recording.delimited import DelimitedFile
from haploop.tools.dissipate.recording.samples import RecordingError
from helpers.data.recordings import T, X, outcome, true_J

ROWS = [f"{1e3 * t!r},{1e3 * x!r}" for t, x in zip(T.tolist(), X.tolist(), strict=True)]


def recorded(folder: Path, *above: str, rows: list[str] = ROWS, mark: str = ",") -> Path:
    """The plain recording in milliseconds and millimetres below other lines."""
    path = folder / "above.csv"
    path.write_text("\n".join([*above, *rows]).replace(",", mark))
    return path


@pytest.mark.parametrize("mark", [",", "\t", ";"])
@pytest.mark.parametrize(
    "above",
    [
        ("Time,Position", "ms,mm"),
        ("Time,Position", "(ms),[mm]"),
        ("t (ms),x", ",mm"),
        ("bench of Monday", "", "Time,Position", "ms,mm"),
        ("bench of Monday", "Time (ms),Position (mm)"),
        ("Recorder,bench,of Monday", "Separator,Comma", "t (ms),x (mm)"),
        ("# written by a scope", "t (ms),x (mm)"),
    ],
)
def test_a_title_is_left_out_and_a_row_of_units_read(
    plain: Path, tmp_path: Path, above: tuple[str, ...], mark: str
) -> None:
    assert true_J(recorded(tmp_path, *above, mark=mark)) == pytest.approx(true_J(plain), rel=1e-9)


def test_a_unit_in_the_header_stands_before_one_in_a_row_of_units(plain: Path, tmp_path: Path) -> None:
    assert true_J(recorded(tmp_path, "t (ms),x (mm)", "s,m")) == pytest.approx(true_J(plain), rel=1e-9)


def test_lines_of_a_title_are_counted_and_told(tmp_path: Path) -> None:
    path = recorded(tmp_path, "bench of Monday", "run of a wall", "t,x", "ms,mm")
    assert DelimitedFile(path).title == 2
    assert outcome(path, dampings=["1.0"]).recording.notes.remarks == ["Lines above the header, taken for a title: 2."]


@pytest.mark.parametrize("cell", ["", "NA", "-", "null"])
def test_a_first_row_without_a_number_is_no_header(tmp_path: Path, cell: str) -> None:
    """It is a row like any other: empty cells are unusable, other text is named with its line."""
    path = recorded(tmp_path, "t (ms),x (mm)", f"{cell},{cell}")
    if not cell:
        assert outcome(path, dampings=["1.0"]).recording.notes.unusable_rows == 1
        return
    with pytest.raises(RecordingError, match=f"Line 2 .* a number was expected in column x, not '{cell}'"):
        outcome(path, dampings=["1.0"])


def test_names_that_are_letters_of_units_stay_names_where_nothing_stands_above(tmp_path: Path) -> None:
    assert [column.name for column in DelimitedFile(recorded(tmp_path, "s,m")).columns] == ["s", "m"]
