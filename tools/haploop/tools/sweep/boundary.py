"""Boundaries along an axis of a sweep: where a loop stops being steady, for many rows at once.

Every row (all values but that on the axis) is first run at the same coarse points. The first two neighbours of which
one holds and the other does not enclose its boundary, which is then bisected; a round runs one value of every row, so
that arrays stay full. A row may change more than once: the changes at the coarse points are counted, and the first one
is the boundary.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from haploop.tools.search.bisect import Bracket, Tolerance, bisect_many, rungs_held
from haploop.tools.sweep.table import Row

Holds = Callable[[Row], bool | None]
_UNDECIDED = "undecided from {:g} to {:g}: too slow to tell in the time watched"
# A candidate: the row, and the value on the axis.
Candidate = tuple[int, float]
Run = Callable[[Sequence[Candidate]], Iterable[tuple[int, Row]]]


@dataclass(frozen=True)
class Boundary:
    """The boundary of one row.

    Attributes:
        near, far: the row holds at near and at every coarse point before, and not at far; NaN where there is no
            boundary.
        changes: how often neighbouring coarse points differ.
        why: why there is no boundary, or why its bracket is no narrower; else empty.
    """

    near: float
    far: float
    changes: int
    why: str = ""

    @property
    def low(self) -> float:
        return min(self.near, self.far)

    @property
    def high(self) -> float:
        return max(self.near, self.far)


def find_boundaries(
    rows: int, points: Sequence[float], tolerance: Tolerance, run: Run, holds: Holds, property: str = "steady"
) -> list[Boundary]:
    """Finds the boundary of every row.

    Args:
        points: values on the axis, run for every row; the search goes from the first to the last.
        run: runs candidates and yields the index of each with its row of the table, in any order; one that it does
            not yield leaves its boundary unknown.
        holds: whether a row of the table is on the near side; None where it shows nothing, as when the run failed.

    Raises:
        ValueError: there are fewer than two points, or they neither only rise nor only fall.
    """
    if {(b > a) - (b < a) for a, b in pairwise(points)} not in ({1}, {-1}):
        raise ValueError("A boundary is sought between at least two points that all increase or all decrease.")
    failures: dict[Candidate, str] = {}
    answered: dict[Candidate, bool | None] = {}
    why: dict[int, str] = {}

    def answers(candidates: Sequence[Candidate]) -> list[bool | None]:
        found: list[bool | None] = [None] * len(candidates)
        for place, result in run(candidates):
            found[place] = holds(result)
            answered[candidates[place]] = None if result.get("verdict") == "undecided" else found[place]
            if found[place] is None:
                failures[candidates[place]] = result.get("why", "")
        return found

    def unknown(row: int, point: float) -> str:
        reason = failures.get((row, point))
        return f"the run at {point:g} failed: {reason}" if reason else f"there is no run at {point:g}"

    def at_middles(middles: Mapping[int, float]) -> dict[int, bool | None]:
        found = dict(zip(middles, answers(list(middles.items())), strict=True))
        why.update({row: unknown(row, middles[row]) for row, holding in found.items() if holding is None})
        return found

    coarse = answers([(row, point) for row in range(rows) for point in points])
    held = [coarse[row * len(points) : (row + 1) * len(points)] for row in range(rows)]
    brackets: dict[int, Bracket] = {}
    for row in range(rows):
        count = rungs_held(held[row])
        if count == len(points):
            why[row] = f"{property} at all {len(points)} points, {points[0]:g} to {points[-1]:g}"
        elif held[row][count] is None:
            why[row] = unknown(row, points[count])
        elif count == 0:
            others = sum(map(bool, held[row]))
            beyond = f"but at {others} of the other" if others else "nor at any of the other"
            why[row] = f"not {property} at {points[0]:g}, where the search begins, {beyond} {len(points) - 1} points"
        else:
            brackets[row] = points[count - 1], points[count]
    brackets = bisect_many(brackets, at_middles, tolerance)
    for row, (near, far) in _beyond_undecided(brackets, points, answered, answers, tolerance).items():
        why[row] = _UNDECIDED.format(brackets[row][1], near)
        brackets[row] = brackets[row][0], far
    changes = [sum(bool(a) != bool(b) for a, b in pairwise(row)) for row in held]
    none = math.nan, math.nan
    return [Boundary(*brackets.get(row, none), changes[row], why.get(row, "")) for row in range(rows)]


def _beyond_undecided(
    brackets: Mapping[int, Bracket],
    points: Sequence[float],
    answered: Mapping[Candidate, bool | None],
    answers: Callable[[Sequence[Candidate]], object],
    tolerance: Tolerance,
) -> dict[int, Bracket]:
    """Returns, for each row whose far side is undecided, where that ends: the last value known so, and the next one.

    What the search has not decided up to the last point stays undecided up to there.
    """
    ahead = 1.0 if points[-1] > points[0] else -1.0
    ends: dict[int, Bracket] = {}
    for row, (_, far) in brackets.items():
        if answered.get((row, far), False) is not None:
            continue
        decided = [value for (of, value), told in answered.items() if of == row and told is False]
        beyond = [value for value in decided if (value - far) * ahead > 0.0]
        ends[row] = far, min(beyond, key=lambda value: abs(value - far), default=points[-1])

    def is_undecided(middles: Mapping[int, float]) -> dict[int, bool | None]:
        answers([*middles.items()])
        return {row: answered.get((row, middle), False) is not False for row, middle in middles.items()}

    return bisect_many(ends, is_undecided, tolerance)


def verdict_is(word: str = "steady") -> Holds:
    """Makes the test of a row for this verdict; it returns None for a run that failed.

    A row that is undecided does not hold, so that nothing is called steady that may not be.
    """
    return lambda row: row["verdict"] == word if row.get("verdict") else None
