"""The largest steady stiffness of many loops, searched side by side."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from haploop.tools.advise.steady import Judgement

Scene = dict[str, Any]
Judged = Callable[[Sequence[Scene]], list[Judgement]]
# No wall softer than this is a wall.
LEAST_N_M = 1.0
_FACTOR = 2.0
_NEAR = 1.2


@dataclass(frozen=True)
class Limit:
    """How stiff a wall can be.

    Attributes:
        stiffness_N_m: the largest that is steady, as are all softer ones that were tried; 0 where none is.
        not_steady_N_m: the softest that is not; infinite where none was found.
        islands_N_m: stiffer ones that are steady all the same.
        tried: how many were tried.
    """

    stiffness_N_m: float
    not_steady_N_m: float
    islands_N_m: tuple[float, ...] = ()
    tried: int = 0


@dataclass(frozen=True)
class Loops:
    """What to search for.

    Attributes:
        make: from a stiffness in N/m to all runs that must be steady.
        start_N_m: where the limit may be, about.
        most_N_m: nothing stiffer is tried.
    """

    make: Callable[[float], list[Scene]]
    start_N_m: float
    most_N_m: float


@dataclass(frozen=True)
class Pace:
    """How much is tried in a round.

    Attributes:
        ladder: factors of the start in the first round.
        between: stiffnesses between one that is steady and one that is not, in every later round.
        tolerance: relative, between the last two of these.
        below: shares of the largest that must hold, too; one that was tried within a fifth of it is not tried again.
    """

    ladder: tuple[float, ...]
    between: int
    tolerance: float
    below: tuple[float, ...] = (0.75, 0.5, 0.25)


def largest(cells: Mapping[Any, Loops], judged: Judged, pace: Pace) -> dict[Any, Limit]:
    """The limit of each cell. In every round what is to be tried next of all cells is run together.

    From the start up and down until it changes, then narrowed by ratio; then softer walls are tried, and where one of
    them is not steady, the search goes on below it.

    Args:
        cells: by any name.
        judged: from scenes to what they come to.
        pace: how much in a round, and how near.
    """
    searches = {name: _search(loops, pace) for name, loops in cells.items()}
    wanted = {name: next(search) for name, search in searches.items()}
    found: dict[Any, Limit] = {}
    while wanted:
        runs = [(name, k, scene) for name, ks in wanted.items() for k in ks for scene in cells[name].make(k)]
        holds: dict[tuple[Any, float], bool] = {}
        for (name, k, _), judgement in zip(runs, judged([scene for _, _, scene in runs]), strict=True):
            holds[name, k] = holds.get((name, k), True) and judgement.steady
        for name, ks in list(wanted.items()):
            try:
                wanted[name] = searches[name].send([holds[name, k] for k in ks])
            except StopIteration as end:
                found[name] = end.value
                del wanted[name]
    return {name: found[name] for name in cells}


def _search(loops: Loops, pace: Pace) -> Generator[list[float], list[bool], Limit]:
    tried: dict[float, bool] = {}
    wanted = sorted({min(loops.most_N_m, max(LEAST_N_M, factor * loops.start_N_m)) for factor in pace.ladder})
    while wanted:
        tried.update(zip(wanted, (yield wanted), strict=True))
        wanted = _next(tried, pace, loops.most_N_m)
    high, low = _ends(tried)
    islands = tuple(sorted(k for k, steady in tried.items() if steady and k > high))
    return Limit(low, high, islands, len(tried))


def _ends(tried: dict[float, bool]) -> tuple[float, float]:
    """The softest that is not steady, infinite for none, and the stiffest below it that is, 0 for none."""
    high = min((k for k, steady in tried.items() if not steady), default=math.inf)
    return high, max((k for k, steady in tried.items() if steady and k < high), default=0.0)


def _next(tried: dict[float, bool], pace: Pace, most_N_m: float) -> list[float]:
    """What to try next; nothing when the search is over."""
    high, low = _ends(tried)
    if high == math.inf:
        if low < most_N_m:
            return [min(most_N_m, low * _FACTOR)]
    elif not low:
        return [max(LEAST_N_M, high / _FACTOR)] if high > LEAST_N_M else []
    elif high > low * (1.0 + pace.tolerance):
        parts = min(pace.between + 1, math.ceil(math.log(high / low) / math.log1p(pace.tolerance)))
        return [low * (high / low) ** (part / parts) for part in range(1, max(2, parts))]
    shares = [low * share for share in pace.below if low * share >= LEAST_N_M]
    return [k for k in shares if not any(k / _NEAR < other < k * _NEAR for other in tried)]
