"""Elements beside the simple ones: which are worth trying in every corner, and which may hold more."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.families import HIDING, NOTHING, OTHERS, Family, Values, applies, box, halton
from haploop.tools.advise.walls.cases import FIRST_HOLDS, Case
from haploop.tools.advise.walls.limit import Limit, Query, ladder
from haploop.tools.advise.walls.rendered import tried
from haploop.tools.advise.walls.trial import Trial

# So many of the other elements are tried in every corner at most.
_MOST = 2
# Parameters that are tried of an element that renders less than its wall, and how closely its limit is found.
_POINTS, _TOLERANCE = 6, 0.25


@dataclass(frozen=True)
class Hidden:
    """An element that renders less than its wall, and what it holds in the loop as described, N/m."""

    family: Family
    values: Values
    held_N_m: float


def worth_more(known: Mapping[tuple[Family, Values], Limit], worth: float) -> list[Family]:
    """Returns the other elements that bear more than every simple one, and ``worth`` times what none does."""
    most: dict[Family, float] = {}
    for (family, _), limit in known.items():
        most[family] = max(most.get(family, 0.0), limit.stiffness_N_m)
    least = max(worth * most[NOTHING], *(most[family] for family in most if family not in OTHERS))
    return sorted((family for family in OTHERS if most[family] > least), key=lambda family: -most[family])[:_MOST]


def hiding(loop: Scene, trial: Trial, alone_N_m: float, least_N_m: float) -> tuple[Hidden, ...]:
    """Returns the elements that render less than their wall, but hold more than this at the holds tried first."""
    first, rungs = tuple(Case(hold) for hold in FIRST_HOLDS), ladder(alone_N_m / 2.0, alone_N_m * 8.0, 2.0)
    found: list[Hidden] = []
    for family in (each for each in HIDING if applies(each, loop)):
        points = halton(box(family, loop, alone_N_m), _POINTS)
        held = tried(trial, [Query(loop, family.elements(values), first, rungs) for values in points], _TOLERANCE)
        values, best = max(zip(points, held, strict=True), key=lambda each: each[1].rendered.held_N_m)
        if best.rendered.held_N_m > least_N_m:
            found.append(Hidden(family, values, best.rendered.held_N_m))
    return tuple(found)
