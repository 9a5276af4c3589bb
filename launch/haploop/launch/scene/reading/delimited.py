"""Text files of numbers: CSV, TSV or columns separated by blanks, of any length, read block by block.

The standard library's reader splits the cells: numpy.loadtxt neither pads a short row nor names the line of a mistake,
and pyarrow is an extra.
"""

from __future__ import annotations

import contextlib
import csv
import itertools
import shlex
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from haploop.launch.scene.units import has_dimension, is_number, is_unit, name_and_unit
from haploop.protocol.files import demand_regular
from haploop.protocol.names import nearest

Floats = NDArray[np.float64]

# The table begins within so many rows; so many below a number among words tell whether those are data.
_MOST_ABOVE, _BELOW = 50, 3
_BLOCK_ROWS = 16_384
# Names by which columns of times and forces are known; without a unit, times are seconds under the last.
SECONDS = "seconds"
TIMES, FORCES = ("t", "time", "timestamp", SECONDS), ("force", "f")
# First bytes of a text in that code.
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
# What a cell without a value may hold.
_MISSING = ("", "-", "--", "na", "n/a", "none", "null")


class RecordingError(ValueError):
    """Raised for a recording that cannot be used; the message says why and what to do."""


@dataclass(frozen=True)
class Column:
    """One column of a file: its index from 0, its name or number from 1, and its unit from the header."""

    index: int
    name: str
    unit: str


class DelimitedFile:
    """Reads text with one row per line; it may have title lines, a header, a row of units, lines that begin with #, and
    empty lines.

    The table begins with the first row of numbers, or the first with a number among words that three rows with
    numbers follow, or all there are: its cells are separated by tabs, semicolons, commas or blanks,
    whichever of these it contains first in this order. With semicolons a comma is taken for the decimal point. The row
    above is the header; where half of its cells are units and the row above that has as many cells, it holds the units
    and the row above it is the header. Anything above is a title.

    Attributes:
        columns: by the names of the header, or numbered from 1.
        title: number of lines above the header.
    """

    def __init__(self, path: Path, may_be_empty: bool = True) -> None:
        """Finds delimiter and columns from the beginning of the file; raises RecordingError without a file or a row.

        ``may_be_empty`` tells whether whoever reads it can leave out a row with an empty cell.
        """
        self.path, self._may_be_empty = path, may_be_empty
        with _open_lines(self.path) as lines:
            rows, comment = list[str](), ""
            for line in filter(str.strip, lines):
                if not line.startswith("#"):
                    rows.append(line)
                elif not rows:
                    comment = line
                if len(rows) == _MOST_ABOVE:
                    break
        if not rows:
            raise RecordingError(f"{path} is empty: a line for every sample was expected.")
        self._above, self._delimiter = next(
            (
                (above, _delimiter(row))
                for above, row in enumerate(rows)
                if _begins(row, rows[above + 1 : above + 1 + _BELOW])
            ),
            (1, _delimiter(rows[0])),
        )
        above = self._cells(rows[: self._above])
        while len(above) > 1 and all(cell.strip().lower() in _MISSING for cell in above[-1]):
            above.pop()  # a row that holds no number yet
        self._above = len(above)
        *titles, header = above or [[]]
        units: list[str] = []
        if titles and len(titles[-1]) == len(header) and 2 * sum(map(_is_unit, header)) >= len(header):
            units, header = [cell.strip(" ()[]") for cell in header], titles.pop()
        self.title = len(titles)
        if not self._above:
            cells = self._cells(rows[:1])[0]
            named = self._cells([comment.lstrip("# ")])[0] if comment else []
            header = named if len(named) == len(cells) else [str(i + 1) for i in range(len(cells))]
        named_units = [name_and_unit(cell) for cell in header]
        self.columns = [
            Column(index, name or str(index + 1), unit or (units[index] if units else ""))
            for index, (name, unit) in enumerate(named_units)
        ]

    def column(self, given: str, what: str) -> Column:
        """Returns the column of this name, or with this number from 1; a RecordingError names the nearest."""
        found = [c for c in self.columns if given.strip() in (c.name, f"{c.name} ({c.unit})", f"{c.name} [{c.unit}]")]
        found = found or [c for c in self.columns if c.name.lower() == given.strip().lower()]
        if not found and given.isdecimal() and 1 <= int(given) <= len(self.columns):
            found = [self.columns[int(given) - 1]]
        if len(found) > 1:
            raise RecordingError(
                f"{self.path} has {len(found)} columns {given!r}; give the {what} by its number from 1."
            )
        if not found:
            names = [c.name for c in self.columns]
            mean = f" Did you mean {hint}?" if (hint := nearest(given, names)) else ""
            raise RecordingError(
                f"There is no column {given!r} in {self.path} for the {what}.{mean} There are: {', '.join(names)}."
            )
        return found[0]

    def find(self, names: Sequence[str]) -> Column | None:
        """Returns the first column that has one of these names in any case; None if there is none."""
        return next(iter(self.all_of(names)), None)

    def in_unit(self, unit: str) -> Column | None:
        """Returns the only column in a unit of the dimension of this one; None if there is none, or another."""
        found = [column for column in self.columns if has_dimension(column.unit, unit)]
        return found[0] if len(found) == 1 else None

    def all_of(self, names: Sequence[str]) -> list[Column]:
        """Returns the columns that have one of these names, in any case and with or without ``_unit``, in order."""
        bare = {column: column.name.removesuffix(f"_{column.unit}").lower() for column in self.columns}
        return [column for name in names for column in self.columns if name in (bare[column], column.name.lower())]

    def blocks(self, columns: Sequence[Column]) -> Iterator[tuple[Floats, Floats]]:
        """Yields the numbers of these columns, shape (rows, columns), and the line of each row, shape (rows,).

        A cell that is empty, missing at the end of a line, or not finite is NaN.

        Raises:
            RecordingError: a cell is neither a number nor empty, or its quotes are not closed; the message names the
                line.
        """
        wanted = [column.index for column in columns]
        with _open_lines(self.path) as lines:
            numbered = ((n, line) for n, line in enumerate(lines, 1) if line.strip() and not line.startswith("#"))
            for _ in range(self._above):
                next(numbered)
            while chunk := list(itertools.islice(numbered, _BLOCK_ROWS)):
                rows = self._cells([line for _, line in chunk])
                if len(rows) != len(chunk):
                    line = next((n for n, line in chunk if line.count('"') % 2), chunk[0][0])
                    raise RecordingError(f"Line {line} of {self.path}: a quotation mark is not closed.")
                self._refuse_more_cells(rows, chunk)
                try:
                    table = np.array([[float(row[index]) for index in wanted] for row in rows])
                except (ValueError, IndexError):  # some cell is empty, missing, in other digits or no number
                    cells = zip(rows, (n for n, _ in chunk), strict=True)
                    table = np.array([[self._number(row, index, n) for index in wanted] for row, n in cells])
                table[~np.isfinite(table)] = np.nan
                yield table, np.array([float(n) for n, _ in chunk])

    def _refuse_more_cells(self, rows: Sequence[Sequence[str]], chunk: Sequence[tuple[int, str]]) -> None:
        """Refuses a row with more cells than columns: what follows would be read from the wrong column."""
        for row, (line, _) in zip(rows, chunk, strict=True):
            if len(row) > len(self.columns) and any(cell.strip() for cell in row[len(self.columns) :]):
                commas = " Decimal commas need semicolons, tabs or blanks between the cells." * (self._delimiter == ",")
                raise RecordingError(
                    f"Line {line} of {self.path} has {len(row)} cells, but {len(self.columns)} columns were expected."
                    f"{commas}"
                )

    def _number(self, cells: Sequence[str], index: int, line: int) -> float:
        text = self._number_text(cells[index]) if index < len(cells) else ""
        if not text:
            return np.nan
        try:
            return float(text)
        except ValueError:
            name = self.columns[index].name
            raise RecordingError(
                f"Line {line} of {self.path}: a number was expected in column {name}, not {cells[index].strip()!r}."
                f"{' Leave a cell without a value empty.' * self._may_be_empty}"
            ) from None

    def _number_text(self, cell: str) -> str:
        return _number_text(cell, self._delimiter)

    def _cells(self, lines: Iterable[str]) -> list[list[str]]:
        return _split(lines, self._delimiter)


