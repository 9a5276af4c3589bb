"""Boundaries: where along an axis a loop stops being steady, for many loops at once.

Every row (all values but that on the axis) is first run at the same coarse points. The first two neighbours of which
one holds and the other does not enclose its boundary, which is then halved until it is known to the tolerance: the
rounds of all rows go together, one candidate of each, so that arrays stay full. A row may change more than once;
the changes seen at the coarse points are counted, and the first one counts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

Result = dict[str, Any]
Holds = Callable[[Result], bool | None]
# A candidate: the row, and the value on the axis.
Candidate = tuple[int, float]


@dataclass(frozen=True)
class Boundary:
    """What is known of one row.

    Attributes:
        near, far: the boundary lies between them: it holds at near and at every coarse point before, and not at far;
            NaN where there is none.
        changes: how often neighbouring coarse points differ.
        why: why there is no boundary, or why it is no narrower; else empty.
    """

    near: float
    far: float
    changes: int
    why: str = ""

    @property
    def low(self) -> float:
        """The lesser end of the bracket."""
        return min(self.near, self.far)

    @property
    def high(self) -> float:
        """The greater end."""
        return max(self.near, self.far)


@dataclass(frozen=True)
class Tolerance:
    """How narrow a bracket has to be: by this much, or by this fraction of its greater end."""

    absolute: float = 0.0
    relative: float = 0.0

    def met(self, near: float, far: float) -> bool:
        """Whether the bracket is narrow enough, or no number lies inside it."""
        width, size = abs(far - near), max(abs(near), abs(far))
        return width <= max(self.absolute, self.relative * size) or self.middle(near, far) in (near, far)

    def middle(self, near: float, far: float) -> float:
        """Halfway: in ratio where the tolerance is one and both ends have one sign, else in difference."""
        if self.relative and not self.absolute and near * far > 0.0:
            return math.copysign(math.sqrt(abs(near)) * math.sqrt(abs(far)), far)
        return near + (far - near) / 2.0


@dataclass
class _Row:
    """One row on its way."""

    seen: dict[float, bool | None] = field(default_factory=dict)
    reasons: dict[float, str] = field(default_factory=dict)
    bracket: tuple[float, float] | None = None
    why: str = ""


def boundaries(
    rows: int,
    points: Sequence[float],
    tolerance: Tolerance,
    run: Callable[[Sequence[Candidate]], Iterable[tuple[int, Result]]],
    holds: Holds,
    property: str = "steady",
) -> list[Boundary]:
    """Find the boundary of every row.

    Args:
        rows: how many.
        points: values on the axis, run for every row; the search goes from the first to the last.
        tolerance: of every boundary.
        run: runs candidates and yields the index of each with its result, in any order; one that it does not yield
            leaves its row unknown.
        holds: whether a result is on the near side; None where it tells nothing, as when the run failed.
        property: what holds, for the reasons.

    Raises:
        ValueError: there are fewer than two points, or they do not go one way.
    """
    ways = {(b > a) - (b < a) for a, b in pairwise(points)}
    if ways not in ({1}, {-1}):
        raise ValueError("A boundary is sought between at least two points that increase, or that decrease.")
    found = [_Row() for _ in range(rows)]
    _ask(found, [(row, point) for row in range(rows) for point in points], run, holds)
    for row in found:
        _bracket(row, points, property)
    while candidates := [
        (index, tolerance.middle(*row.bracket))
        for index, row in enumerate(found)
        if row.bracket and not row.why and not tolerance.met(*row.bracket)
    ]:
        _ask(found, candidates, run, holds)
        for index, middle in candidates:
            _halve(found[index], middle, property)
    return [_boundary(row, points) for row in found]


def _ask(
    found: list[_Row],
    candidates: Sequence[Candidate],
    run: Callable[[Sequence[Candidate]], Iterable[tuple[int, Result]]],
    holds: Holds,
) -> None:
    for place, result in run(candidates):
        index, value = candidates[place]
        found[index].seen[value] = holds(result)
        found[index].reasons[value] = result.get("why", "")


def _bracket(row: _Row, points: Sequence[float], property: str) -> None:
    """Where the first change is, or why there is none."""
    held = [point for point in points if row.seen.get(point)]
    for near, far in zip([None, *points], points, strict=False):
        if row.seen.get(far) is None:
            row.why = _unknown(row, far)
        elif row.seen[far]:
            continue
        elif near is None:
            beyond = f"but at {len(held)} of the other" if held else "nor at any of the other"
            row.why = f"not {property} at {far:g}, where the search begins, {beyond} {len(points) - 1} points"
        else:
            row.bracket = near, far
        return
    row.why = f"{property} at all {len(points)} points, {points[0]:g} to {points[-1]:g}"


def _halve(row: _Row, middle: float, property: str) -> None:
    assert row.bracket
    near, far = row.bracket
    held = row.seen.get(middle)
    if held is None:
        row.why = _unknown(row, middle)
    else:
        row.bracket = (middle, far) if held else (near, middle)


def _unknown(row: _Row, point: float) -> str:
    reason = row.reasons.get(point)
    return f"the run at {point:g} failed: {reason}" if reason else f"there is no run at {point:g}"


def _boundary(row: _Row, points: Sequence[float]) -> Boundary:
    changes = sum(bool(row.seen.get(a)) != bool(row.seen.get(b)) for a, b in pairwise(points))
    near, far = row.bracket or (math.nan, math.nan)
    return Boundary(near, far, changes, row.why)


def run_scenes(
    make: Callable[[int, float], dict[str, Any]],
    results: Callable[[Sequence[dict[str, Any]]], Iterable[tuple[int, Result]]],
) -> Callable[[Sequence[Candidate]], Iterable[tuple[int, Result]]]:
    """``run`` of ``boundaries`` from what makes the scene of a row and a value, and what runs scenes.

    ``results`` may be ``Pool.results``, or ``array_run.results_of`` with its kinds.
    """
    return lambda candidates: results([make(row, value) for row, value in candidates])


def holds_verdict(word: str = "steady") -> Holds:
    """Whether a run came to this verdict; a run that failed tells nothing."""
    return lambda result: result["verdict"] == word if "verdict" in result else None
