"""Random search for the least distance: draw points, refine around the best, and look at the neighbours of those.

Points of one structure (one option of every choice) are drawn and evaluated in groups, so that an evaluation can treat
them together. All points of a stage are drawn before any is evaluated: they are the same however groups are spread over
processes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

Row = dict[str, Any]


@dataclass(frozen=True)
class Point:
    """A point of a space: options and numbers by key, and a seed where the space is ``seeded``."""

    choices: dict[str, Any]
    numbers: dict[str, float]
    seed: int = 0

    def rounded(self, digits: int) -> Point:
        return replace(self, numbers={key: float(f"{value:.{digits}g}") for key, value in self.numbers.items()})


Group = Sequence[Point]
Evaluate = Callable[[Group], list[Row]]
# From a stage, an evaluation of one group and many groups to the rows of each group.
EvaluateAll = Callable[[str, Evaluate, Sequence[Group]], list[list[Row]]]


class Scale(NamedTuple):
    """A choice whose options lie on a grid: neighbours may take another value of the grid within these bounds."""

    step: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class Space:
    """A space of choices and numbers.

    Attributes:
        choices: options by key; each is drawn equally often.
        bounds: least and greatest value by key, of numbers that are drawn evenly in their logarithm.
        scales: of those choices that neighbours may change.
        digits: significant digits to which numbers are rounded; None for all.
        seeded: whether each point has a seed of its own.
    """

    choices: Mapping[str, tuple[Any, ...]]
    bounds: Mapping[str, tuple[float, float]]
    scales: Mapping[str, Scale] = field(default_factory=dict[str, Scale])
    digits: int | None = None
    seeded: bool = False

    def draw(self, rng: np.random.Generator, structures: int, each: int) -> list[list[Point]]:
        """Draws structures, and a group of ``each`` points for every one; every option comes up equally often."""
        columns = {key: [options[i % len(options)] for i in range(structures)] for key, options in self.choices.items()}
        for column in columns.values():
            rng.shuffle(column)
        drawn = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
        return [[self._point(rng, choices, self._numbers(rng)) for _ in range(each)] for choices in drawn]

    def neighbours(
        self, rng: np.random.Generator, point: Point, spread: float, count: int, *, shifted: bool = True
    ) -> list[Point]:
        """Draws a group of points near one: each number times e^(spread xi), xi normal, kept within its bounds.

        If ``shifted``, choices with a scale are shifted by 10 spread xi steps, the same for the whole group.
        """
        choices = dict(point.choices)
        for key, scale in self.scales.items() if shifted else ():
            value = choices[key] + round(10.0 * spread * rng.standard_normal()) * scale.step
            choices[key] = round(min(max(value, scale.low), scale.high), 12)
        return [self._point(rng, choices, self._near(rng, point.numbers, spread)) for _ in range(count)]

    def _numbers(self, rng: np.random.Generator) -> dict[str, float]:
        return {key: math.exp(rng.uniform(math.log(low), math.log(high))) for key, (low, high) in self.bounds.items()}

    def _near(self, rng: np.random.Generator, numbers: dict[str, float], spread: float) -> dict[str, float]:
        moved = {key: value * math.exp(spread * rng.standard_normal()) for key, value in numbers.items()}
        return {key: float(np.clip(value, *self.bounds[key])) for key, value in moved.items()}

    def _point(self, rng: np.random.Generator, choices: dict[str, Any], numbers: dict[str, float]) -> Point:
        point = Point(choices, numbers, int(rng.integers(2**31)) if self.seeded else 0)
        return point.rounded(self.digits) if self.digits else point


@dataclass(frozen=True, kw_only=True)
class Effort:
    """Effort of a search: number of draws, of refinements, and their spread.

    Attributes:
        structures, each: number of random structures, and of points of each.
        rounds, best, groups, children: rounds of refinement; in each, around how many of the best so far, how many
            groups for each of those, and points in a group.
        finalists, neighbours: number of the best, and of points around each of them.
        far, close: deviation of a number's logarithm in the first and the last round, and among the neighbours.
    """

    structures: int
    each: int
    rounds: int
    best: int
    children: int
    neighbours: int
    groups: int = 1
    finalists: int = 1
    far: float = 0.3
    close: float = 0.05


class Trial(NamedTuple):
    """A point and what its evaluation returned, with the ``stage`` at which it was drawn."""

    point: Point
    row: Row


class Found(NamedTuple):
    """The trials as drawn, the finalist that is best with the mean of its neighbours added, and these neighbours."""

    trials: list[Trial]
    best: Trial
    neighbours: list[Trial]


def evaluate_in_turn(_: str, evaluate: Evaluate, groups: Sequence[Group]) -> list[list[Row]]:
    return [evaluate(group) for group in groups]


def random_search(
    space: Space,
    evaluate: Evaluate,
    effort: Effort,
    *,
    seed: int,
    distance: Callable[[Row], float],
    tie: Callable[[Row], float] = lambda _: 0.0,
    evaluate_all: EvaluateAll = evaluate_in_turn,
) -> Found:
    """Searches a space for the point with the least distance.

    No more than a third of the best that are refined may share a structure, so that one good structure does not hide
    others. A point that is good only in that very place is worth less than one whose neighbours are good, too.

    Args:
        evaluate: returns a row for each point of a group; must be importable where processes evaluate.
        distance, tie: of a row, to be minimised; the tie decides between finalists at the same distance.
        evaluate_all: evaluates many groups, in parallel perhaps; one after another by default.
    """
    rng = np.random.default_rng(seed)

    def run(stage: str, groups: Sequence[Group]) -> list[Trial]:
        return evaluated(stage, evaluate, groups, evaluate_all)

    def near(trial: Trial, spread: float) -> list[Point]:
        return space.neighbours(rng, trial.point, spread, effort.children)

    trials = run("random", space.draw(rng, effort.structures, effort.each))
    for spread in np.geomspace(effort.far, effort.close, effort.rounds).tolist():
        parents = _best(trials, effort.best, distance)
        trials += run("refined", [near(parent, spread) for parent in parents for _ in range(effort.groups)])
    finalists = _best(trials, effort.finalists, lambda row: (distance(row), tie(row)))
    around = [space.neighbours(rng, one.point, effort.close, effort.neighbours, shifted=False) for one in finalists]
    neighbours = run("neighbour", around)
    of_each = [neighbours[i : i + effort.neighbours] for i in range(0, len(neighbours), effort.neighbours)]
    means = [np.mean([distance(trial.row) for trial in group]) for group in of_each]
    i = int(np.argmin([distance(one.row) + mean for one, mean in zip(finalists, means, strict=True)]))
    return Found(trials, finalists[i], of_each[i])


def evaluated(
    stage: str, evaluate: Evaluate, groups: Sequence[Group], evaluate_all: EvaluateAll = evaluate_in_turn
) -> list[Trial]:
    """Evaluates groups of points and returns a trial for each point, in order."""
    rows = evaluate_all(stage, evaluate, groups)
    return [
        Trial(point, row | {"stage": stage})
        for group, of_group in zip(groups, rows, strict=True)
        for point, row in zip(group, of_group, strict=True)
    ]


def _best(trials: Sequence[Trial], count: int, key: Callable[[Row], Any]) -> list[Trial]:
    """Returns the best, no more than a third of them, but at least one, of any one structure."""
    picked: list[Trial] = []
    for trial in sorted(trials, key=lambda one: key(one.row)):
        if sum(other.point.choices == trial.point.choices for other in picked) < max(1, count // 3):
            picked.append(trial)
        if len(picked) == count:
            break
    return picked
