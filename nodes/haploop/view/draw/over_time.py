"""Tables over time, made for a number of points side by side: position, force, energy and own columns of elements."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import compress

import numpy as np

from haploop.view.draw.messages import Column, Table
from haploop.view.look.book_names import book_names, kind_of
from haploop.view.store.history import TRUE, WALL_BOOK, History
from haploop.view.store.lod_series import LodSeries

# Most rows per point of the page; if there are more, they are summarised in so many buckets per point.
_ROWS_A_POINT, _BUCKETS_A_POINT = 2.0, 1.0
# Number of parts of an overview of the run; number of units of own columns that are shown, the first ones.
_OVERVIEW_PARTS, _MOST_UNITS = 256, 3
_BODIES = {"x": "position", "tip_x": "tip", "hand_x": "hand"}
_MEASURED = {"wall_position": Column("wall", "m", "wall"), "x_measured": Column("x_measured", "m", "measured")}
# Columns of one series by name, each with its header entry.
Part = tuple[LodSeries, Mapping[str, Column]]
# Which columns are worth showing, as truth values, from their values in the interval, shape (columns, rows).
AreShown = Callable[[Sequence[Column], np.ndarray], np.ndarray]
# The plan of a table over time: its name, its parts, and which of its columns are shown.
Planned = tuple[str, list[Part], AreShown | None]


def are_there(_: Sequence[Column], values: np.ndarray) -> np.ndarray:
    return np.logical_or.reduce(np.isfinite(values), axis=1)


class Interval:
    """Makes tables over time of the ticks from ``first`` to before ``end``, for a number of points side by side."""

    def __init__(self, first: int, end: int, rate: int, points: int) -> None:
        self._first, self._end, self._rate, self._points = first, end, rate, points

    def table(self, name: str, parts: list[Part], are_shown: AreShown | None = None) -> Table | None:
        """Returns a table of columns of some series, the first with the most rows per tick; None without columns."""
        if not parts[0][1]:
            return None
        all_series, most = [series for series, _ in parts], parts[0][0].rows_per_tick
        wanted = [(series, tuple(columns)) for series, columns in parts]
        in_full = all(series.full_from_tick <= self._first for series in all_series)
        if in_full and (self._end - self._first) * most <= _ROWS_A_POINT * self._points:
            first, step = float(self._first), 1.0 / most
            values = [
                series.rows(names, self._first, self._end).repeat(most // series.rows_per_tick, axis=1)
                for series, names in wanted
            ]
        else:
            in_full, bucket = False, self._bucket(all_series)
            begins = all_series[0].aligned(self._first, bucket)
            ends = self._end + (begins - self._end) % bucket
            values = [series.envelope(names, begins, ends, bucket) for series, names in wanted]
            first, step = begins + bucket / 4.0, bucket / 2.0
        rows = np.concatenate(values) if len(values) > 1 else values[0]
        columns, last = [known for _, columns in parts for known in columns.values()], self._last(wanted)
        if are_shown and not (shown := are_shown(columns, rows)).all():
            if not shown.any():
                return None
            columns, rows, last = list(compress(columns, shown)), rows[shown], last[shown]
        return Table(name, first / self._rate, step / self._rate, columns, rows, not in_full, last.tolist())

    def _last(self, wanted: Sequence[tuple[LodSeries, Sequence[str]]]) -> np.ndarray:
        """Returns columns at the start of the newest tick that all series know; NaN where it is not held in full."""
        tick = min([self._end, *(series.end_tick for series, _ in wanted)]) - 1
        found = [series.rows(names, tick, tick + 1)[:, 0] for series, names in wanted]
        return np.concatenate(found) if len(found) > 1 else found[0]

    def _bucket(self, all_series: list[LodSeries]) -> int:
        """Returns the ticks of a bucket: the least power of two that gives no more buckets than there is room for."""
        room = _BUCKETS_A_POINT * self._points
        bucket = 1 << max(0, math.ceil(math.log2((self._end - self._first) / room)))
        for series in all_series * 2:  # what is coarse enough for one may begin too early for another
            bucket = series.bucket_from(self._first, bucket)
        return bucket


def _position(history: History) -> Planned:
    moving = {name: Column(name, "m", label) for name, label in _BODIES.items() if name in history.steps.names}
    return "position", [(history.steps, moving), (history.ticks, _MEASURED)], None


def _force(history: History) -> Planned:
    """Lists wall, elements by place and total, each shown where it has values in the interval."""
    columns = {"wall": Column("wall", "N", "wall")} if history.at_work.wall else {}
    for name, place, kind in sorted(by_place(history, "element"), key=lambda element: int(element[1])):
        columns[name] = Column(name, "N", f"element {place}: {kind}")
    columns["total"] = Column("total", "N", "total")
    return "force", [(history.ticks, columns)], are_there


def by_place(history: History, what: str) -> Iterator[tuple[str, str, str]]:
    """Yields name, place and kind of the columns ``<what>.<place>.<kind>``."""
    for name in history.ticks.names:
        if name.startswith(f"{what}."):
            _, place, kind = name.split(".", 2)
            yield name, place, kind


def _energy(history: History) -> Planned:
    """Lists the books of the wall, of the elements at work, and of those whose energy changes in the interval."""
    columns = {WALL_BOOK: Column("wall", "J", "wall")} if history.at_work.wall else {}
    books = [name.removesuffix(TRUE) for name in history.energy.names if name.endswith(TRUE) and name != WALL_BOOK]
    at_work, named = _books_at_work(history, books), book_names(history)
    columns |= {
        f"{name}{TRUE}": Column(name, "J", at_work.get(name, f"{named.get(name, 'earlier elements')}, closed"))
        for name in books
    }
    columns["residual"] = Column("residual", "J", "residual")
    always = {"wall", "residual", *at_work}
    is_kept = np.array([known.name in always for known in columns.values()])

    def are_shown(_: Sequence[Column], values: np.ndarray) -> np.ndarray:
        finite = np.where(np.isfinite(values), values, np.nan)
        least, greatest = np.fmin.reduce(finite, axis=1), np.fmax.reduce(finite, axis=1)
        return (least < greatest) | (is_kept & (least == greatest))

    return "energy", [(history.energy, columns)], are_shown


def _books_at_work(history: History, books: list[str]) -> dict[str, str]:
    """Returns the newest books of each kind, as many as its elements at work, each with the element's place and kind.

    The other books are closed.
    """
    elements = list(enumerate(history.at_work.elements))
    found: dict[str, str] = {}
    for kind in dict.fromkeys(element.name for _, element in elements):
        labels = [f"element {place}: {kind}" for place, element in elements if element.name == kind]
        own = [name for name in books if kind_of(name) == kind][-len(labels) :]
        found |= dict(zip(own, labels, strict=False))
    return found


def own_columns(history: History) -> list[Part]:
    """Returns what elements show besides their forces, a part for each of the first units."""
    units = dict.fromkeys(unit for unit, _ in history.own.values())
    return [
        (history.ticks, {name: Column(name, unit, label) for name, (its, label) in history.own.items() if its == unit})
        for unit in list(units)[:_MOST_UNITS]
    ]


def over_time(history: History, interval: Interval) -> list[Table | None]:
    """Returns position, force and energy."""
    return [interval.table(*planned(history)) for planned in (_position, _force, _energy)]


def overview(history: History) -> Table | None:
    """Returns the position over the whole run; None before anything of it is known."""
    first, end = history.first_tick or 0, history.steps.end_tick
    if first >= end:
        return None
    whole = Interval(first, end, history.time.control_rate, _OVERVIEW_PARTS)
    return whole.table("overview", [(history.steps, {"x": Column("x", "m", "position")})])


def laid_over(history: History, from_s: float, to_s: float, points: int) -> list[Table | None]:
    """Returns position and total force of another run in the same interval of its own simulated time."""
    rate = history.time.control_rate
    first, end = max(history.first_tick or 0, math.floor(from_s * rate)), min(history.end_tick, math.ceil(to_s * rate))
    if first >= end:
        return []
    interval = Interval(first, end, rate, points)
    x, total = {"x": Column("x", "m", "position")}, {"total": Column("total", "N", "total")}
    parts: list[tuple[str, Part]] = [("position", (history.steps, x)), ("force", (history.ticks, total))]
    return [interval.table(f"overlay_{name}", [part]) for name, part in parts]
