"""Snapshots of a history: the tables that a page draws, at a resolution that fits its width."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from haploop.view.draw.frame import Column, Table, column, encode
from haploop.view.draw.phase_plots import phase_plots
from haploop.view.store.history import TRUE, WALL_BOOK, History
from haploop.view.store.lod_series import LodSeries

# Rows per point of the page at most; beyond, the rows are summed up in so many buckets per point.
_ROWS_A_POINT, _BUCKETS_A_POINT = 3.0, 0.75
_ELEMENT = re.compile(r"element\.(\d+)\.(.*)")
_MAKING = re.compile(r"-\d+$")


@dataclass(frozen=True)
class Viewport:
    """The interval that a page shows, and its width.

    Attributes:
        span_s: length of the interval in simulated time, s; None for the whole run.
        points: about how many points fit side by side.
        end_s: end of the interval, s; None for the newest tick.
    """

    span_s: float | None = 2.0
    points: int = 1000
    end_s: float | None = None


# Columns of one series by name, each with its header entry.
Part = tuple[LodSeries, Mapping[str, Column]]


def snapshot(history: History, viewport: Viewport) -> bytes:
    """Returns everything a page shows as bytes, packed by :mod:`haploop.view.draw.frame`.

    Tables over time are position, force and energy; each row by row where the page has room for it, else as an envelope
    whose rows are the two extremes of consecutive buckets in the order in which they came. Then come the
    :mod:`haploop.view.draw.phase_plots`, row by row.
    """
    rate = history.time.control_rate
    from_tick, to_tick = _window(history, viewport)
    known_from = to_tick if history.first_tick is None else history.first_tick
    first, end = max(from_tick, known_from), min(to_tick, history.end_tick)
    tables = []
    if first < end:
        interval = _Interval(first, end, rate, viewport.points)
        parts = (_position(history), _force(history), _energy(history))
        tables = [table for part in parts if (table := interval.table(*part))]
        tables += phase_plots(history, first, end)
    return encode(from_tick / rate, to_tick / rate, tables)


def _window(history: History, viewport: Viewport) -> tuple[int, int]:
    """Returns the ticks shown, (first, end); at the start of a run the interval reaches beyond the newest tick."""
    rate = history.time.control_rate
    end = max(1, history.end_tick if viewport.end_s is None else math.ceil(viewport.end_s * rate))
    if viewport.span_s is None:
        return min(end - 1, history.first_tick or 0), end
    ticks = max(1, round(viewport.span_s * rate))
    first = max(0, end - ticks)
    return first, first + ticks


class _Interval:
    """Makes tables over time for some ticks, fit for a number of points."""

    def __init__(self, first: int, end: int, rate: int, points: int) -> None:
        self._first, self._end, self._rate, self._points = first, end, rate, points

    def table(self, name: str, parts: list[Part], is_shown: Callable[[Column, np.ndarray], bool]) -> Table | None:
        """Returns a table of columns of some series, the first of which has the most rows a tick; None for no column.

        Args:
            parts: per series, column -> its header entry.
            is_shown: whether a column is worth showing, from its values in these ticks.
        """
        all_series, most = [series for series, _ in parts], parts[0][0].rows_per_tick
        in_full = all(series.full_from_tick <= self._first for series in all_series)
        if in_full and (self._end - self._first) * most <= _ROWS_A_POINT * self._points:
            first, step = float(self._first), 1.0 / most
            values = [self._rows(series, list(columns), most) for series, columns in parts]
        else:
            in_full, bucket = False, self._bucket(all_series)
            begins = all_series[0].aligned(self._first, bucket)
            ends = self._end + (begins - self._end) % bucket
            values = [series.envelope(list(columns), begins, ends, bucket) for series, columns in parts]
            first, step = begins + bucket / 4.0, bucket / 2.0
        table, columns = np.concatenate(values), [known for _, columns in parts for known in columns.values()]
        shown = [i for i, known in enumerate(columns) if is_shown(known, table[i])]
        if not shown:
            return None
        columns = [columns[i] for i in shown]
        return Table(name, first / self._rate, step / self._rate, columns, table[shown], envelope=not in_full)

    def _rows(self, series: LodSeries, names: list[str], rows_per_tick: int) -> np.ndarray:
        rows = series.rows(names, self._first, self._end)
        return np.repeat(rows, rows_per_tick // series.rows_per_tick, axis=1)

    def _bucket(self, all_series: list[LodSeries]) -> int:
        """Returns the ticks of a bucket: the least power of two that leaves no more buckets than there is room for."""
        room = _BUCKETS_A_POINT * self._points
        bucket = 1 << max(0, math.ceil(math.log2((self._end - self._first) / room)))
        for series in all_series * 2:  # what is coarse enough for one may begin too early for another
            bucket = series.bucket_from(self._first, bucket)
        return bucket


def _position(history: History) -> tuple[str, list[Part], Callable[[Column, np.ndarray], bool]]:
    bodies = {"x": "position", "tip_x": "position of the tip", "hand_x": "position of the hand"}
    moving = {name: column(name, "m", label) for name, label in bodies.items() if name in history.steps.names}
    measured = {
        "wall_position": column("wall", "m", "wall"),
        "x_measured": column("x_measured", "m", "measured position"),
    }
    return "position", [(history.steps, moving), (history.ticks, measured)], _always


def _force(history: History) -> tuple[str, list[Part], Callable[[Column, np.ndarray], bool]]:
    """Lists wall, elements by place and total, each shown where it has values in the interval."""
    columns = {"wall": column("wall", "N", "wall")} if history.inward else {}
    elements = [(match, name) for name in history.ticks.names if (match := _ELEMENT.fullmatch(name))]
    for match, name in sorted(elements, key=lambda element: int(element[0][1])):
        columns[name] = column(name, "N", f"element {match[1]}: {match[2]}")
    columns["total"] = column("total", "N", "total")
    return "force", [(history.ticks, columns)], _is_known


def _energy(history: History) -> tuple[str, list[Part], Callable[[Column, np.ndarray], bool]]:
    """Lists the books of the wall, of the elements at work, and of those whose energy changes in the interval."""
    columns = {WALL_BOOK: column("wall", "J", "wall")} if history.inward else {}
    books = [name.removesuffix(TRUE) for name in history.energy.names if name.endswith(TRUE) and name != WALL_BOOK]
    columns |= {f"{name}{TRUE}": column(name, "J", name) for name in books}
    columns["residual"] = column("residual", "J", "residual")
    always = {"wall", "residual", *_books_at_work(history, books)}

    def is_shown(known: Column, values: np.ndarray) -> bool:
        return _is_known(known, values) and (known["name"] in always or _changes(values))

    return "energy", [(history.energy, columns)], is_shown


def _books_at_work(history: History, books: list[str]) -> list[str]:
    """Returns the newest books of each kind, as many as elements of the kind are at work; the others are closed."""
    found: list[str] = []
    for element in history.elements:
        found += [name for name in books if name not in found and _MAKING.sub("", name) == element["kind"]][-1:]
    return found


def _always(_: Column, values: np.ndarray) -> bool:
    return True


def _is_known(_: Column, values: np.ndarray) -> bool:
    return bool(np.isfinite(values).any())


def _changes(values: np.ndarray) -> bool:
    known = values[np.isfinite(values)]
    return bool(len(known)) and bool(known.min() < known.max())
