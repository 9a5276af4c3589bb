"""Recordings from text files: columns, units, period and gaps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from haploop.launch.scene.reading.delimited import FORCES, SECONDS, TIMES, Column, DelimitedFile, Floats, RecordingError
from haploop.launch.scene.units import scale_of
from haploop.tools.dissipate.recording.plausible import Largest
from haploop.tools.dissipate.recording.repeats import repeats
from haploop.tools.dissipate.recording.samples import Notes, Samples
from haploop.tools.dissipate.recording.stamps import ONE_MISSING, Flags, Stamps, is_late, stamps

# Names of a column of positions, which is looked for where none is given.
_POSITIONS = ("x", "position", "pos", "displacement")
_SORT = "sort its rows by time."
_TOO_FAST = "give the rate with --rate if samples came faster than their clock."
_FAR_APART_S = 0.1
# Periods between two samples above which there is a gap; relative deviation above which a period is uneven.
_GAP, _UNEVEN = 1.5, 0.1
# No quantity of a device is greater, in SI units.
_MOST = 1e10
# Spans of positions without a unit, m, above which the unit is asked for, or a remark says that they are taken for
# metres.
_FAR_M, _DOUBTFUL_M = 1.0, 0.1
# Shortest and longest period that is accepted.
_PERIODS_S = 1e-7, 1e3


@dataclass(frozen=True)
class Layout:
    """The columns to read, by names or numbers from 1, and their units; None for one to be looked for, or not there.

    Attributes:
        rate_Hz: samples a second, where there is no column of times.
        length: unit of the position, such as "mm", or metres per count.
    """

    position: str | None = None
    time: str | None = None
    rate_Hz: float | None = None
    velocity: str | None = None
    acceleration: str | None = None
    length: str | None = None
    time_unit: str | None = None
    velocity_unit: str | None = None
    acceleration_unit: str | None = None
    force: str | None = None
    force_unit: str | None = None


class TextRecording:
    """Reads samples from a text file, a control period apart; between them the device moves in straight lines.

    The period is that of the rate where one is given, else that of an even grid where the times are one apart from
    rounding, else the median of the periods at the beginning. Otherwise times matter only where samples are missing: a
    controller that counts its ticks does not notice how late each of them is.
    """

    between = "straight lines"

    def __init__(self, path: Path, layout: Layout, delay_s: float) -> None:
        """Finds the columns and the period.

        Raises RecordingError where a column, a unit or a rate is missing or wrong, or for fewer than two samples.
        """
        self.name, self.delay_s, self.notes = path.name, delay_s, Notes()
        self._file = file = DelimitedFile(path)
        self._rate_Hz = layout.rate_Hz
        self._columns, self._scales = self._choose(file, layout)
        if file.title:
            self.notes.remarks.append(f"Lines above the header, taken as a title: {file.title}.")
        self.has_force = "force" in self._columns
        # A force is read only where it is asked for: its sign and its hold are not in the file.
        if not self.has_force and (unread := file.find(FORCES)):
            self.notes.remarks.append(f"Column {unread.name} was not read: --force {unread.name} books its work.")
        self.recorded = frozenset(name for name in ("velocity", "acceleration") if name in self._columns)
        of = Stamps(1.0 / layout.rate_Hz) if layout.rate_Hz else self._stamps(layout.time_unit)
        self.period_s, self.notes.rounded_s = of.period_s, of.rounded_s
        # The velocity needs one sample before, the acceleration two; what was recorded needs none.
        self._unknown = 2 - len(self.recorded)
        place = self._columns["position"]
        self._in_metres = bool(layout.length or place.unit)
        self._reach_m = (np.inf, -np.inf)

    def _choose(self, file: DelimitedFile, layout: Layout) -> tuple[dict[str, Column], dict[str, float]]:
        asked = {
            "time": (layout.time, layout.time_unit, "s"),
            "position": (layout.position, layout.length, "m"),
            "velocity": (layout.velocity, layout.velocity_unit, "m/s"),
            "acceleration": (layout.acceleration, layout.acceleration_unit, "m/s^2"),
            "force": (layout.force, layout.force_unit, "N"),
        }
        columns = {what: file.column(name, what) for what, (name, *_) in asked.items() if name is not None}
        if "position" not in columns:
            columns["position"] = self._guessed(file, _POSITIONS, "position", "m")
        if layout.rate_Hz is None and "time" not in columns:
            columns["time"] = self._guessed(file, TIMES, "time", "s")
        if layout.rate_Hz is not None and "time" in columns:
            raise RecordingError("Give either the column of the time or the rate, not both.")
        scales = {}
        for what, column in columns.items():
            _, unit, si = asked[what]
            # The unit of such a column is not that of the position: an inertial sensor has its own.
            if layout.length and what in ("velocity", "acceleration") and not unit and not column.unit:
                raise RecordingError(
                    f"In which unit is the {what} in column {column.name}? --unit is for the position alone; "
                    f"give --{what}-unit, such as {si}."
                )
            try:
                scales[what] = scale_of(unit or column.unit, si)
            except ValueError as error:
                option = "--unit" if what == "position" else f"--{what}-unit"
                amount = "11 um" if what == "position" else f"0.1 {si}"
                raise RecordingError(
                    f"Column {column.name} of {file.path}: {error} "
                    f'Give {option}: a unit, or {si} per count, as a number or text such as "{amount}".'
                ) from error
        return columns, scales

    @staticmethod
    def _guessed(file: DelimitedFile, names: tuple[str, ...], what: str, unit: str) -> Column:
        found = file.all_of(names)
        if what == "position" and len(found) > 1:
            numbers = ", ".join(f"{column.name} ({column.index + 1})" for column in found)
            raise RecordingError(
                f"Which column of {file.path} is the position, {numbers}? Give its number with --position."
            )
        if column := found[0] if found else file.in_unit(unit):
            return column
        there = ", ".join(column.name for column in file.columns)
        instead = " or --rate" if what == "time" else ""
        raise RecordingError(
            f"Which column of {file.path} is the {what}? Name it with --{what}{instead}. There are: {there}."
        )

    def _stamps(self, unit: str | None) -> Stamps:
        block = next(self._rows(), None)
        if block is None or len(block[0]["time"]) < 2:
            raise RecordingError(f"{self._file.path} holds fewer than two samples.")
        periods = np.diff(block[0]["time"])
        period_s = float(np.median(periods))
        if period_s <= 0.0:
            advice = _SORT if np.any(periods < 0.0) else _TOO_FAST
            raise RecordingError(
                f"The times in column {self._columns['time'].name} of {self._file.path} do not increase; {advice}"
            )
        column, times = self._columns["time"], block[0]["time"]
        has_unit = unit or column.unit or column.name.strip().lower() == SECONDS
        if not has_unit and period_s >= _FAR_APART_S:
            raise RecordingError(
                f"Are the times in column {column.name} of {self._file.path}, {times[0]:g}, {times[1]:g} and so on, "
                "seconds, milliseconds or microseconds? Give --time-unit s, ms or us."
            )
        if not _PERIODS_S[0] <= period_s <= _PERIODS_S[1]:
            raise RecordingError(
                f"The samples are {period_s:g} s apart; is the unit of the time right? Give --time-unit."
            )
        return stamps(times, self._scales["time"])

    @property
    def _longest_s(self) -> float:
        """The longest step without a gap; rounding alone can lengthen one by the step of the rounding."""
        return max(_GAP * self.period_s, self.period_s + self.notes.rounded_s * (1.0 + _UNEVEN))

    def _lacks(self, steps: Floats) -> Flags:
        """Tells for each step between samples whether one is missing within it; on a rounded even grid none is late."""
        longer = steps > self._longest_s
        return longer if self.notes.rounded_s else longer & ~is_late(steps, self.period_s)

    @property
    def _uneven_s(self) -> float:
        return _UNEVEN * self.period_s + self.notes.rounded_s

    def samples(self) -> Iterator[Samples]:
        """Yields all samples, in pieces without a gap."""
        last_s: float | None = None
        largest = Largest(self.period_s)
        for columns, lines in self._rows():
            columns, lines = self._bridged(columns, lines)
            t = columns["time"]
            self._widen(columns["position"])
            steps = np.diff(t, prepend=t[:1] if last_s is None else last_s)
            self._refuse_disorder(t, steps, lines, last_s)
            is_gap = self._lacks(steps)
            is_gap[0] |= last_s is None
            self.notes.uneven += int((np.abs(steps[~is_gap] - self.period_s) > self._uneven_s).sum())
            for at in np.flatnonzero(is_gap):
                before = t[at - 1] if at else last_s
                if before is not None:
                    self.notes.gap(float(before), float(t[at]))
            starts = [0, *np.flatnonzero(is_gap[1:]) + 1, len(t)]
            for first, end in pairwise(starts):
                part = {name: column[first:end] for name, column in columns.items()}
                x, v, a, force = (part.get(name) for name in ("position", "velocity", "acceleration", "force"))
                assert x is not None
                self.notes.repeated += repeats(x)
                largest.add(part)
                begins = bool(is_gap[first])
                unknown = self._unknown if begins and (first or last_s is not None) else 0
                yield Samples(part["time"], x, v, a, x, None, begins, unknown=unknown, force_N=force)
            last_s = float(t[-1])
        if self.notes.rows < 2:
            raise RecordingError(f"{self._file.path} holds fewer than two samples.")
        self.notes.remarks += largest.remarks()
        low, high = self._reach_m
        if not self._in_metres and high - low > _DOUBTFUL_M:
            self.notes.remarks.append(
                f"Column {self._columns['position'].name} has no unit and is taken as metres, {high - low:.3g} m peak "
                "to peak; if it is not, give --unit, such as mm."
            )

    def _widen(self, x: Floats) -> None:
        """Keeps lowest and highest position; RecordingError where they can hardly be metres and no unit was named."""
        low, high = self._reach_m = min(self._reach_m[0], float(x.min())), max(self._reach_m[1], float(x.max()))
        if not self._in_metres and high - low > _FAR_M:
            raise RecordingError(
                f"Are the positions in column {self._columns['position'].name} of {self._file.path}, from {low:.6g} "
                f"to {high:.6g}, metres, millimetres or counts? Give --unit m, mm or metres per count, such as 30e-6."
            )

    def _rows(self) -> Iterator[tuple[dict[str, Floats], Floats]]:
        """Yields all usable rows: SI columns by quantity (time from the rate if given), and the line of each row."""
        names, row = list(self._columns), 0
        self.notes.rows = self.notes.unusable_rows = 0
        for table, lines in self._file.blocks(list(self._columns.values())):
            columns = {name: table[:, i] * self._scales[name] for i, name in enumerate(names)}
            if self._rate_Hz:
                columns["time"] = np.arange(row, row + len(table)) / self._rate_Hz
            row += len(table)
            self._refuse_huge(columns, lines)
            usable = np.isfinite(table).all(axis=1)
            self.notes.rows += int(usable.sum())
            self.notes.unusable_rows += int((~usable).sum())
            if usable.any():
                yield {name: column[usable] for name, column in columns.items()}, lines[usable]

    def _bridged(self, columns: dict[str, Floats], lines: Floats) -> tuple[dict[str, Floats], Floats]:
        """Returns the rows, with the mean of both neighbours inserted where a single one is missing between them."""
        steps = np.diff(columns["time"])
        at = np.flatnonzero(self._lacks(steps) & (steps < ONE_MISSING * self.period_s)) + 1
        self.notes.bridged += len(at)
        whole = {
            name: np.insert(column, at, column[at - 1] / 2.0 + column[at] / 2.0) for name, column in columns.items()
        }
        return whole, np.insert(lines, at, lines[at])

    def _refuse_huge(self, columns: dict[str, Floats], lines: Floats) -> None:
        for name, column in columns.items():
            for at in np.flatnonzero((np.abs(column) > _MOST) & (name != "time")):
                raise RecordingError(
                    f"Line {lines[at]:.0f} of {self._file.path}: no {name} of a device is {column[at]:.3g} in SI "
                    "units; give the unit that is meant."
                )

    def _refuse_disorder(self, t: Floats, steps: Floats, lines: Floats, last_s: float | None) -> None:
        wrong = np.flatnonzero(steps <= 0.0)
        wrong = wrong[wrong > 0] if last_s is None else wrong
        if len(wrong):
            at = int(wrong[0])
            before = t[at - 1] if at else last_s
            told = f"Line {lines[at]:.0f} of {self._file.path}: the times must increase, but {t[at]:.9g} s follows "
            if t[at] == before:
                count = int((steps[wrong] == 0.0).sum())
                raise RecordingError(
                    f"{told}itself ({count} such rows in this part of the file). Leave out rows that were written "
                    "twice; where the clock is coarser than the samples, give their rate with --rate."
                )
            raise RecordingError(
                f"{told}{before:.9g} s; sort the rows, or give the rate with --rate if they are in order."
            )
