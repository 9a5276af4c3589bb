"""The stiffest wall that bears all its cases, as do all softer ones, searched for many loops side by side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from haploop.protocol.scene.scene import ElementTable, Scene
from haploop.tools.advise.walls.cases import Case
from haploop.tools.advise.walls.store import Failure, Job, Tried
from haploop.tools.advise.walls.trial import Trial

# Anything softer than the first is not taken for a wall; no device renders one stiffer than the second.
LEAST_N_M, MOST_N_M = 1.0, 1e6
# Walls that are tried between one that bears all and one that does not, in every round.
_BETWEEN = 3


@dataclass(frozen=True)
class Query:
    """A loop with elements whose limit is searched for.

    Attributes:
        ladder: stiffnesses in N/m that are tried first, rising.
        least_N_m: if a wall this soft fails, the search ends: how much softer the limit is does not matter.
    """

    loop: Scene
    elements: tuple[ElementTable, ...]
    cases: tuple[Case, ...]
    ladder: tuple[float, ...]
    least_N_m: float = LEAST_N_M


@dataclass(frozen=True)
class Limit:
    """The limit of a wall's stiffness.

    Attributes:
        stiffness_N_m: the largest that bears all cases, as do all softer ones that were tried; 0 if none does, or
            none as stiff as asked for.
        fails_N_m: the softest that does not; infinite if none was found.
        failure: what that one does.
        borne_above_N_m: stiffer ones that nevertheless bear all cases.
    """

    stiffness_N_m: float
    fails_N_m: float
    failure: Failure | None = None
    borne_above_N_m: tuple[float, ...] = ()


def ladder(low: float, high: float, factor: float) -> tuple[float, ...]:
    """Returns rungs from low to high, each the one before times about ``factor``."""
    count = max(1, math.ceil(math.log(high / low) / math.log(factor) - 1e-9))
    return tuple(low * (high / low) ** (i / count) for i in range(count + 1))


def limits(trial: Trial, queries: Sequence[Query], tolerance: float) -> list[Limit]:
    """Returns the limit of each query; in every round the next walls of all of them are tried together.

    Beyond the ladder the search goes on by factors of two; then the gap is divided until it is within the tolerance.
    """
    tried: list[dict[float, Failure | None]] = [{} for _ in queries]
    wanted = [[k for k in query.ladder if LEAST_N_M <= k <= MOST_N_M] for query in queries]
    while any(wanted):
        asking = [index for index, some in enumerate(wanted) if some]
        jobs = [
            Job(query.loop, tuple(Tried(k, query.elements) for k in wanted[index]), query.cases)
            for index, query in enumerate(queries)
            if index in asking
        ]
        for index, failures in zip(asking, trial.of_jobs(jobs), strict=True):
            tried[index].update(zip(wanted[index], failures, strict=True))
        wanted = [_next(known, tolerance, query.least_N_m) for known, query in zip(tried, queries, strict=True)]
    return [_limit(known) for known in tried]


def _limit(known: dict[float, Failure | None]) -> Limit:
    fails = min((k for k, failure in known.items() if failure), default=math.inf)
    borne = [k for k, failure in known.items() if not failure]
    above = tuple(sorted(k for k in borne if k > fails))
    return Limit(max((k for k in borne if k < fails), default=0.0), fails, known.get(fails), above)


def _next(known: dict[float, Failure | None], tolerance: float, least_N_m: float) -> list[float]:
    found = _limit(known)
    low, high = found.stiffness_N_m, found.fails_N_m
    if high <= least_N_m:
        return []
    if high == math.inf:
        return sorted({min(MOST_N_M, low * factor) for factor in (2.0, 4.0)}) if low < MOST_N_M else []
    if not low:
        return sorted({max(least_N_m, high / factor) for factor in (4.0, 2.0)})
    if high <= low * (1.0 + tolerance):
        return []
    parts = min(_BETWEEN + 1, math.ceil(math.log(high / low) / math.log1p(tolerance)))
    return [low * (high / low) ** (part / parts) for part in range(1, parts)]
