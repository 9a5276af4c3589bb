"""The data of a map: the verdict of every cell over all seeds, and the cells of each panel."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from itertools import islice, product
from typing import Any

import numpy as np

from haploop.logger.verdict.measures import OF_WINDOW
from haploop.tools.figure.data import FigureError
from haploop.tools.sweep.map.axis import Axis
from haploop.tools.sweep.table import JOINS, PROVISOS, ResolvedSweep

AMPLITUDE, WIDTH, STIFFNESS = "window.oscillation_m", "stability.width_m", "wall.stiffness"
NOT_RUN = -1
MOST_PANELS = 12
# By name, equally long: lists or NumPy arrays.
Columns = Mapping[str, Any]


class Verdict(IntEnum):
    """Verdicts, the worse later: a cell with several seeds shows the worst.

    A failed run says nothing, a swinging one says that it swings.
    """

    STEADY, NO_CONTACT, FAILED, UNDECIDED, LIMIT_CYCLE, GROWING, DIVERGED = range(7)


# Their words in the table of a sweep, by number.
VERDICTS = tuple(verdict.name.lower().replace("_", "-") for verdict in Verdict)
_LIKE = {of_window: verdict for verdict, of_window in OF_WINDOW.items()}


@dataclass(frozen=True)
class Cells:
    """The outcome of every combination of the axes' values; arrays have a dimension for each axis.

    Attributes:
        verdict: number of the worst verdict in ``VERDICTS``; NOT_RUN where there is none yet.
        amplitude_m: the widest swing among the seeds with that verdict; NaN where unknown.
        least_m: the least swing among all seeds.
        agree, seeds: how many seeds came to that verdict, and how many ran.
        row: a row of the table with that verdict; -1 for none.
        rests_on: whether the cell is steady, and the verdict of one of its runs has a proviso.
    """

    verdict: np.ndarray
    amplitude_m: np.ndarray
    least_m: np.ndarray
    agree: np.ndarray
    seeds: np.ndarray
    row: np.ndarray
    rests_on: np.ndarray

    def count(self) -> dict[int, int]:
        """Counts the cells of each verdict that occurs, the mildest first."""
        numbers, counts = np.unique(self.verdict[self.verdict != NOT_RUN], return_counts=True)
        return dict(zip(numbers.tolist(), counts.tolist(), strict=True))


@dataclass(frozen=True)
class Layout:
    """Numbers of the axes along x and y of a panel (y is None where it shows the amplitude), and of the others."""

    x: int
    y: int | None
    others: tuple[int, ...]

    @classmethod
    def from_axes(cls, axes: Sequence[Axis]) -> Layout:
        """Puts numbers along the map, the wall's stiffness upwards; names, or the shortest of three, make panels."""
        numeric = [number for number, axis in enumerate(axes) if not axis.names]
        if len(numeric) == 3:
            free = [number for number in numeric if axes[number].key != STIFFNESS]
            numeric.remove(min(free, key=lambda number: (len(axes[number].values), -number)))
        along = numeric or [*range(len(axes))][:2]
        if len(along) == 2 and axes[along[0]].key == STIFFNESS:
            along.reverse()
        others = tuple(number for number in range(len(axes)) if number not in along)
        return cls(along[0], along[1] if len(along) == 2 else None, others)

    def count(self, axes: Sequence[Axis]) -> int:
        """Counts the panels."""
        return math.prod(len(axes[number].values) for number in self.others)

    def panels(self, axes: Sequence[Axis], cells: Cells) -> Iterator[Panel]:
        """Yields as many of the first panels as are drawn."""
        turned = self.y is not None and self.y < self.x
        lengths = [range(len(axes[number].values)) for number in self.others]
        for fixed in islice(product(*lengths), MOST_PANELS):
            at = dict(zip(self.others, fixed, strict=True))
            where = tuple(at.get(number, slice(None)) for number in range(len(axes)))
            taken = [array[where] for array in vars(cells).values()]
            words = {axes[number].key: axes[number].word(index) for number, index in at.items()}
            full = ", ".join(f"{key} = {word}" for key, word in words.items())
            short = ", ".join(f"{key.rpartition('.')[2]} = {word}" for key, word in words.items())
            titles = full, short, ", ".join(words.values())
            yield Panel(titles, Cells(*(np.ascontiguousarray(array.T) if turned else array for array in taken)))


@dataclass(frozen=True)
class Panel:
    """A part of a sweep whose cells share the values of all axes but those along it.

    Attributes:
        titles: these values in words, in full and ever shorter; empty words where there are none.
        cells: of shape (x values, y values) or (x values,).
    """

    titles: tuple[str, ...]
    cells: Cells


