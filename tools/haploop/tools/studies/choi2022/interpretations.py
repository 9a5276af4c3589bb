"""Interpretations of a paper: one choice for everything that it leaves open, and under which of them its claims hold.

``interpretations.toml`` lists what is open. A table of interpretations has one row for each: its choices and numbers by
key, and by the name of each claim how far it falls short of the claim, 0.0 where the claim holds; ``all``, ``holding``
and ``distance`` summarize these (``summed_up``).
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from operator import itemgetter
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, Self

import numpy as np

from haploop.protocol.amounts import amount
from haploop.tools.search import random
from haploop.tools.search.intervals import Interval, share_interval
from haploop.tools.search.random import Effort, Evaluate, Group, Point, Row, Space, random_search
from haploop.tools.studies.choi2022.answers import Answers

SEED = 2022
# An option with fewer interpretations says nothing.
_FEWEST = 20
# A shortfall counts for no more than this: a factor of 20.
MOST = 3.0


@cache
def tables_of(figure: int) -> dict[str, Any]:
    """Returns what is open in a figure: ``choices``, ``numbers``, and the claims that are ``tested``."""
    return tomllib.loads(Path(__file__).with_name("interpretations.toml").read_text(encoding="utf-8"))[str(figure)]


@dataclass(frozen=True, kw_only=True)
class InterpretationSpace(Space):
    """The space from which interpretations are drawn, with labels of its choices and numbers.

    Attributes:
        labels: by key; the unit, if there is one, in brackets at the end.
        ours: our own interpretation, if there is one.
    """

    labels: Mapping[str, str]
    ours: Point

    @classmethod
    def of_figure(cls, figure: int, labels: Mapping[str, str] = MappingProxyType({}), **options: Any) -> Self:
        """Makes the space of a figure; ``labels`` adds labels of other values."""
        choices, numbers = tables_of(figure)["choices"], tables_of(figure)["numbers"]
        return cls(
            choices={key: tuple(one["options"]) for key, one in choices.items()},
            bounds={key: (one["from"], one["to"]) for key, one in numbers.items()},
            labels={key: one["label"] for key, one in (choices | numbers).items()} | dict(labels),
            ours=Point(*({key: one.get("ours") for key, one in of.items()} for of in (choices, numbers)), seed=1),
            **options,
        )

    def label(self, key: str) -> str:
        """Returns the label of a key, without its unit."""
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


class Found(NamedTuple):
    """The outcome of a search: the rows of all interpretations, with their ``stage``, and the one nearest the paper."""

    rows: list[Row]
    nearest: Point

    def of(self, stage: str) -> list[Row]:
        """Returns the rows of a stage."""
        return [row for row in self.rows if row["stage"] == stage]


def searched(
    answers: Answers, space: Space, evaluate: Evaluate, effort: Effort, tie: Callable[[Row], float] = lambda _: 0.0
) -> random.Found:
    """Searches for the interpretation nearest to the paper: the same effort gives the same rows on any workers."""

    def evaluate_all(stage: str, evaluate: Evaluate, groups: Sequence[Group]) -> list[list[Row]]:
        return answers.map_parallel(f"{stage} interpretations, in groups", evaluate, groups)

    distance = itemgetter("distance")
    return random_search(space, evaluate, effort, seed=SEED, distance=distance, tie=tie, evaluate_all=evaluate_all)


def summed_up(shortfalls: Mapping[str, float], claims: Iterable[str], apart: float = 0.0) -> Row:
    """Returns the last columns of a row: whether a claim that counts fails, how many hold, and the distance.

    The distance, from the paper, is the sum of the shortfalls and of ``apart``, what differs besides.
    """
    counted = [shortfalls[name] for name in claims]
    holding = sum(short == 0.0 for short in counted)
    distance = apart + sum(min(MOST, short) for short in counted)
    return {"all": float(holding < len(counted)), "holding": holding, "distance": distance}


def holds(row: Row, claim: str) -> bool:
    """Tells whether a claim holds under an interpretation."""
    return row[claim] == 0.0


def share(rows: Sequence[Row], claim: str) -> float:
    """Returns the share of interpretations under which a claim holds; NaN if there are none."""
    return float(np.mean([holds(row, claim) for row in rows])) if rows else math.nan


def interval(rows: Sequence[Row], claim: str, space: Space) -> Interval:
    """Returns that share with its interval of confidence; interpretations of the same choices were drawn together."""
    return share_interval([holds(row, claim) for row in rows], [[row[key] for key in space.choices] for row in rows])


def often(of: Interval) -> str:
    """Returns a share in percent with its interval of confidence: ``"1.6 % [0.7, 3.4]"``."""
    low, high = (percent(end).removesuffix(" %") for end in (of.low, of.high))
    return percent(of.value) if math.isnan(of.value) else f"{percent(of.value)} [{low}, {high}]"


def percent(value: float) -> str:
    """Returns a share in percent: 0 and 100 only for exactly none and all; a dash for NaN."""
    if math.isnan(value):
        return "–"
    if value in (0.0, 1.0):
        return f"{100 * value:.0f} %"
    if value < 0.001:
        return "<0.1 %"
    return f"{100 * value:.1f} %" if value < 0.0995 else f"{min(99.0, 100 * value):.0f} %"


class Option(NamedTuple):
    """One option of a dimension, both given by label, and the interpretations that took it."""

    dimension: str
    name: str
    rows: Sequence[Row]

    def share(self, claim: str) -> float:
        """Returns the share of these interpretations under which a claim holds."""
        return share(self.rows, claim)

    def __str__(self) -> str:
        return f"{self.dimension}{' ' if self.name[:1].isdigit() else ': '}{self.name}"


def options(rows: Sequence[Row], space: InterpretationSpace) -> list[Option]:
    """Returns all options that enough interpretations took; those of a number are thirds of its range in ln."""
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
    """The best and the worst option of the dimension on which a claim depends most, with the shares of both."""

    best: Option
    worst: Option
    shares: tuple[float, float]

    def __str__(self) -> str:
        return f"{self.best} {percent(self.shares[0])}, {self.worst.name} {percent(self.shares[1])}"


def decider(found: Sequence[Option], claim: str) -> Decider | None:
    """Returns the best and worst option of the dimension whose shares differ most; None if no shares differ."""

    def share_of(option: Option) -> float:
        return option.share(claim)

    deciders: list[Decider] = []
    for dimension in dict.fromkeys(option.dimension for option in found):
        some = [option for option in found if option.dimension == dimension]
        best, worst = max(some, key=share_of), min(some, key=share_of)
        deciders.append(Decider(best, worst, (share_of(best), share_of(worst))))
    most = max(deciders, key=lambda one: one.shares[0] - one.shares[1], default=None)
    return most if most and most.shares[0] > most.shares[1] else None
