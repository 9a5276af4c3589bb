"""The data of a map: the axes of a sweep, and the verdict of every cell over all seeds."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from haploop.launch.scene.toml_writer import inline
from haploop.tools.figure.data import FigureError
from haploop.tools.render.units import prefix_for
from haploop.tools.sweep.table import ResolvedSweep

AMPLITUDE, WIDTH, STIFFNESS = "window.oscillation_m", "stability.width_m", "wall.stiffness"
# The worse later: of several seeds a cell shows the worst. A failed run says nothing, a swinging one that it swings.
VERDICTS = ("steady", "no-contact", "failed", "undecided", "limit-cycle", "growing", "diverged")
STEADY, NO_CONTACT, FAILED, UNDECIDED, LIMIT_CYCLE, GROWING, DIVERGED = range(len(VERDICTS))
NOT_RUN = -1
# By name, equally long: lists or NumPy arrays.
Columns = Mapping[str, Any]
# Units that take a prefix; stiffness, damping and mass stay as scene files have them.
_WITH_PREFIX = ("m", "s", "N", "Hz")


def with_prefix(values: Iterable[float], unit: str) -> tuple[float, str]:
    """Returns the factor that suits some values, and the unit of what is left of them."""
    factor, letter = prefix_for(values) if unit in _WITH_PREFIX else (1.0, "")
    return factor, f"{letter}{unit}"


@dataclass(frozen=True)
class Axis:
    """An axis of a map.

    Attributes:
        values: ascending; the numbers 0, 1, ... where they stand for ``names``.
        names: of the values where they are no numbers, in the order of the sweep; else empty.
        planned: the values that the sweep asks for, ascending; a search runs others in between.
    """

    key: str
    unit: str
    values: np.ndarray
    names: tuple[str, ...] = ()
    planned: np.ndarray = field(default_factory=lambda: np.empty(0))

    @classmethod
    def from_column(cls, key: str, unit: str, column: Sequence[Any], planned: Sequence[Any] = ()) -> Axis:
        """Makes the axis of a column of the table; ``planned`` are values the sweep has, run or not."""
        given = [*planned, *column]
        if any(isinstance(value, str | bool | np.bool_ | list | dict) for value in given):
            names = tuple(dict.fromkeys(_name(value) for value in given))
            return cls(key, "", np.arange(len(names), dtype=float), names)
        values = np.unique(np.asarray(given, dtype=float))
        return cls(key, unit, values, (), np.unique(np.asarray(planned, dtype=float)) if len(planned) else values)

    def indices(self, column: Sequence[Any]) -> np.ndarray:
        """Returns the place of each entry of a column among the values."""
        if self.names:
            return np.array([self.names.index(_name(value)) for value in column], dtype=int)
        return np.searchsorted(self.values, np.asarray(column, dtype=float))

    def word(self, index: int) -> str:
        if self.names:
            return _short_name(self.names[index])
        factor, unit = with_prefix([self.values[index]], self.unit)
        return f"{short(self.values[index] / factor)} {unit}".strip()


@dataclass(frozen=True)
class Cells:
    """The outcome of every combination of the axes' values; arrays have a dimension for each axis.

    Attributes:
        verdict: number of the worst verdict in ``VERDICTS``; NOT_RUN where there is none yet.
        amplitude_m: the widest swing among the seeds with that verdict; NaN where unknown.
        least_m: the least swing among all seeds.
        agree, seeds: how many seeds came to that verdict, and how many ran.
        row: a row of the table with that verdict; -1 for none.
    """

    verdict: np.ndarray
    amplitude_m: np.ndarray
    least_m: np.ndarray
    agree: np.ndarray
    seeds: np.ndarray
    row: np.ndarray


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
        """Tells whether this is a bisecting sweep that is finished, over more than the axis of the search."""
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
        verdicts, oscillations = self.verdicts, self.amplitudes_m()
        at = tuple(axis.indices(self.columns[axis.key]) for axis in self.axes)
        np.maximum.at(worst, at, verdicts)
        np.add.at(seeds, at, 1)
        shown = np.flatnonzero(verdicts == worst[at])
        at_shown = tuple(index[shown] for index in at)
        np.add.at(agree, at_shown, 1)
        first[at_shown] = shown
        np.fmax.at(amplitude, at_shown, oscillations[shown])
        np.fmin.at(least, at, oscillations)
        return Cells(worst, amplitude, np.where(np.isinf(least), math.nan, least), agree, seeds, first)

    def amplitudes_m(self) -> np.ndarray:
        """Returns how far every row swings: a limit cycle by what remains of it after a push, where that is recorded.

        All else by the oscillation at the end of its run; NaN where it is not known.
        """
        width_m = self._numbers(WIDTH)
        return np.where((self.verdicts == LIMIT_CYCLE) & (width_m > 0.0), width_m, self._numbers(AMPLITUDE))

    def _numbers(self, name: str) -> np.ndarray:
        column = self.columns.get(name, [None] * len(self.columns["verdict"]))
        return np.array([math.nan if value is None else value for value in column], dtype=float)


def short(value: float) -> str:
    """Returns four digits or more, as many as a number has before its point."""
    return f"{value:.4g}" if abs(value) < 1e4 else f"{value:.7g}"


def _name(value: Any) -> str:
    """Returns a value that is no number as the table has it: text as it is, all else as TOML writes it."""
    if isinstance(value, str):
        return value
    return inline(bool(value) if isinstance(value, np.bool_) else value)


def _short_name(name: str) -> str:
    """Returns a name as people read it: a list of elements without its punctuation, ``"damping 0.8 + brake 0.1"``."""
    if not name.startswith("["):
        return name
    try:
        elements = tomllib.loads(f"list = {name}")["list"]
        words = [
            " ".join([table["kind"], *(f"{v:g}" for v in table.values() if isinstance(v, int | float))])
            for table in elements
        ]
    except (ValueError, TypeError, KeyError):
        return name
    return " + ".join(words) or "none"


def verdict_number(word: str | None) -> int:
    """Returns the place of a verdict in ``VERDICTS``; a run without a verdict failed."""
    return VERDICTS.index(word) if word in VERDICTS else FAILED


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
        # Of a search that goes on; what it runs in between is no cell of a map.
        key = sweep["bisect"]["axis"]
        planned = np.flatnonzero(np.isin(np.asarray(columns[key], dtype=float), sweep["axes"][key])).tolist()
        columns = {name: [column[row] for row in planned] for name, column in columns.items()}
    axes = tuple(
        Axis.from_column(key, units.get(key, ""), columns[key], given if isinstance(given, list) else [])
        for key, given in sweep["axes"].items()
    )
    base = sweep.get("base", {}).get("title", "untitled scene")
    return MapData(sweep.get("title", base), base, axes, columns, sweep, boundary or {})
