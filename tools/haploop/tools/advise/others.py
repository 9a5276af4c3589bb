"""Elements other than the simple ones: which are worth trying in every corner, and which may hold more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.families import HIDING, OTHERS, Family, Values, applies, box, first_choices, halton
from haploop.tools.advise.walls.cases import FIRST_HOLDS, Case
from haploop.tools.advise.walls.limit import Query, ladder
from haploop.tools.advise.walls.rendered import tried
from haploop.tools.advise.walls.store import Job, Tried
from haploop.tools.advise.walls.trial import Trial

# How many parameters are tried of an element that renders less than its wall, and how closely its limit is found.
_POINTS, _TOLERANCE = 6, 0.25

Choice = tuple[Family, Values]


@dataclass(frozen=True)
class Hidden:
    """An element that renders less than its wall, and what it holds in the loop as described, N/m."""

    family: Family
    values: Values
    held_N_m: float


def others_bearing(loop: Scene, trial: Trial, cases: Sequence[Case], least_N_m: float) -> list[Choice]:
    """Returns the other elements, with every parameter with which a wall this stiff bears all the given cases."""
    choices = [(family, values) for family in OTHERS for values in first_choices(family, loop)]
    return bearing(loop, trial, choices, cases, least_N_m)


def hiding(loop: Scene, trial: Trial, alone_N_m: float, least_N_m: float) -> tuple[Hidden, ...]:
    """Returns the elements that render less than their wall, but hold more than this at the holds tried first."""
    first, rungs = tuple(Case(hold) for hold in FIRST_HOLDS), ladder(alone_N_m / 2.0, alone_N_m * 8.0, 2.0)
    found: list[Hidden] = []
    for family in (each for each in HIDING if applies(each, loop)):
        choices = [(family, values) for values in halton(box(family, loop, alone_N_m), _POINTS)]
        # What is held is less than the wall: if this wall is too stiff for the loop, so is any that would hold as much.
        points = [values for _, values in bearing(loop, trial, choices, first, least_N_m)]
        held = tried(trial, [Query(loop, family.elements(values), first, rungs) for values in points], _TOLERANCE)
        some = zip(points, held, strict=True)
        values, best = max(some, key=lambda each: each[1].rendered.held_N_m, default=((), None))
        if best and best.rendered.held_N_m > least_N_m:
            found.append(Hidden(family, values, best.rendered.held_N_m))
    return tuple(found)


def bearing(
    loop: Scene, trial: Trial, choices: Sequence[Choice], cases: Sequence[Case], stiffness_N_m: float
) -> list[Choice]:
    """Returns those of some choices with which a wall of this stiffness bears all cases."""
    jobs = [Job(loop, (Tried(stiffness_N_m, family.elements(values)),), tuple(cases)) for family, values in choices]
    return [choice for choice, [failure] in zip(choices, trial.of_jobs(jobs), strict=True) if not failure]
