"""A recorded hand force: times and forces of a text file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from haploop.launch.scene.models import fault
from haploop.launch.scene.reading.delimited import FORCES, TIMES, Column, DelimitedFile, RecordingError
from haploop.launch.scene.units import scale_of
from haploop.protocol.files import MOST_BYTES, demand_regular

# No recording lasts as long, s: such times are those of a clock, which counts from 1970 or 1601.
_LONG_AGO_S = 1e8
_CLOCK_TIMES = (
    "The times in column {} of {} begin at {:.10g} s, as those of a clock do: subtract the first from all of them, "
    "for a run begins at 0."
)
_WHICH = "Which column of {path} is the {what}? Name it with {what}_column, by name or number. There are: {names}."


def read_trace(path: Path, time: str | None = None, force: str | None = None) -> tuple[list[float], list[float]]:
    """Returns times in s and forces in N of a text file of numbers, as ``DelimitedFile`` reads it.

    Units are those of the header, ``t (ms), force [mN]``; s and N where it has none. A column is found by its name,
    else by its unit, else in a file of two columns by its place.

    Args:
        time, force: names of the columns, or their numbers from 1; None for the ones that are found.

    Raises:
        RecordingError: no such file, not text, no such column or unit, or a line without two finite numbers.
    """
    try:
        demand_regular(path, MOST_BYTES)
    except OSError as error:
        raise RecordingError(f"The recording {path} cannot be read: {error.strerror}.") from error
    file = DelimitedFile(path, may_be_empty=False)
    columns = _columns(file, time, force)
    scales = [_scale(file, column, unit) for column, unit in zip(columns, ("s", "N"), strict=True)]
    blocks = [*file.blocks(columns)]
    times, forces = np.concatenate([table for table, _ in blocks] or [np.empty((0, 2))]).T * np.array(scales)[:, None]
    if len(times) and abs(times[0]) > _LONG_AGO_S:
        raise RecordingError(_CLOCK_TIMES.format(columns[0].name, path, times[0]))
    if found := fault(times.tolist(), forces.tolist()):
        lines = [line for _, numbers in blocks for line in numbers.tolist()]
        raise RecordingError(f"Line {lines[found[0]]:.0f}: {found[1]}" if lines else found[1])
    return times.tolist(), forces.tolist()


def told(path: Path, time: str | None = None, force: str | None = None) -> str:
    """Returns a sentence on the columns and units that ``read_trace`` reads; parameters and errors are its own."""
    columns = _columns(DelimitedFile(path, may_be_empty=False), time, force)
    words = [
        f"{what} from column {column.name} in {column.unit or f'{unit} (it names no unit)'}"
        for what, column, unit in zip(("times", "forces"), columns, ("s", "N"), strict=True)
    ]
    return f"The hand's force is read from {path}: {', '.join(words)}."


def _columns(file: DelimitedFile, time: str | None, force: str | None) -> list[Column]:
    columns = [_column(file, time, "time", TIMES, "s"), _column(file, force, "force", FORCES, "N")]
    if columns[0] == columns[1]:
        raise RecordingError(_WHICH.format(path=file.path, what="force", names=_names(file)))
    return columns


def _column(file: DelimitedFile, given: str | None, what: str, names: Sequence[str], unit: str) -> Column:
    if given is not None:
        return file.column(given, what)
    if found := file.find(names) or file.in_unit(unit):
        return found
    if len(file.columns) == 2:
        return file.columns[0 if what == "time" else 1]
    raise RecordingError(_WHICH.format(path=file.path, what=what, names=_names(file)))


def _names(file: DelimitedFile) -> str:
    return ", ".join(column.name for column in file.columns)


def _scale(file: DelimitedFile, column: Column, unit: str) -> float:
    try:
        return scale_of(column.unit, unit)
    except ValueError as error:
        raise RecordingError(f"Column {column.name} of {file.path}: {error}") from error