def _delimiter(row: str) -> str | None:
    return next((mark for mark in "\t;," if mark in row), None)


def _split(lines: Iterable[str], delimiter: str | None) -> list[list[str]]:
    return [line.split() for line in lines] if delimiter is None else list(csv.reader(lines, delimiter=delimiter))


def _number_text(cell: str, delimiter: str | None) -> str:
    text = cell.strip()
    return text.replace(",", ".") if delimiter == ";" else text


def _begins(row: str, following: Sequence[str]) -> bool:
    """Tells whether a row begins the table: ``Recorded 2026`` above a header is a title."""
    numbers, cells = _numbers(row)
    return bool(numbers) and (numbers == cells or all(_numbers(line)[0] for line in following))


def _numbers(row: str) -> tuple[int, int]:
    """Returns how many cells of a row are numbers, and how many are not empty."""
    delimiter = _delimiter(row)
    cells = [cell for cell in _split([row], delimiter)[0] if cell.strip()]
    return sum(is_number(_number_text(cell, delimiter)) for cell in cells), len(cells)


def _is_unit(cell: str) -> bool:
    return is_unit(cell.strip(" ()[]"))


@contextlib.contextmanager
def _open_lines(path: Path) -> Iterator[Iterator[str]]:
    try:
        demand_regular(path)
        file = path.open(encoding="utf-8-sig", newline=None)
    except OSError as error:
        raise RecordingError(f"The recording {path} cannot be read: {error.strerror}.") from error
    with file:
        try:
            yield iter(file)
        except UnicodeDecodeError as error:
            with path.open("rb") as bytes_of:
                code = "UTF-16" if bytes_of.read(2) in _UTF_16 else "CP1252"
            raise RecordingError(
                f"The recording {path} must be UTF-8 text, which it is not; save it as such, or convert it: iconv "
                f"-f {code} -t UTF-8 {shlex.quote(path.name)} > other.csv."
            ) from error
        except csv.Error as error:
            raise RecordingError(f"The recording {path} is not a table: a cell is longer than any number.") from error
