"""The answers of a map: how far each boundary reaches, and the stiffest wall that is steady."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from haploop.tools.render.units import spring
from haploop.tools.sweep.map.axis import Axis, with_unit
from haploop.tools.sweep.map.data import STIFFNESS, Cells, Columns, MapData, Verdict, verdict_number


class State(IntEnum):
    """Knowledge of a boundary: found, held at all points, not even where the search begins, or unknown."""

    FOUND, ALL_HOLD, NONE_HOLDS, UNKNOWN = range(4)


@dataclass(frozen=True)
class Edges:
    """The boundaries along one axis; arrays have a dimension for each of the ``others``.

    Attributes:
        along: the axis that was bisected, with its planned points.
        others: the other axes, that along x first; empty without any.
        holds: the verdict on the near side, in words.
        rising: whether the search went towards greater values.
        state: a ``State``; where seeds differ, that of the seed that holds least far.
        nearest: the last value at which the seed that holds least far was seen to hold.
        low, high: the brackets of all seeds together.
        more: how often a seed changed more than once at the planned points.
    """

    along: Axis
    others: tuple[Axis, ...]
    holds: str
    rising: bool
    state: np.ndarray
    nearest: np.ndarray
    low: np.ndarray
    high: np.ndarray
    more: int

    @property
    def reaches(self) -> str:
        return "up to" if self.rising else "down to"

    @property
    def begin(self) -> str:
        return self.along.word(0 if self.rising else -1)


def find_edges(data: MapData) -> Edges:
    """Finds the boundaries of a finished bisecting sweep, of several seeds together."""
    key, holds = data.sweep["bisect"]["axis"], data.sweep["bisect"].get("holds", "steady")
    along = next(axis for axis in data.axes if axis.key == key)
    along = replace(along, values=along.planned)
    others = [axis for axis in data.axes if axis.key != key]
    others.sort(key=lambda axis: (bool(axis.names), -len(axis.values)))
    first, *_, last = data.sweep["axes"][key]
    rising = last >= first
    shape = tuple(len(axis.values) for axis in others)
    # How far a seed holds, the least first: nowhere, unknown, found, everywhere.
    rank = np.full(shape, np.inf)
    state, nearest = np.full(shape, State.UNKNOWN), np.full(shape, math.nan)
    low, high = np.full(shape, math.nan), np.full(shape, math.nan)
    table, begin = data.boundary, np.flatnonzero(np.asarray(data.columns[key], dtype=float) == first)
    verdicts = [data.columns["verdict"][row] for row in begin.tolist()]
    starts = dict(zip(_places(data.columns, others, begin), verdicts, strict=True))
    for row, place in enumerate(_places(table, others, np.arange(len(table["low"])))):
        at, value, started = place[:-1], float(table["low" if rising else "high"][row]), starts.get(place)
        if math.isfinite(float(table["low"][row])):
            seen = State.FOUND
        elif verdict_number(started) == Verdict.FAILED:
            seen = State.UNKNOWN
        elif verdict_number(started) != verdict_number(holds):
            seen = State.NONE_HOLDS
        else:
            seen = State.ALL_HOLD if table["changes"][row] == 0 else State.UNKNOWN
        found = value if rising else -value
        least_far = {State.NONE_HOLDS: -math.inf, State.UNKNOWN: -1e300, State.FOUND: found, State.ALL_HOLD: 1e300}
        distance = least_far[seen]
        if distance < rank[at]:
            rank[at], state[at], nearest[at] = distance, seen, value if seen == State.FOUND else math.nan
        if seen == State.FOUND:
            low[at] = np.fmin(low[at], table["low"][row])
            high[at] = np.fmax(high[at], table["high"][row])
    more = int(np.sum(np.asarray(table["changes"]) > 1))
    word = data.word(verdict_number(holds))
    return Edges(
        along, tuple(others), f"“{word}”" if data.is_unpushed else word, rising, state, nearest, low, high, more
    )


def _places(table: Columns, axes: Sequence[Axis], rows: np.ndarray) -> list[tuple[int, ...]]:
    """Returns, for some rows, the indices on the axes and the seed."""
    seeds = table["seed"] if "seed" in table else [0] * len(table[axes[0].key])
    columns = [*(axis.indices(table[axis.key]) for axis in axes), seeds]
    return [tuple(int(column[row]) for column in columns) for row in rows]


@dataclass(frozen=True)
class Answer:
    """The combination that holds furthest.

    Attributes:
        index: its places on the axes that were searched.
        value: value up to which it holds.
        words: labels to write beside it, ever shorter.
        open_end: whether nothing beyond was tried with its other values.
    """

    index: tuple[int, ...]
    value: float
    words: tuple[str, ...]
    open_end: bool


def furthest(edges: Edges) -> Answer | None:
    """Finds what holds furthest from where the search begins; None where no boundary was found and nothing holds."""
    if (throughout := np.argwhere(edges.state == State.ALL_HOLD)).size:
        end = -1 if edges.rising else 0
        words = f"{edges.holds} {edges.reaches} {edges.along.word(end)} and perhaps beyond"
        middle = tuple(int(i) for i in throughout[len(throughout) // 2])
        return Answer(middle, float(edges.along.values[end]), (words,), open_end=True)
    found = edges.state == State.FOUND
    if not found.any():
        return None
    far = np.where(found, edges.nearest if edges.rising else -edges.nearest, -np.inf)
    index = tuple(int(i) for i in np.unravel_index(int(far.argmax()), far.shape))
    value = float(edges.nearest[index])
    told = with_unit(_towards(value, down=edges.rising), edges.along.unit)
    return Answer(index, value, (f"{edges.holds} {edges.reaches} {told}",), open_end=False)


def _towards(value: float, *, down: bool) -> float:
    """Returns a value rounded to four digits so that it does not go beyond the value itself."""
    if not value:
        return value
    step = 10.0 ** (math.floor(math.log10(abs(value))) - 3)
    # A value of no more than four digits stays the same in spite of rounding.
    steps = math.floor(value / step + 1e-6) if down else math.ceil(value / step - 1e-6)
    return float(f"{steps * step:.4g}")


def stiffest_steady(axes: Sequence[Axis], cells: Cells, steady_word: str = "steady") -> Answer | None:
    """Finds the stiffest steady wall below which every wall that was tried with the same other values is steady, too.

    Where several cells share it, the middle one of them is taken. None where the wall was not swept, or no softest wall
    is steady.
    """
    keys = [axis.key for axis in axes]
    if STIFFNESS not in keys:
        return None
    along = keys.index(STIFFNESS)
    verdict = np.moveaxis(cells.verdict, along, -1)
    steady = verdict == Verdict.STEADY
    held = np.logical_and.accumulate(steady | (verdict == Verdict.NO_CONTACT), axis=-1) & steady
    if not held.any():
        return None
    reached = np.where(held, np.arange(held.shape[-1]), -1).max(axis=-1)
    stiffest = int(reached.max())
    best = np.argwhere(reached == stiffest)
    others = tuple(int(index) for index in best[len(best) // 2])
    index = (*others[:along], stiffest, *others[along:])
    value = float(axes[along].values[stiffest])
    open_end, words = stiffest == held.shape[-1] - 1, spring(value)
    beyond, least = (" and perhaps beyond", "≥ ") if open_end else ("", "")
    return Answer(index, value, (f"{steady_word} up to {words}{beyond}", f"{least}{words}"), open_end)
