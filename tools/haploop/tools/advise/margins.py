"""Search of the margins: walls that stay steady when delay, hand and device are a fifth off."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial, reduce

from haploop.protocol.scene.scene import ElementTable, Scene
from haploop.tools.advise.gains import Gains, Search, Values
from haploop.tools.advise.judge import execution_mode
from haploop.tools.advise.largest import LEAST_N_M, NEAR, WIDE, Limit, StiffnessQuery, largest_steady
from haploop.tools.advise.variations import Change, corners, larger_changes, scale_quantities, single_changes

Vary = Callable[[Scene], Scene]
# An element that allows no more than this much beyond a simpler one is not worth having.
_WORTH = 1.1
# What fails in a corner is lowered by this, after so many times by more.
_LOWER, _TIMES, _MORE = 0.93, 4, 0.8


@dataclass(frozen=True)
class Recommendation:
    """The gain to use.

    Attributes:
        gains: of the family recommended.
        stiffness_N_m: steady in every corner that was tried; 0 where none is.
        corners: how many loops it was tried in.
        nearest: the smallest change beyond a fifth at which it is no longer steady; None where none of those tried.
    """

    gains: Gains
    stiffness_N_m: float
    corners: int
    nearest: Change | None


class MarginSearch:
    """The search of safe gains, after that of steady ones."""

    def __init__(self, search: Search) -> None:
        self._search, self._tasks = search, search.tasks
        ways = execution_mode(search.tasks.first)
        self._near, self._below = NEAR[ways], WIDE[ways].below if ways == "arrays" else ()

    def uncertain(self, found: list[Gains]) -> None:
        """Finds the limits of every family with single changes and in the corners that are likely the worst."""
        self._search.stage("a fifth more or less")
        changes = single_changes(self._tasks.first)
        cells = {
            (index, change): self._changed(gains, gains.values, [change.apply])
            for index, gains in enumerate(found)
            for change in changes
        }
        limits = largest_steady(cells, self._search.judge.judge, self._near, rivals=lambda name: name[0], softest=True)
        for (index, change), limit in limits.items():
            found[index].alone[change] = limit
        self._search.stage("the worst corner")
        finalists = [(gains, values) for gains in found for values in self._finalists(gains)]
        together = {index: self._in_corners(*finalist) for index, finalist in enumerate(finalists)}
        limits = largest_steady(
            together, self._search.judge.judge, self._near, rivals=lambda index: finalists[index][0].family
        )
        for index, safe in limits.items():
            gains, values = finalists[index]
            if safe.stiffness_N_m > gains.safe.stiffness_N_m or not gains.safe_values:
                ends = safe.stiffness_N_m, min(safe.not_steady_N_m, gains.tried[values].not_steady_N_m)
                gains.safe_values, gains.safe, gains.corner = values, Limit(*ends), _corner(gains.alone)

    def _finalists(self, gains: Gains) -> list[Values]:
        """Returns the best choice of a family, and gentler ones, which may bear more change."""
        ranked = sorted(gains.tried, key=lambda values: (-gains.tried[values].stiffness_N_m, values))
        chosen = ranked[:1]
        while len(chosen) < self._search.grid.finalists:
            # The last parameter, the inertia where there is one, is a quarter smaller at least.
            gentler = [values for values in ranked if values and values[-1] <= 0.75 * chosen[-1][-1]]
            if not gentler or not gains.tried[gentler[0]].stiffness_N_m:
                break
            chosen.append(gentler[0])
        return chosen

    def _changed(
        self, gains: Gains, values: Values, changes: Sequence[Vary], most_N_m: float = math.inf
    ) -> StiffnessQuery:
        """Makes the query of a family under some changes, all of which must be steady."""
        elements = gains.family.elements(values)
        return StiffnessQuery(
            lambda k, thorough: [
                run for change in changes for run in self._tasks.make_runs(k, elements, change, thorough)
            ],
            start_N_m=max(LEAST_N_M, gains.tried[values].stiffness_N_m),
            most_N_m=max(LEAST_N_M, min(self._search.most_N_m, most_N_m)),
            is_one_run=self._tasks.is_one_run,
        )

    def _in_corners(self, gains: Gains, values: Values) -> StiffnessQuery:
        """Makes the query in the corners that are likely the worst, and as described where that is not known."""
        known, worst = gains.tried[values], _likely_worst(gains)
        if known.is_within(self._search.tolerance):
            return self._changed(gains, values, worst, known.stiffness_N_m)
        return self._changed(gains, values, [partial(scale_quantities, factors={}), *worst], known.not_steady_N_m)

    def safe(self, found: list[Gains]) -> Recommendation:
        """Returns the family to use and a stiffness that holds in every corner, rounded down to two digits.

        The family that allows most in its likely worst corner is tried in all; where they take so much that another
        comes out above, that is tried, too.
        """
        self._search.stage("every corner")
        every = [partial(scale_quantities, factors=factors) for factors in ({}, *corners(self._tasks.first))]
        proved: dict[int, float] = {}

        def bears(gains: Gains) -> float:
            """Returns what a family is known, or likely, to bear in its worst corner."""
            return proved.get(id(gains), gains.safe.stiffness_N_m)

        while True:
            best = reduce(lambda best, gains: gains if bears(gains) > _WORTH * bears(best) else best, found)
            if id(best) in proved:
                break
            self._known_well(best)
            proved[id(best)] = holds = self._everywhere(best, every)
            if holds < rounded_down(best.safe.stiffness_N_m):
                best.safe = Limit(holds, best.safe.stiffness_N_m)
        return Recommendation(best, proved[id(best)], len(every), self._nearest(best, proved[id(best)]))

    def _everywhere(self, gains: Gains, every: list[Vary]) -> float:
        """Returns the largest stiffness of two digits that was seen to hold in every corner; 0 for none.

        Corners in which one failed are asked first about the next.
        """
        most = min(gains.safe.stiffness_N_m, gains.tried[gains.safe_values].stiffness_N_m)
        stiffness, suspects, times = rounded_down(most), every, 0
        while stiffness >= LEAST_N_M:
            failing = self._failing(gains, stiffness, suspects)
            if not failing and suspects is not every:
                failing = self._failing(gains, stiffness, every)
            if not failing:
                return stiffness
            suspects, times = failing, times + 1
            stiffness = rounded_down(stiffness * (_LOWER if times < _TIMES else _MORE))
        return 0.0

    def _failing(self, gains: Gains, stiffness: float, changes: list[Vary]) -> list[Vary]:
        walls = [stiffness, *(max(LEAST_N_M, stiffness * share) for share in self._below)]
        failed = self._unsteady(changes, walls, gains.family.elements(gains.safe_values))
        return [changes[i] for i in failed]

    def _known_well(self, gains: Gains) -> None:
        """Finds the limit of the choice that is safe, which may have been left off as not the best."""
        values = gains.safe_values
        if not gains.tried[values].is_within(self._search.tolerance):
            known = self._search.limits([(gains.family, values)], max(LEAST_N_M, gains.tried[values].stiffness_N_m))
            gains.tried[values] = known[gains.family, values]

    def _nearest(self, gains: Gains, stiffness: float) -> Change | None:
        self._search.stage("the nearest instability")
        elements = gains.family.elements(gains.safe_values)
        changes = larger_changes(self._tasks.first) if stiffness else []
        for _, alike in itertools.groupby(sorted(changes, key=_size), key=_size):
            same_size = list(alike)
            if failed := self._unsteady([change.apply for change in same_size], [stiffness], elements):
                return same_size[failed[0]]
        return None

    def _unsteady(self, changes: Sequence[Vary], walls: Sequence[float], elements: Sequence[ElementTable]) -> list[int]:
        runs = [
            (i, run)
            for i, change in enumerate(changes)
            for k in walls
            for run in self._tasks.make_runs(k, elements, change)
        ]
        judged = self._search.judge.judge([run for _, run in runs])
        return sorted({i for (i, _), judgement in zip(runs, judged, strict=True) if not judgement.steady})


def _likely_worst(gains: Gains) -> list[Vary]:
    """Returns the worst change, and the worst signs of all together, with every mass also the other way."""
    corner = _corner(gains.alone)
    flipped = {name: 2.0 - factor if name.endswith("mass") else factor for name, factor in corner.items()}
    together = [partial(scale_quantities, factors=factors) for factors in (corner, flipped)]
    return [*together, *([gains.worst.apply] if gains.worst else [])]


def rounded_down(value: float) -> float:
    if value <= 0.0:
        return 0.0
    rounded = float(f"{value:.1e}")
    return rounded if rounded <= value else float(f"{rounded - 10.0 ** (int(f'{value:e}'.partition('e')[2]) - 1):.1e}")


def _size(change: Change) -> float:
    return round(change.size, 9)


def _corner(alone: dict[Change, Limit]) -> dict[str, float]:
    worst: dict[str, Change] = {}
    for change, limit in alone.items():
        if limit.stiffness_N_m < alone[worst.setdefault(change.quantity, change)].stiffness_N_m:
            worst[change.quantity] = change
    return {name: change.factor for name, change in worst.items()}
