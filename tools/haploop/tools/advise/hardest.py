"""The corners that are hardest on a wall, found hold by hold in the direction in which it bears less."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from haploop.protocol.scene.scene import ElementTable, Scene
from haploop.tools.advise.walls.cases import FIRST_HOLDS, Case
from haploop.tools.advise.walls.corners import Corner, Ranges, design, flipped
from haploop.tools.advise.walls.store import Job, Tried
from haploop.tools.advise.walls.trial import Trial

# Walls that every corner is tried with, as multiples of one near the limit.
_RUNGS = tuple(1.1**step for step in range(-5, 7))
# Steps from a corner to its hardest neighbour, and how many corners of each hold are returned.
_STEPS, _TOLD = 4, 5

# What a corner bears at a hold: how many rungs up to the first that fails, and how many in all.
_Borne = tuple[int, int]


def hardest(
    loop: Scene, trial: Trial, elements: Sequence[ElementTable], of: Ranges, near_N_m: float
) -> tuple[Corner, ...]:
    """Returns the corners in which walls about this stiffness bear least, the hardest of each hold first.

    Empty if no wall is safe or nothing is uncertain. Main effects over the corners of the design show at which end each
    quantity is worse: that vertex is tried with all its neighbours, and the search continues from the hardest of all.
    """
    if not near_N_m or not of:
        return ()
    walls = tuple(Tried(near_N_m * rung, tuple(elements)) for rung in _RUNGS)
    known: dict[Case, _Borne] = {}

    def try_out(cases: Sequence[Case]) -> None:
        new = [case for case in dict.fromkeys(cases) if case not in known]
        jobs = [Job(loop, walls, (case,)) for case in new]
        for case, failures in zip(new, trial.of_jobs(jobs), strict=True):
            # Where friction holds the device off the wall, a case tells nothing.
            borne = [not failure or not failure.tried for failure in failures]
            known[case] = ([*borne, False].index(False), sum(borne))

    def order(hold: float) -> list[Case]:
        return sorted((case for case in known if case.hold == hold and case.corner), key=known.__getitem__)

    try_out([Case(hold, some) for some in design(of) for hold in FIRST_HOLDS])
    starts = [Case(hold, _vertex(of, lambda some, at=hold: known[Case(at, some)])) for hold in FIRST_HOLDS]
    try_out([*starts, *(near for start in starts for near in _neighbours(of, start))])
    for _ in range(_STEPS):
        try_out([near for hold in FIRST_HOLDS for near in _neighbours(of, order(hold)[0])])
    ranks = zip(*(order(hold)[:_TOLD] for hold in FIRST_HOLDS), strict=True)
    return tuple(dict.fromkeys(case.corner for rank in ranks for case in rank))


def _vertex(of: Ranges, borne: Callable[[Corner], _Borne]) -> Corner:
    """Returns the corner that main effects call the hardest: every quantity at the end at which less is borne."""
    corners = [some for some in design(of) if some]
    at: list[tuple[str, float]] = []
    for place, (name, (low, high)) in enumerate(of.items()):
        effect = sum(sum(borne(some)) * (1.0 if some[place][1] == high else -1.0) for some in corners)
        at.append((name, low if effect >= 0.0 else high))
    return tuple(at)


def _neighbours(of: Ranges, case: Case) -> list[Case]:
    return [Case(case.hold, some) for some in flipped(of, case.corner)]