@dataclass(frozen=True)
class MapData:
    """A sweep's table."""

    title: str
    base: str
    axes: tuple[Axis, ...]
    columns: Columns
    sweep: ResolvedSweep
    boundary: Columns

    @property
    def seeds(self) -> list[int]:
        return sorted({int(seed) for seed in self.columns.get("seed", [])})

    @property
    def verdicts(self) -> np.ndarray:
        return np.array([verdict_number(word) for word in self.columns["verdict"]], dtype=int)

    @property
    def has_edges(self) -> bool:
        """Tells whether this is a finished bisecting sweep, with axes beside that of the search."""
        return bool(self.boundary) and len(self.axes) > 1

    @property
    def has_amplitudes(self) -> bool:
        return AMPLITUDE in self.columns or WIDTH in self.columns

    def cells(self) -> Cells:
        """Returns all cells, the seeds of each taken together."""
        shape = tuple(len(axis.values) for axis in self.axes)
        worst = np.full(shape, NOT_RUN)
        amplitude, least = np.full(shape, math.nan), np.full(shape, math.inf)
        agree, seeds, first = np.zeros(shape, int), np.zeros(shape, int), np.full(shape, -1)
        verdicts, swings_m = self.verdicts, self.amplitudes_m()
        at = tuple(axis.indices(self.columns[axis.key]) for axis in self.axes)
        np.maximum.at(worst, at, verdicts)
        np.add.at(seeds, at, 1)
        shown = np.flatnonzero(verdicts == worst[at])
        at_shown = tuple(index[shown] for index in at)
        np.add.at(agree, at_shown, 1)
        first[at_shown] = shown
        np.fmax.at(amplitude, at_shown, swings_m[shown])
        np.fmin.at(least, at, swings_m)
        told = np.array([bool(self.provisos(row)) for row in range(len(verdicts))])
        rests_on = np.zeros(shape, bool)
        np.logical_or.at(rests_on, at, told & (verdicts == worst[at]) & (verdicts == Verdict.STEADY))
        least = np.where(np.isinf(least), math.nan, least)
        return Cells(worst, amplitude, least, agree, seeds, first, rests_on)

    @property
    def is_unpushed(self) -> bool:
        """Tells whether the verdicts are the cheap ones, of runs that were not pushed."""
        return self.sweep.get("base", {}).get("run", {}).get("verdict") == "window"

    def word(self, verdict: int) -> str:
        """Returns a verdict in words; where no run was pushed, what its window shows."""
        word = VERDICTS[verdict]
        return (OF_WINDOW.get(word, word) if self.is_unpushed else word).replace("-", " ")

    def provisos(self, row: int) -> list[str]:
        """Returns what the verdict of a row rests on, where that is recorded."""
        return list(filter(None, str(self.columns.get(PROVISOS, {row: ""})[row] or "").split(JOINS)))

    def amplitudes_m(self) -> np.ndarray:
        """Returns how far every row swings: for a limit cycle, what remains after a push where that is recorded.

        For all others, the oscillation at the end of the run; NaN where it is not known.
        """
        width_m = self._numbers(WIDTH)
        return np.where((self.verdicts == Verdict.LIMIT_CYCLE) & (width_m > 0.0), width_m, self._numbers(AMPLITUDE))

    def _numbers(self, name: str) -> np.ndarray:
        column = self.columns.get(name, [None] * len(self.columns["verdict"]))
        return np.array([math.nan if value is None else value for value in column], dtype=float)


def verdict_number(word: str | None) -> int:
    """Returns the place of a verdict in ``VERDICTS``, for a window's that of its like; a run without one failed."""
    word = _LIKE.get(word, word) if word else word
    return VERDICTS.index(word) if word in VERDICTS else Verdict.FAILED


def make_map_data(
    columns: Columns, units: Mapping[str, str], sweep: ResolvedSweep, boundary: Columns | None = None
) -> MapData:
    """Makes the data of a map from a sweep's table, its units and the table of its boundaries.

    Raises FigureError where there is no row, or no verdict was recorded.
    """
    if "verdict" not in columns:
        raise FigureError('A map shows verdicts, and this sweep recorded none; add "verdict" to its record.')
    if not len(columns["verdict"]):
        raise FigureError("The sweep has no finished cell yet, so there is nothing to draw.")
    if "bisect" in sweep and not boundary and len(sweep["axes"]) > 1:
        # The search is not finished; the values that it runs in between are no cells of a map.
        key = sweep["bisect"]["axis"]
        planned = np.flatnonzero(np.isin(np.asarray(columns[key], dtype=float), sweep["axes"][key])).tolist()
        columns = {name: [column[row] for row in planned] for name, column in columns.items()}
    axes = tuple(
        Axis.from_column(key, units.get(key, ""), columns[key], given if isinstance(given, list) else [])
        for key, given in sweep["axes"].items()
    )
    base = sweep.get("base", {}).get("title", "untitled scene")
    return MapData(sweep.get("title", base), base, axes, columns, sweep, boundary or {})
