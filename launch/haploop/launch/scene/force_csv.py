"""Recorded hand forces: a CSV of time and force, read into lists."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path


class TraceError(ValueError):
    """A recording that cannot be used; the message is a full sentence."""


def read_trace(path: Path) -> tuple[list[float], list[float]]:
    """Times in s and forces in N from a CSV of two columns; a header line and empty lines may be there.

    Raises:
        TraceError: no such file, not text, or a line that is no pair of numbers, with its line number.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise TraceError(f"The recording must be UTF-8 text, but byte {error.start} is not.") from error
    except OSError as error:
        raise TraceError(f"The recording cannot be read: {error.strerror}.") from error
    numbers, times, forces = [], [], []
    for number, cells in enumerate(csv.reader(lines), start=1):
        if not any(cell.strip() for cell in cells):
            continue
        try:
            time, force = map(float, cells)
        except ValueError as error:
            if not times and len(cells) == 2 and not any(_is_number(cell) for cell in cells):
                continue  # the header
            line = ",".join(cells)
            raise TraceError(f"Line {number} must be a time in s and a force in N, but is {line!r}.") from error
        numbers.append(number)
        times.append(time)
        forces.append(force)
    if found := fault(times, forces):
        raise TraceError(f"Line {numbers[found[0]]}: {found[1]}" if numbers else found[1])
    return times, forces


def fault(times: Sequence[float], forces: Sequence[float]) -> tuple[int, str] | None:
    """Returns the first sample at which these are no function of time, and why; None when they are one."""
    if not times:
        return 0, "There must be at least one sample."
    if len(times) != len(forces):
        return min(len(times), len(forces)), f"There are {len(times)} times but {len(forces)} forces."
    for i, (time, force) in enumerate(zip(times, forces, strict=True)):
        if not abs(time) < float("inf") or not abs(force) < float("inf"):
            return i, "Time and force must be finite numbers."
        if i and time <= times[i - 1]:
            return i, f"The times must increase, but {time:g} s follows {times[i - 1]:g} s."
    return None


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
