"""From a history and a stretch of time to the tables a page draws."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping

import numpy as np

from haploop.view.draw.frame import encode
from haploop.view.draw.loops import loops
from haploop.view.draw.table import Column, Table, column
from haploop.view.serve.watch import Watch
from haploop.view.store.history import TRUE, WALL_BOOK, History
from haploop.view.store.lod_series import Track

# Rows for a point of the page at most; where there were more, buckets, for so many points each.
_ROWS_A_POINT, _BUCKETS_A_POINT = 3.0, 0.75
_ELEMENT = re.compile(r"element\.(\d+)\.(.*)")
_MAKING = re.compile(r"-\d+$")

# Columns of one track, each with how the page knows it.
Part = tuple[Track, Mapping[str, Column]]


def picture(history: History, watch: Watch) -> bytes:
    """All that a page shows, in one piece: see :mod:`haploop.view.draw.frame` for the form.

    Tables over time are position, force and energy; each row by row where the page has room for it, else as an envelope
    whose rows are the two extremes of consecutive buckets in the order in which they came. Then come the
    :mod:`haploop.view.draw.loops`, row by row.
    """
    rate = history.time.control_rate
    from_tick, to_tick = _window(history, watch)
    known_from = to_tick if history.first_tick is None else history.first_tick
    first, end = max(from_tick, known_from), min(to_tick, history.end_tick)
    tables = []
    if first < end:
        sight = _Sight(first, end, rate, watch.points)
        parts = (_position(history), _force(history), _energy(history))
        tables = [table for part in parts if (table := sight.table(*part))]
        tables += loops(history, first, end)
    return encode(from_tick / rate, to_tick / rate, tables)


def _window(history: History, watch: Watch) -> tuple[int, int]:
    """The last ticks there are, or those before the asked end; at the start of a run with room for what comes."""
    rate = history.time.control_rate
    end = max(1, history.end_tick if watch.end_s is None else math.ceil(watch.end_s * rate))
    if watch.span_s is None:
        return min(end - 1, history.first_tick or 0), end
    ticks = max(1, round(watch.span_s * rate))
    first = max(0, end - ticks)
    return first, first + ticks


class _Sight:
    """Some ticks, of which something is known, and room for so many points."""

    def __init__(self, first: int, end: int, rate: int, points: int) -> None:
        self._first, self._end, self._rate, self._points = first, end, rate, points

    def table(self, name: str, parts: list[Part], is_shown: Callable[[Column, np.ndarray], bool]) -> Table | None:
        """A table over time of columns of some tracks, the first of which has the most rows a tick.

        Args:
            parts: per track, column -> how the page knows it.
            is_shown: whether a column is worth showing, from its values in these ticks.
        """
        tracks, most = [track for track, _ in parts], parts[0][0].rows_per_tick
        in_full = all(track.full_from_tick <= self._first for track in tracks)
        if in_full and (self._end - self._first) * most <= _ROWS_A_POINT * self._points:
            first, step = float(self._first), 1.0 / most
            values = [self._rows(track, list(columns), most) for track, columns in parts]
        else:
            in_full, bucket = False, self._bucket(tracks)
            begins = tracks[0].aligned(self._first, bucket)
            ends = self._end + (begins - self._end) % bucket
            values = [track.envelope(list(columns), begins, ends, bucket) for track, columns in parts]
            first, step = begins + bucket / 4.0, bucket / 2.0
        table, columns = np.concatenate(values), [known for _, columns in parts for known in columns.values()]
        shown = [i for i, known in enumerate(columns) if is_shown(known, table[i])]
        if not shown:
            return None
        columns = [columns[i] for i in shown]
        return Table(name, first / self._rate, step / self._rate, columns, table[shown], envelope=not in_full)

    def _rows(self, track: Track, names: list[str], rows_per_tick: int) -> np.ndarray:
        rows = track.rows(names, self._first, self._end)
        return np.repeat(rows, rows_per_tick // track.rows_per_tick, axis=1)

    def _bucket(self, tracks: list[Track]) -> int:
        """Ticks of a bucket: the least power of two that leaves no more buckets than there is room for."""
        room = _BUCKETS_A_POINT * self._points
        bucket = 1 << max(0, math.ceil(math.log2((self._end - self._first) / room)))
        for track in tracks * 2:  # what is coarse enough for one may begin too early for another
            bucket = track.bucket_from(self._first, bucket)
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
    """The wall, the elements in the order of their places, their total; what was at work in the time shown."""
    columns = {"wall": column("wall", "N", "wall")} if history.into_wall else {}
    elements = [(match, name) for name in history.ticks.names if (match := _ELEMENT.fullmatch(name))]
    for match, name in sorted(elements, key=lambda element: int(element[0][1])):
        columns[name] = column(name, "N", f"element {match[1]}: {match[2]}")
    columns["total"] = column("total", "N", "total")
    return "force", [(history.ticks, columns)], _is_known


def _energy(history: History) -> tuple[str, list[Part], Callable[[Column, np.ndarray], bool]]:
    """The books of the wall, of the elements at work and of those whose energy changes in the time shown."""
    columns = {WALL_BOOK: column("wall", "J", "wall")} if history.into_wall else {}
    books = [name.removesuffix(TRUE) for name in history.energy.names if name.endswith(TRUE) and name != WALL_BOOK]
    columns |= {f"{name}{TRUE}": column(name, "J", name) for name in books}
    columns["residual"] = column("residual", "J", "residual")
    always = {"wall", "residual", *_books_at_work(history, books)}

    def is_shown(known: Column, values: np.ndarray) -> bool:
        return _is_known(known, values) and (known["name"] in always or _changes(values))

    return "energy", [(history.energy, columns)], is_shown


def _books_at_work(history: History, books: list[str]) -> list[str]:
    """The newest books of each kind, as many as elements of the kind are at work; the others are closed."""
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
