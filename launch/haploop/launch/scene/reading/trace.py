"""A recorded hand force: times and forces of a CSV file."""

from __future__ import annotations

import csv
from pathlib import Path

from haploop.launch.scene.models import fault
from haploop.launch.scene.units import is_number, name_and_unit, scale_of
from haploop.protocol.files import line_of, read_text


class TraceError(ValueError):
    """A recording that cannot be used; the message is a full sentence."""


def read_trace(path: Path) -> tuple[list[float], list[float]]:
    """Returns times in s and forces in N of a two-column CSV, which may have a header line and empty lines.

    Brackets in the header give units, ``t (ms), force [mN]``.

    Raises:
        TraceError: no such file, not text, no such unit, or a line that is not a pair of numbers, with its number.
    """
    try:
        rows = list(csv.reader(read_text(path).splitlines()))
    except UnicodeDecodeError as error:
        line = line_of(error)
        raise TraceError(f"The recording must be UTF-8 text, but line {line} is not; save it as UTF-8.") from error
    except OSError as error:
        raise TraceError(f"The recording cannot be read: {error.strerror}.") from error
    except csv.Error as error:
        raise TraceError("The recording must be lines of two numbers, but a cell is longer than any number.") from error
    numbers, times, forces = [], [], []
    scales = [1.0, 1.0]
    for number, cells in enumerate(rows, start=1):
        if not any(cell.strip() for cell in cells):
            continue
        try:
            time, force = map(float, cells)
        except ValueError as error:
            if not times and len(cells) == 2 and not any(map(is_number, cells)):
                scales = _units(number, cells)
                continue
            line = ",".join(cells)
            raise TraceError(f"Line {number} must be a time in s and a force in N, but is {line!r}.") from error
        numbers.append(number)
        times.append(time * scales[0])
        forces.append(force * scales[1])
    if found := fault(times, forces):
        raise TraceError(f"Line {numbers[found[0]]}: {found[1]}" if numbers else found[1])
    return times, forces


def _units(line: int, header: list[str]) -> list[float]:
    """Returns the factors that convert times and forces to s and N, by the units of a header."""
    try:
        return [scale_of(name_and_unit(head)[1], unit) for head, unit in zip(header, ("s", "N"), strict=True)]
    except ValueError as error:
        raise TraceError(f"Line {line}, the header of time and force: {error}") from error
