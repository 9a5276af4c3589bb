"""Interpretations of a paper: one choice for everything that it leaves open, and for which of them its claims hold.

A table of interpretations has a row each: its choices and numbers by key, and by name of each claim how far it falls
short of it, 0.0 where the claim holds; ``all``, ``holding`` and ``distance`` sum that up (``summed_up``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from operator import itemgetter
from types import MappingProxyType
from typing import Any, Generic, NamedTuple, Self, TypeVar

import numpy as np

from haploop.tools.render.units import amount
from haploop.tools.search import random
from haploop.tools.search.intervals import Interval, share_interval
from haploop.tools.search.random import Effort, Evaluate, Group, Point, Row, Space, random_search
from haploop.tools.studies.choi2022.claims import words_of
from haploop.tools.studies.choi2022.work import Work

Nearest = TypeVar("Nearest")
SEED = 2022
# An option with fewer interpretations says nothing.
_FEWEST = 20
# What falls short of a claim counts for no more than this: a factor of 20.
MOST = 3.0


@dataclass(frozen=True, kw_only=True)
class InterpretationSpace(Space):
    """The space that interpretations are drawn from, with what people call its choices and numbers.

    Attributes:
        labels: by key; the unit, where there is one, in brackets at the end.
        ours: our own interpretation, where there is one.
        whys: why the bounds of a number are as they are.
    """

    labels: Mapping[str, str]
    ours: Point
    whys: Mapping[str, str]

    @classmethod
    def from_words(cls, figure: int, labels: Mapping[str, str] = MappingProxyType({}), **options: Any) -> Self:
        """Makes the space of a figure of its tables ``choices`` and ``numbers``, labels of other values besides."""
        choices, numbers = words_of(figure, "choices"), words_of(figure, "numbers")
        return cls(
            choices={key: tuple(one["options"]) for key, one in choices.items()},
            bounds={key: (one["from"], one["to"]) for key, one in numbers.items()},
            labels={key: one["label"] for key, one in (choices | numbers).items()} | dict(labels),
            ours=Point(*({key: one.get("ours") for key, one in of.items()} for of in (choices, numbers)), seed=1),
            whys={key: one.get("why", "") for key, one in numbers.items()},
            **options,
        )

    def label(self, key: str) -> str:
        """Returns what a key is called, without its unit."""
        return self.labels.get(key, key).partition(" (")[0]

    def value(self, key: str, value: Any) -> str:
        """Returns a value with its unit: ``"0.6 ms"``."""
        if not isinstance(value, float):
            return str(value)
        unit = self.labels.get(key, key).partition(" (")[2].removesuffix(")")
        return amount(value, unit, 2).removesuffix(".0") if unit else f"{float(f'{value:.2g}'):g}"

    def describe(self, values: Row, keys: Iterable[str]) -> str:
        """Returns labels and values of some keys in one line."""
        return ", ".join(f"{self.label(key)} {self.value(key, values[key])}" for key in keys)


@dataclass(frozen=True)
class Found(Generic[Nearest]):
    """The outcome of a search among interpretations.

    Attributes:
        rows: of every interpretation, with the ``stage`` at which it was run.
        nearest: the interpretation nearest to the paper.
    """

    rows: list[Row]
    nearest: Nearest

    def of(self, stage: str) -> list[Row]:
        """Returns the rows of a stage."""
        return [row for row in self.rows if row["stage"] == stage]


def searched(
    work: Work, space: Space, evaluate: Evaluate, effort: Effort, tie: Callable[[Row], float] = lambda _: 0.0
) -> random.Found:
    """Searches for the interpretation nearest to the paper: the same effort gives the same rows on any workers."""

    def evaluate_all(stage: str, evaluate: Evaluate, groups: Sequence[Group]) -> list[list[Row]]:
        return work.map_parallel(f"{stage} interpretations, in groups", evaluate, groups)

    distance = itemgetter("distance")
    return random_search(space, evaluate, effort, seed=SEED, distance=distance, tie=tie, evaluate_all=evaluate_all)


def summed_up(shortfalls: Mapping[str, float], claims: Iterable[str], apart: float = 0.0) -> Row:
    """Returns the last columns of a row: whether a claim that counts fails, how many hold, and the distance.

    That is from the paper, the sum of the shortfalls and what is ``apart`` beyond them.
    """
    counted = [shortfalls[name] for name in claims]
    holding = sum(short == 0.0 for short in counted)
    distance = apart + sum(min(MOST, short) for short in counted)
    return {"all": float(holding < len(counted)), "holding": holding, "distance": distance}


def holds(row: Row, claim: str) -> bool:
    """Tells whether a claim holds under an interpretation."""
    return row[claim] == 0.0


def share(rows: Sequence[Row], claim: str) -> float:
    """Returns the share of interpretations under which a claim holds; NaN of none."""
    return float(np.mean([holds(row, claim) for row in rows])) if rows else math.nan


def interval(rows: Sequence[Row], claim: str, space: Space) -> Interval:
    """Returns that share with its interval of confidence; interpretations of the same choices were drawn together."""
    return share_interval([holds(row, claim) for row in rows], [[row[key] for key in space.choices] for row in rows])


def often(of: Interval) -> str:
    """Returns a share in percent with its interval of confidence: ``"1.6 % [0.7, 3.4]"``."""
    low, high = (percent(end).removesuffix(" %") for end in (of.low, of.high))
    return percent(of.value) if math.isnan(of.value) else f"{percent(of.value)} [{low}, {high}]"


def percent(value: float) -> str:
    """Returns a share in percent: never 0 or 100 for what is not none or all; a dash for NaN."""
    if math.isnan(value):
        return "–"
    if value in (0.0, 1.0):
        return f"{100 * value:.0f} %"
    if value < 0.001:
        return "<0.1 %"
    return f"{100 * value:.1f} %" if value < 0.0995 else f"{min(99.0, 100 * value):.0f} %"


def yes(row: Row, claim: str) -> str:
    """Returns "yes" where a claim holds under an interpretation, else "no"."""
    return "yes" if holds(row, claim) else "no"


@dataclass(frozen=True)
class Option:
    """One option of a dimension, both by label, and the interpretations that took it."""

    dimension: str
    name: str
    rows: Sequence[Row]

    def share(self, claim: str) -> float:
        """Returns the share of these interpretations under which a claim holds."""
        return share(self.rows, claim)

    def __str__(self) -> str:
        return f"{self.dimension}{' ' if self.name[:1].isdigit() else ': '}{self.name}"


def options(rows: Sequence[Row], space: InterpretationSpace) -> list[Option]:
    """Returns all options that enough interpretations took: of the choices, and of the numbers thirds of ln range."""
    found = [
        Option(space.label(key), space.value(key, name), [row for row in rows if row[key] == name])
        for key, names in space.choices.items()
        for name in names
    ]
    for key, (low, high) in space.bounds.items():
        for first, last in pairwise(np.geomspace(low, high, 4).tolist()):
            inside = [row for row in rows if first <= row[key] <= last]
            found.append(Option(space.label(key), f"{space.value(key, first)} to {space.value(key, last)}", inside))
    return [option for option in found if len(option.rows) >= _FEWEST]


class Decider(NamedTuple):
    """The best and the worst option of the dimension on which a claim hangs most."""

    best: Option
    worst: Option

    def gap(self, claim: str) -> float:
        """Returns the difference of their shares."""
        return self.best.share(claim) - self.worst.share(claim)

    def describe(self, claim: str) -> str:
        """Returns the best option with its share and the worst with its."""
        best, worst = percent(self.best.share(claim)), percent(self.worst.share(claim))
        return f"{self.best} {best}, {self.worst.name} {worst}"


def decider(found: Iterable[Option], claim: str) -> Decider | None:
    """Returns the options of the dimension whose shares differ most; None where no shares differ."""
    by_dimension: dict[str, list[Option]] = {}
    for option in found:
        by_dimension.setdefault(option.dimension, []).append(option)

    def share_of(option: Option) -> float:
        return option.share(claim)

    deciders = [Decider(max(one, key=share_of), min(one, key=share_of)) for one in by_dimension.values()]
    most = max(deciders, key=lambda one: one.gap(claim), default=None)
    return most if most and most.gap(claim) > 0.0 else None


def never_together(rows: Sequence[Row], claims: Sequence[str]) -> str:
    """Returns the pairs of claims that each hold somewhere, and nowhere both; empty if there are none."""
    table = np.array([[holds(row, name) for name in claims] for row in rows], int)
    both = table.T @ table
    pairs = ((i, j) for i in range(len(claims)) for j in range(i) if not both[i, j] and both[i, i] and both[j, j])
    return "; ".join(f"*{claims[i]}* and *{claims[j]}*" for i, j in pairs)
