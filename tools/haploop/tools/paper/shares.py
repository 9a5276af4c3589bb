"""For which readings a claim of Fig. 6 holds: shares by option of a choice, and by thirds of a number's range."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from haploop.tools.paper.reading import ABOUT, BOUNDS, CHOICES
from haploop.tools.paper.reading_runs import CLAIMS

Row = Mapping[str, Any]
# An option with fewer readings says nothing.
_FEWEST = 20


@dataclass(frozen=True)
class Option:
    """One option of a dimension: its name and the readings that took it."""

    dimension: str
    name: str
    rows: Sequence[Row]

    def share(self, claim: str) -> float:
        """Of these readings, how many the claim holds for."""
        return share(self.rows, claim)


def holds(row: Row, claim: str) -> bool:
    """Whether a claim holds for a reading; "all" for all of them."""
    return all(row[one] == 0.0 for one in CLAIMS) if claim == "all" else row[claim] == 0.0


def share(rows: Sequence[Row], claim: str) -> float:
    """The share of readings that a claim holds for."""
    return float(np.mean([holds(row, claim) for row in rows])) if rows else math.nan


def options(rows: Sequence[Row]) -> list[Option]:
    """All options with enough readings: of the choices as they are, of the numbers by thirds of their range (in ln)."""
    found = [
        Option(key, str(name), [row for row in rows if row[key] == name])
        for key, names in CHOICES.items()
        for name in names
    ]
    for key, (low, high) in BOUNDS.items():
        edges = np.geomspace(low, high, 4)
        for first, last in pairwise(edges.tolist()):
            inside = [row for row in rows if first <= row[key] <= last]
            found.append(Option(key, f"{_two_digits(first)} to {_two_digits(last)}", inside))
    return [option for option in found if len(option.rows) >= _FEWEST]


def _two_digits(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}"


@dataclass(frozen=True)
class Decider:
    """The dimension whose options differ most in how often a claim holds: its best and worst option."""

    best: Option
    worst: Option

    def gap(self, claim: str) -> float:
        """How much the shares differ."""
        return self.best.share(claim) - self.worst.share(claim)


def decider(found: Iterable[Option], claim: str) -> Decider | None:
    """What decides a claim most; None where there is nothing to compare."""
    by_dimension: dict[str, list[Option]] = {}
    for option in found:
        by_dimension.setdefault(option.dimension, []).append(option)
    deciders = [
        Decider(max(one, key=lambda option: option.share(claim)), min(one, key=lambda option: option.share(claim)))
        for one in by_dimension.values()
    ]
    return max(deciders, key=lambda one: one.gap(claim), default=None)


def never_together(rows: Sequence[Row]) -> list[tuple[str, str]]:
    """Pairs of claims that each hold somewhere, and nowhere both."""
    names = list(CLAIMS)
    table = np.array([[holds(row, name) for name in names] for row in rows], bool)
    both = table.T.astype(int) @ table.astype(int)
    return [
        (first, second)
        for i, first in enumerate(names)
        for j, second in enumerate(names[:i])
        if not both[i, j] and both[i, i] and both[j, j]
    ]


def percent(value: float) -> str:
    """A share as people read it: never 0 or 100 for what is not none or all."""
    if value in (0.0, 1.0) or math.isnan(value):
        return "–" if math.isnan(value) else f"{100 * value:.0f} %"
    return (
        f"{100 * value:.1f} %"
        if 0.001 <= value < 0.0995
        else "<0.1 %"
        if value < 0.001
        else f"{min(99.0, 100 * value):.0f} %"
    )


def plain(dimension: str) -> str:
    """What a dimension is called, with its unit."""
    return ABOUT[dimension][0] if dimension in ABOUT else dimension


def yes(row: Row, claim: str) -> str:
    """Whether a claim holds for a reading, in a word."""
    return "yes" if holds(row, claim) else "no"
