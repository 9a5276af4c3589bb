"""For which readings a claim holds: shares by option of a choice, and by thirds of a number's range."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from haploop.tools.render.units import amount

Row = Mapping[str, Any]
# An option with fewer readings says nothing.
_FEWEST = 20


@dataclass(frozen=True)
class Space:
    """What readings are drawn from.

    Attributes:
        choices: options by key.
        bounds: of log-uniform draws, by key.
        labels: what each key is called; its unit, where it has one, in brackets at the end.
    """

    choices: Mapping[str, tuple[Any, ...]]
    bounds: Mapping[str, tuple[float, float]]
    labels: Mapping[str, str]

    def label(self, key: str) -> str:
        """What a key is called, without its unit."""
        return self._parts(key)[0]

    def value(self, key: str, value: Any) -> str:
        """A value of it as people read it: ``"0.6 ms"``."""
        if not isinstance(value, float):
            return str(value)
        unit = self._parts(key)[1]
        return amount(value, unit, 2).removesuffix(".0") if unit else f"{float(f'{value:.2g}'):g}"

    def _parts(self, key: str) -> tuple[str, str]:
        label, _, unit = self.labels.get(key, key).partition(" (")
        return label, unit.removesuffix(")")


@dataclass(frozen=True)
class Option:
    """One option of a dimension: both by name, and the readings that took it."""

    dimension: str
    name: str
    rows: Sequence[Row]

    def share(self, claim: str) -> float:
        """Of these readings, how many the claim holds for."""
        return share(self.rows, claim)

    def __str__(self) -> str:
        return f"{self.dimension}{' ' if self.name[:1].isdigit() else ': '}{self.name}"


def holds(row: Row, claim: str) -> bool:
    """Whether a claim holds for a reading: whether it falls short of it by nothing."""
    return row[claim] == 0.0


def share(rows: Sequence[Row], claim: str) -> float:
    """The share of readings that a claim holds for."""
    return float(np.mean([holds(row, claim) for row in rows])) if rows else math.nan


def options(rows: Sequence[Row], space: Space) -> list[Option]:
    """All options with enough readings: of the choices as they are, of the numbers by thirds of their range (in ln)."""
    found = [
        Option(space.label(key), space.value(key, name), [row for row in rows if row[key] == name])
        for key, names in space.choices.items()
        for name in names
    ]
    for key, (low, high) in space.bounds.items():
        edges = np.geomspace(low, high, 4)
        for first, last in pairwise(edges.tolist()):
            inside = [row for row in rows if first <= row[key] <= last]
            found.append(Option(space.label(key), f"{space.value(key, first)} to {space.value(key, last)}", inside))
    return [option for option in found if len(option.rows) >= _FEWEST]


@dataclass(frozen=True)
class Decider:
    """The dimension whose options differ most in how often a claim holds: its best and worst option."""

    best: Option
    worst: Option

    def gap(self, claim: str) -> float:
        """How much the shares differ."""
        return self.best.share(claim) - self.worst.share(claim)

    def said(self, claim: str) -> str:
        """In words: which option, and how often the claim holds with it and with the worst."""
        best, worst = percent(self.best.share(claim)), percent(self.worst.share(claim))
        return f"{self.best} {best}, {self.worst.name} {worst}"


def decider(found: Iterable[Option], claim: str) -> Decider | None:
    """What decides a claim most; None where nothing does."""
    by_dimension: dict[str, list[Option]] = {}
    for option in found:
        by_dimension.setdefault(option.dimension, []).append(option)
    deciders = [
        Decider(max(one, key=lambda option: option.share(claim)), min(one, key=lambda option: option.share(claim)))
        for one in by_dimension.values()
    ]
    most = max(deciders, key=lambda one: one.gap(claim), default=None)
    return most if most and most.gap(claim) > 0.0 else None


def never_together(rows: Sequence[Row], claims: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs of claims that each hold somewhere, and nowhere both."""
    table = np.array([[holds(row, name) for name in claims] for row in rows], bool)
    both = table.T.astype(int) @ table.astype(int)
    return [
        (first, second)
        for i, first in enumerate(claims)
        for j, second in enumerate(claims[:i])
        if not both[i, j] and both[i, i] and both[j, j]
    ]


def percent(value: float) -> str:
    """A share as people read it: never 0 or 100 for what is not none or all."""
    if math.isnan(value):
        return "–"
    if value in (0.0, 1.0):
        return f"{100 * value:.0f} %"
    if value < 0.001:
        return "<0.1 %"
    return f"{100 * value:.1f} %" if value < 0.0995 else f"{min(99.0, 100 * value):.0f} %"


def yes(row: Row, claim: str) -> str:
    """Whether a claim holds for a reading, in a word."""
    return "yes" if holds(row, claim) else "no"
