"""Lines above the numbers of a text recording: a title, a header, a row of units."""

from __future__ import annotations

from pathlib import Path

import pytest

from haploop.launch.scene.reading.delimited import DelimitedFile, RecordingError
from haploop.tools.dissipate.recording.text_recording import Layout
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
        ("t / ms,x / mm",),
        ("bench of Monday", "", "Time,Position", "ms,mm"),
        ("bench of Monday", "Time (ms),Position (mm)"),
        ("Recorder,bench,of Monday", "Separator,Comma", "t (ms),x (mm)"),
        ("# written by a scope", "t (ms),x (mm)"),
        (*["# note"] * 60, "t (ms),x (mm)"),
        (*["# note"] * 60, "# t_ms,x_mm"),
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
    assert outcome(path, dampings=["1.0"]).recording.notes.remarks == ["Lines above the header, taken as a title: 2."]


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


@pytest.mark.parametrize("header", [("t (ms),x (mm)",), ()])
def test_a_row_of_more_cells_than_columns_is_refused_since_decimal_commas_would_be_read_as_columns(
    tmp_path: Path, header: tuple[str, ...]
) -> None:
    """With decimal commas between commas a buzz of half a millimetre was read as whole numbers that rest."""
    first = [*header, "0,0"]
    path = recorded(tmp_path, *first, "1,0,0120")
    with pytest.raises(RecordingError, match=rf"Line {len(first) + 1} .* has 3 cells, but 2 .* Decimal commas need"):
        outcome(path, layout=Layout("2", "1", time_unit="ms"), dampings=["1.0"])


def test_empty_cells_at_the_end_of_a_row_are_none(plain: Path, tmp_path: Path) -> None:
    path = recorded(tmp_path, "t (ms),x (mm)", rows=[f"{row},," for row in ROWS])
    assert true_J(path) == pytest.approx(true_J(plain), rel=1e-9)


@pytest.mark.parametrize("header", ["t (ms),position (mm),position (deg)", "t (ms),x (mm),position (mm)"])
def test_of_two_columns_that_may_be_the_position_it_asks_which(tmp_path: Path, header: str) -> None:
    path = recorded(tmp_path, header, rows=[f"{row},0" for row in ROWS])
    with pytest.raises(RecordingError, match=r"Which column of .* is the position, .* \(2\), .* \(3\)\?"):
        outcome(path, dampings=["1.0"])
    assert outcome(path, layout=Layout("2"), dampings=["1.0"]).recording.notes.rows == len(ROWS)


def test_columns_without_a_name_are_listed_by_their_numbers(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"There are: 1, 2, F\."):
        outcome(recorded(tmp_path, ",,F", rows=[f"{row},0" for row in ROWS]), dampings=["1.0"])


@pytest.mark.parametrize(("code", "named"), [("utf-16", "UTF-16"), ("cp1252", "CP1252")])
def test_the_command_that_turns_other_text_into_utf_8_names_the_code_it_is_in(
    tmp_path: Path, code: str, named: str
) -> None:
    path = tmp_path / "my run.csv"
    path.write_bytes("Zeit,Länge\n0,0\n".encode(code))
    with pytest.raises(RecordingError, match=f"iconv -f {named} -t UTF-8 'my run.csv'"):
        DelimitedFile(path)
