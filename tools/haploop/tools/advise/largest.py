"""The largest steady stiffness of many loops, searched side by side."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.judge import Judgement

# From scenes, and whether each is to be run to the end of its swings, to what they come to.
Judged = Callable[[Sequence[Scene], Sequence[bool]], list[Judgement]]
# No wall softer than this is a wall.
LEAST_N_M = 1.0
_NEAR = 1.2


@dataclass(frozen=True)
class Pace:
    """The stiffnesses that a search tries in a round, and its tolerance.

    Attributes:
        ladder: factors of the start in the first round.
        beyond: factors up or down from there, where the limit lies beyond.
        between: how many between a steady one and one that is not in every later round, down to the tolerance.
        below: shares of the largest that must hold, too.
    """

    ladder: tuple[float, ...]
    beyond: tuple[float, ...]
    between: int
    tolerance: float
    below: tuple[float, ...] = (0.75, 0.5, 0.25)


_UP = tuple(2.0 ** (i / 2) for i in range(1, 11))
# The pace of a search that starts from a guess.
WIDE = {
    "arrays": Pace(tuple(2.0 ** (i / 2) for i in range(-8, 9)), _UP, 17, 0.02),
    "friction": Pace((1 / 8, 1 / 4, 1 / 2, 1.0, 2.0), (2.0,), 2, 0.05),
    "alone": Pace((1.0,), (2.0,), 1, 0.05),
}
# The pace of a search that starts from what a rival has reached: only more than that counts.
BEYOND = {way: replace(pace, ladder=(0.5, 1.0)) for way, pace in WIDE.items()} | {"arrays": WIDE["arrays"]}
# The pace near a limit that is known about, as is what lies below it. With friction, bodies that differ share
# no array, and what swings for long before it rests costs as much in one as alone: few runs, one after the other.
NEAR = {
    "arrays": Pace(tuple(1.1 * 0.92**i for i in range(16)), _UP, 17, 0.02, ()),
    "friction": Pace((0.85,), (1.3,), 1, 0.1, ()),
    "alone": Pace((0.85,), (1.3,), 1, 0.1, ()),
}


@dataclass(frozen=True)
class Limit:
    """The limit of a wall's stiffness.

    Attributes:
        stiffness_N_m: the largest that is steady, as are all softer ones that were tried; 0 where none is.
        not_steady_N_m: the softest that is not; infinite where none was found.
        steady_above_N_m: stiffer ones that are steady all the same.
    """

    stiffness_N_m: float
    not_steady_N_m: float
    steady_above_N_m: tuple[float, ...] = ()

    def is_within(self, tolerance: float) -> bool:
        """Tells whether no more than this share lies between the two."""
        return self.not_steady_N_m <= max(LEAST_N_M, self.stiffness_N_m * (1.0 + 1e-9 + tolerance))


@dataclass(frozen=True)
class StiffnessQuery:
    """A loop whose largest steady stiffness is searched.

    Attributes:
        make: from a stiffness in N/m and whether to be thorough to the runs that must be steady.
        start_N_m: where the limit may be, about.
        most_N_m: nothing stiffer is tried.
        is_one_run: whether the runs are the same, thorough or not.
    """

    make: Callable[[float, bool], list[Scene]]
    start_N_m: float
    most_N_m: float
    is_one_run: bool = False


def largest_steady(
    cells: Mapping[Any, StiffnessQuery],
    judged: Judged,
    pace: Pace,
    rivals: Callable[[Any], Hashable] | None = None,
    softest: bool = False,
    reached: Mapping[Any, float] | None = None,
) -> dict[Any, Limit]:
    """Returns the limit of each cell; in every round the next stiffnesses of all cells are run together.

    From the start up and down until it changes, then narrowed by ratio; then softer walls are tried, and where one of
    them is not steady, the search goes on below it. All this by the first task and one seed; what was found steady is
    then held to all of them, to the end of its swings, and if it fails the search goes on below, thoroughly. (Only the
    limit itself is held to them where the pace has nothing below it tried.)

    Args:
        cells: by any name.
        judged: from scenes and whether each is run to the end of its swings to judgements.
        rivals: of a cell's name, of which cells only one counts: the one with the largest limit, or the smallest where
            ``softest``. The others are narrowed no further than it takes to tell.
        reached: of a set of rivals what another of them is known to bear, N/m.
    """
    searches = {name: _Search(loops, pace) for name, loops in cells.items()}
    while True:
        ends = _best_ends(searches, rivals, softest, reached or {}) if rivals else {}
        asking = {
            name: search
            for name, search in searches.items()
            if search.wanted and not (rivals and search.is_beaten(ends[rivals(name)], softest))
        }
        if not asking:
            return {name: search.limit() for name, search in searches.items()}
        runs = [
            (name, k, scene)
            for name, search in asking.items()
            for k in search.wanted
            for scene in cells[name].make(k, search.thorough)
        ]
        judgements = judged([scene for *_, scene in runs], [asking[name].thorough for name, _, _ in runs])
        looked = [(name, k, judgement) for (name, k, _), judgement in zip(runs, judgements, strict=True)]
        fails = {(name, k) for name, k, judgement in looked if not judgement.steady}
        presumed = {(name, k) for name, k, judgement in looked if judgement.presumed}
        for name, search in asking.items():
            is_sure = search.thorough or cells[name].is_one_run
            holds = [(name, k) not in fails for k in search.wanted]
            search.take(holds, {k for k in search.wanted if is_sure and (name, k) not in presumed})


def _best_ends(
    searches: Mapping[Any, _Search], rivals: Callable[[Any], Hashable], softest: bool, reached: Mapping[Any, float]
) -> dict[Hashable, float]:
    """Returns of each set of rivals the best that is sure: the most that is steady, or the least that is not."""
    found: dict[Hashable, float] = dict(reached)
    for name, search in searches.items():
        group, (low, high) = rivals(name), search.ends
        found[group] = min(found.get(group, math.inf), high) if softest else max(found.get(group, 0.0), low)
    return found


class _Search:
    """The search for one limit: the stiffnesses to try next (none when it is over), and whether thoroughly."""

    def __init__(self, loops: StiffnessQuery, pace: Pace) -> None:
        self._pace, self._most = pace, loops.most_N_m
        self._tried: dict[float, bool] = {}
        self._sure: set[float] = set()
        self.thorough = False
        ladder = {min(loops.most_N_m, max(LEAST_N_M, factor * loops.start_N_m)) for factor in pace.ladder}
        self.wanted = sorted(ladder)

    @property
    def ends(self) -> tuple[float, float]:
        """The stiffest that is steady below the softest that is not, 0 for none; and the latter, infinite for none."""
        high = min((k for k, steady in self._tried.items() if not steady), default=math.inf)
        return max((k for k, steady in self._tried.items() if steady and k < high), default=0.0), high

    def is_beaten(self, end: float, softest: bool) -> bool:
        """Tells whether a rival that has reached ``end`` stays before this one, whatever else is tried."""
        low, high = self.ends
        return low >= end if softest else high <= end

    def take(self, holds: Iterable[bool], sure: set[float]) -> None:
        """Takes the results of all that was wanted, and the stiffnesses whose results are final."""
        self._tried.update(zip(self.wanted, holds, strict=True))
        self._sure |= sure
        self.wanted = self._nearer() or self._softer()
        if not self.wanted:
            self.thorough = True
            low, _ = self.ends
            unsure = [k for k, steady in self._tried.items() if steady and k not in self._sure]
            self.wanted = [k for k in unsure if k == low or self._pace.below]

    def limit(self) -> Limit:
        """Returns the limit as far as it is known."""
        low, high = self.ends
        return Limit(low, high, tuple(sorted(k for k, steady in self._tried.items() if steady and k > high)))

    def _nearer(self) -> list[float]:
        low, high = self.ends
        if high == math.inf:
            return sorted({min(self._most, low * factor) for factor in self._pace.beyond}) if low < self._most else []
        if not low:
            below = {max(LEAST_N_M, high / factor) for factor in self._pace.beyond}
            return sorted(below) if high > LEAST_N_M else []
        if high <= low * (1.0 + self._pace.tolerance):
            return []
        parts = min(self._pace.between + 1, math.ceil(math.log(high / low) / math.log1p(self._pace.tolerance)))
        return [low * (high / low) ** (part / parts) for part in range(1, max(2, parts))]

    def _softer(self) -> list[float]:
        """Returns shares of the steady stiffness, but none beside one that was tried."""
        low, _ = self.ends
        shares = [low * share for share in self._pace.below if low * share >= LEAST_N_M]
        return [k for k in shares if not any(k / _NEAR < other < k * _NEAR for other in self._tried)]
