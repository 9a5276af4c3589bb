"""The search of the advice: which element with which parameter, how stiff, and that it withstands an attack."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from haploop.launch.stability.judge import judge_scene
from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.families import (
    BOTH,
    DAMPING,
    FAMILIES,
    NOTHING,
    SINGLE,
    UNIDIRECTIONAL,
    Family,
    Values,
    beside,
    first_choices,
    together,
)  # fmt: skip
from haploop.tools.advise.walls.cases import FIRST_HOLDS, Case, Ranges, attack, every_case, ranges
from haploop.tools.advise.walls.limit import LEAST_N_M, Limit, Query, ladder, limits
from haploop.tools.advise.walls.trial import Failure, Trial, Tried
from haploop.tools.linear.linearity import installed_kinds

# How closely limits are found while elements are compared, and that of the one advised.
ROUGH, _FINE = 0.12, 0.02
# An element that allows no more than this much beyond a simpler one is not worth having.
WORTH = 1.1
# Softer walls that have to bear everything, too, as shares of the limit.
_SOFTER = (0.8, 0.62, 0.48, 0.35, 0.25, 0.15, 0.08, 0.03)
# A wall that does not withstand the attack is lowered by this, so often at most.
_LOWER, _TIMES = 0.97, 60
# So much stiffer walls have to withstand it, too: where a count lies in the hold is chance, and differs with each.
_BEYOND = (1.0, 1.02, 1.04)
_STEADY = ("steady", "no-contact")

Choice = tuple[Family, Values]


@dataclass(frozen=True)
class Best:
    """The best of one family.

    Attributes:
        nominal: the limit of the loop as described, at the holds tried first.
        safe: the limit in every corner, where the family came that far; None where a simpler one bears as much.
    """

    family: Family
    values: Values
    nominal: Limit
    safe: Limit | None = None


@dataclass(frozen=True)
class Found:
    """What the search found.

    Attributes:
        bests: of every family.
        advised: the best of the family to use.
        stiffness_N_m: that withstood the attack, rounded down; 0 where none does.
        as_assumed: the best, and how stiff, were every assumed number right; None where nothing is assumed.
        breaks: the softest wall known not to bear everything, and what it does; None where none was found.
        cases: how many it was tried in, attack included.
    """

    bests: tuple[Best, ...]
    advised: Best
    stiffness_N_m: float
    as_assumed: Best | None
    breaks: tuple[float, Failure] | None
    cases: int


def search(
    loop: Scene, assumed: Sequence[str], trial: Trial, stage: Callable[[str], object] = lambda name: None
) -> Found:
    """Finds the element that bears the stiffest wall in all cases, assumed keys halved and doubled, and how stiff."""
    first = tuple(Case(hold) for hold in FIRST_HOLDS)

    def nominal(choices: Sequence[Choice], rungs: tuple[float, ...]) -> dict[Choice, Limit]:
        queries = [Query(loop, family.elements(values), first, rungs) for family, values in choices]
        return dict(zip(choices, limits(trial, queries, ROUGH), strict=True))

    stage("the wall alone")
    known = nominal([(NOTHING, ())], ladder(10.0, 1e5, 1.6))
    alone = max(10.0 * LEAST_N_M, known[NOTHING, ()].stiffness_N_m)
    stage("one element")
    rungs = ladder(alone / 2.0, alone * 8.0, 1.4)
    known |= nominal([(family, values) for family in SINGLE for values in first_choices(family, loop)], rungs)
    more = [(family, values) for family in SINGLE for values in beside(_equals(known, family)[0])]
    known |= nominal([choice for choice in more if choice not in known], rungs)
    stage("two elements")
    pairs = together(_equals(known, DAMPING)[-1], _equals(known, UNIDIRECTIONAL)[-1])
    known |= nominal([(BOTH, values) for values in pairs], rungs)
    stage("every corner")
    of, measured = ranges(loop, assumed), ranges(loop)
    bests = _in_corners(loop, trial, known, of)
    as_assumed = None if of == measured else _advised(_in_corners(loop, trial, known, measured))
    advised = _refined(loop, trial, _advised(bests), of)
    bests = [advised if best.family is advised.family else best for best in bests]
    stage("softer walls")
    top = _softer(loop, trial, advised, of)
    stage("the attack")
    stiffness, broken, count = _attacked(loop, trial, advised, top, attack(of))
    if not broken and top.failure:
        broken = [(top.fails_N_m, top.failure)]
    cases = count + len(every_case(of))
    return Found(tuple(bests), advised, stiffness, as_assumed, broken[-1] if broken else None, cases)


def _equals(known: dict[Choice, Limit], family: Family) -> list[Values]:
    """Returns the parameters whose limits are, as closely as they are known, the largest, from small to large."""
    tried = {values: limit.stiffness_N_m for (other, values), limit in known.items() if other is family}
    most = max(tried.values())
    return sorted(values for values, stiffness in tried.items() if stiffness >= most / (1.0 + ROUGH))


def _in_corners(loop: Scene, trial: Trial, known: dict[Choice, Limit], of: Ranges) -> list[Best]:
    """Returns the best of each family; those worth it with their limit in every corner, at the holds tried first.

    Of parameters that bear as much in the loop as described the smallest, a middle one and the largest are tried.
    """
    bests: list[Best] = []
    candidates: list[Choice] = []
    for family in FAMILIES:
        equals = _equals(known, family)
        bests.append(Best(family, equals[0], known[family, equals[0]]))
        if not family.parts or bests[-1].nominal.stiffness_N_m > WORTH * bests[0].nominal.stiffness_N_m:
            some = dict.fromkeys((equals[0], equals[len(equals) // 2], equals[-1]))
            candidates += [(family, values) for values in some]
    cases = every_case(of, FIRST_HOLDS)
    queries = []
    for family, values in candidates:
        top = known[family, values].stiffness_N_m or LEAST_N_M
        queries.append(Query(loop, family.elements(values), cases, ladder(top / 3.0, top * 1.06, 1.5)))
    safe = dict(zip(candidates, limits(trial, queries, ROUGH / 2.0), strict=True))
    for place, best in enumerate(bests):
        of_family = {values: limit for (family, values), limit in safe.items() if family is best.family}
        if of_family:
            values = max(of_family, key=lambda some: (of_family[some].stiffness_N_m, [-value for value in some]))
            bests[place] = Best(best.family, values, known[best.family, values], of_family[values])
    return bests


def _advised(bests: Sequence[Best]) -> Best:
    """Returns the family that bears most in every corner; one with more elements has to bear a tenth more."""
    advised = bests[0]
    for best in bests[1:]:
        less = advised.safe.stiffness_N_m if advised.safe else 0.0
        if best.safe and best.safe.stiffness_N_m > WORTH * less:
            advised = best
    return advised


def _refined(loop: Scene, trial: Trial, best: Best, of: Ranges) -> Best:
    """Returns the best with its parameter moved half a step up or down, as often as that bears more in every corner."""
    tried = {best.values}
    while True:
        near = best.safe.stiffness_N_m if best.safe else 0.0
        new = [values for values in beside(best.values) if values not in tried] if near else []
        rungs, cases = ladder(near, near * 1.5, 1.07), every_case(of, FIRST_HOLDS)
        found = limits(trial, [Query(loop, best.family.elements(values), cases, rungs) for values in new], ROUGH / 2.0)
        tried |= set(new)
        values, limit = max(zip(new, found, strict=True), key=lambda each: each[1].stiffness_N_m, default=((), None))
        if not limit or limit.stiffness_N_m <= near * 1.01:
            return best
        best = Best(best.family, values, _described(loop, trial, best.family, values, limit), limit)


def _described(loop: Scene, trial: Trial, family: Family, values: Values, safe: Limit) -> Limit:
    """Returns the limit of the loop as described, which bears what it bears in every corner."""
    first = tuple(Case(hold) for hold in FIRST_HOLDS)
    rungs = ladder(safe.stiffness_N_m, safe.stiffness_N_m * 3.0, 1.4)
    return limits(trial, [Query(loop, family.elements(values), first, rungs)], ROUGH)[0]


def _softer(loop: Scene, trial: Trial, advised: Best, of: Ranges) -> Limit:
    """Returns the limit at every hold in every corner, with all softer walls bearing it, too."""
    assert advised.safe
    near = advised.safe.stiffness_N_m
    if not near:
        return advised.safe
    elements, cases = advised.family.elements(advised.values), every_case(of)
    rungs = (*sorted(near * share for share in _SOFTER), near, min(advised.safe.fails_N_m, near * 1.1))
    return limits(trial, [Query(loop, elements, cases, rungs)], _FINE)[0]


def _attacked(
    loop: Scene, trial: Trial, advised: Best, top: Limit, cases: Sequence[Case]
) -> tuple[float, list[tuple[float, Failure]], int]:
    """Lowers the wall until no attack breaks it: projected friction in every case, exact friction in a few."""
    elements, broken = advised.family.elements(advised.values), []
    stiffness = rounded_down(top.stiffness_N_m)
    for _ in range(_TIMES):
        if stiffness < LEAST_N_M:
            return 0.0, broken, len(cases)
        found = trial.failures(loop, [Tried(share * stiffness, elements) for share in _BEYOND], cases)
        failure = next((each for each in found if each), None) or _judged(loop, Tried(stiffness, elements))
        if not failure:
            return stiffness, broken, len(_BEYOND) * len(cases)
        first = next((share for share, each in zip(_BEYOND, found, strict=True) if each), 1.0)
        broken.append((first * stiffness, failure))
        stiffness = rounded_down(stiffness * _LOWER)
    return 0.0, broken, len(cases)


def _judged(loop: Scene, wall: Tried) -> Failure | None:
    """Judges the wall by pushes and with exact friction, see ``haploop.launch.stability``, at the holds tried first."""
    for hold in FIRST_HOLDS:
        case = Case(hold, sway=0.0)
        scene = case.scene(loop)
        assert scene.wall
        scene = replace(scene, wall=replace(scene.wall, stiffness=wall.stiffness_N_m), dissipation=wall.elements)
        found = judge_scene(scene, installed_kinds())
        if found.word not in _STEADY and not (found.word == "limit-cycle" and not found.felt):
            numbers = found.width_m, found.force_ripple_N, found.frequency_Hz
            return Failure(f"{case.words}, pushed: {found.word}", scene.duration, found.word == "diverged", *numbers)
    return None


def rounded_down(stiffness: float) -> float:
    """Returns a stiffness rounded down to three digits; of one that begins with 5 or more the last is 0 or 5."""
    if not stiffness:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(stiffness)) - 2)
    unit *= 5.0 if stiffness >= 500.0 * unit else 1.0
    return float(f"{math.floor(stiffness / unit * (1.0 + 1e-12)) * unit:.12g}")
