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
    NOTHING,
    OTHERS,
    SINGLE,
    UNIDIRECTIONAL,
    Family,
    Values,
    beside,
    first_choices,
    together,
)  # fmt: skip
from haploop.tools.advise.others import Choice, Hidden, hiding, others_bearing, worth_more
from haploop.tools.advise.walls.cases import FIRST_HOLDS, Case, Ranges, attack, corner, every_case, ranges
from haploop.tools.advise.walls.limit import LEAST_N_M, Limit, Query, ladder, limits
from haploop.tools.advise.walls.trial import Failure, Trial, Tried
from haploop.tools.linear.linearity import installed_kinds

# How closely limits are found while elements are compared, and that of the one advised.
ROUGH, _FINE = 0.12, 0.02
# An element that allows no more than this much beyond a simpler one is not worth having.
WORTH = 1.1
# Softer walls that have to bear everything, too, as shares of the limit.
_SOFTER = (0.8, 0.62, 0.48, 0.35, 0.25, 0.15, 0.08, 0.03)
# Parameters that are tried in every corner, by their places among those that bear as much in the loop as described;
# what suits a device of half the mass is smaller.
_MANY, _WIDE, _ONE = (0.0, 0.5, 1.0), (-1.0, 0.0, 1.0), (0.5,)
# A wall that does not withstand the attack is lowered by this, so often at most.
_LOWER, _TIMES = 0.97, 60
# So much stiffer walls have to withstand it, too: where a count lies in the hold is chance, and differs with each.
_BEYOND = (1.0, 1.02, 1.04)
_STEADY = ("steady", "no-contact")


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
        others: elements that bear no wall of ``simple_N_m`` as described, the best of the simple ones.
        hidden: elements that render less than their wall, and may hold more than any other.
    """

    bests: tuple[Best, ...]
    advised: Best
    stiffness_N_m: float
    as_assumed: Best | None
    breaks: tuple[float, Failure] | None
    cases: int
    others: tuple[Family, ...] = ()
    simple_N_m: float = 0.0
    hidden: tuple[Hidden, ...] = ()


def search(
    loop: Scene, assumed: Sequence[str], trial: Trial, stage: Callable[[str], object] = lambda name: None
) -> Found:
    """Finds the element that bears the stiffest wall in all cases, assumed keys halved and doubled, and how stiff."""
    first = tuple(Case(hold) for hold in FIRST_HOLDS)

    def nominal(choices: Sequence[Choice], rungs: tuple[float, ...], least_N_m: float) -> dict[Choice, Limit]:
        queries = [Query(loop, family.elements(values), first, rungs, least_N_m) for family, values in choices]
        return dict(zip(choices, limits(trial, queries, ROUGH), strict=True))

    stage("the wall alone")
    known = nominal([(NOTHING, ())], ladder(10.0, 1e5, 1.6), LEAST_N_M)
    alone = max(10.0 * LEAST_N_M, known[NOTHING, ()].stiffness_N_m)
    stage("one element")
    rungs = ladder(alone / 2.0, alone * 8.0, 1.4), alone / 2.0
    known |= nominal([(family, values) for family in SINGLE for values in first_choices(family, loop)], *rungs)
    more = [(family, values) for family in SINGLE for values in beside(_equals(known, family)[0])]
    known |= nominal([choice for choice in more if choice not in known], *rungs)
    stage("two elements")
    pairs = together(_equals(known, DAMPING)[-1], _equals(known, UNIDIRECTIONAL)[-1])
    known |= nominal([(BOTH, values) for values in pairs], *rungs)
    stage("every other element")
    borne = [limit.stiffness_N_m for limit in known.values()]
    simple = max(LEAST_N_M, WORTH * known[NOTHING, ()].stiffness_N_m, *borne)
    known |= nominal(others_bearing(loop, trial, simple), *rungs)
    good = worth_more(known, simple)
    more = [(family, values) for family in good for values in beside(_equals(known, family)[0])]
    known |= nominal([choice for choice in more if choice not in known], *rungs)
    hidden = hiding(loop, trial, alone, WORTH * max(limit.stiffness_N_m for limit in known.values()))
    some = (*SINGLE, BOTH, *good)
    stage("every corner")
    of, measured = ranges(loop, assumed), ranges(loop)
    bests = _in_corners(loop, trial, known, of, _MANY if of == measured else _WIDE, some)
    as_assumed = None if of == measured else _advised(_in_corners(loop, trial, known, measured, _ONE, some))
    best = _advised(bests)
    values, safe = _refined(loop, trial, best, of)
    described = known.get((best.family, values)) or nominal([(best.family, values)], *rungs)[best.family, values]
    advised = Best(best.family, values, described, safe)
    stage("softer walls")
    top = _softer(loop, trial, advised, of)
    stage("the attack")
    stiffness, broken = _attacked(loop, trial, advised, top, of)
    cases = len(_BEYOND) * len(attack(of)) + len(every_case(of))
    shown = tuple(advised if each is best else each for each in bests)
    others = tuple(family for family in OTHERS if family not in good)
    return Found(shown, advised, stiffness, as_assumed, broken, cases, others, simple, hidden)


def _equals(known: dict[Choice, Limit], family: Family) -> list[Values]:
    """Returns the parameters whose limits are, as closely as they are known, the largest, from small to large."""
    tried = {values: known[family, values].stiffness_N_m for values in _values(known, family)}
    most = max(tried.values())
    return sorted(values for values, stiffness in tried.items() if stiffness >= most / (1.0 + ROUGH))


def _values(known: dict[Choice, Limit], family: Family) -> list[Values]:
    return [values for other, values in known if other is family]


def _is_half(some: Values, of: Values) -> bool:
    """Tells whether all parameters are about half of others, or less."""
    return bool(some) and all(small <= 0.55 * large for small, large in zip(some, of, strict=True))


def _in_corners(
    loop: Scene,
    trial: Trial,
    known: dict[Choice, Limit],
    of: Ranges,
    places: Sequence[float],
    families: Sequence[Family],
) -> list[Best]:
    """Returns the wall alone and the best of some families, with limits in every corner, at the holds tried first.

    Of parameters that bear as much in the loop as described those at these places, from the smallest, 0, to the
    largest, 1; below 0 the next that are half of the smallest or less. None is tried below what makes it worth having.
    """
    cases, alone = every_case(of, FIRST_HOLDS), known[NOTHING, ()]

    def query(choice: Choice, least_N_m: float) -> Query:
        family, values = choice
        top = known[choice].stiffness_N_m or LEAST_N_M
        rungs = ladder(max(least_N_m, top / 3.0), max(least_N_m, top) * 1.06, 1.5)
        return Query(loop, family.elements(values), cases, rungs, least_N_m)

    bests = [Best(NOTHING, (), alone, limits(trial, [query((NOTHING, ()), LEAST_N_M)], ROUGH / 2.0)[0])]
    least = max(LEAST_N_M, WORTH * bests[0].safe.stiffness_N_m) if bests[0].safe else LEAST_N_M
    candidates: list[Choice] = []
    for family in families:
        equals = _equals(known, family)
        bests.append(Best(family, equals[0], known[family, equals[0]]))
        if bests[-1].nominal.stiffness_N_m > WORTH * alone.stiffness_N_m:
            smaller = max((each for each in _values(known, family) if _is_half(each, equals[0])), default=equals[0])
            some = (equals[round(place * (len(equals) - 1))] if place >= 0.0 else smaller for place in places)
            candidates += dict.fromkeys((family, values) for values in some)
    found = limits(trial, [query(each, least) for each in candidates], ROUGH / 2.0)
    safe = {choice: limit for choice, limit in zip(candidates, found, strict=True) if limit.stiffness_N_m}
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


def _refined(loop: Scene, trial: Trial, best: Best, of: Ranges) -> tuple[Values, Limit]:
    """Returns parameters moved half a step up or down, as often as that bears more in every corner, and their limit."""
    assert best.safe
    values, safe, tried = best.values, best.safe, {best.values}
    while near := safe.stiffness_N_m:
        new = [other for other in beside(values) if other not in tried]
        rungs, cases = ladder(near, near * 1.5, 1.07), every_case(of, FIRST_HOLDS)
        found = limits(trial, [Query(loop, best.family.elements(each), cases, rungs) for each in new], ROUGH / 2.0)
        tried |= set(new)
        more = max(zip(new, found, strict=True), key=lambda each: each[1].stiffness_N_m, default=None)
        if not more or more[1].stiffness_N_m <= near * 1.01:
            break
        values, safe = more
    return values, safe


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
    loop: Scene, trial: Trial, advised: Best, top: Limit, of: Ranges
) -> tuple[float, tuple[float, Failure] | None]:
    """Lowers the wall until no attack breaks it: projected friction in every case, exact friction in a few.

    Returns the stiffness, and the softest wall that broke with what it does.
    """
    elements, cases = advised.family.elements(advised.values), attack(of)
    broken = (top.fails_N_m, top.failure) if top.failure else None
    stiffness = rounded_down(top.stiffness_N_m)
    for _ in range(_TIMES):
        if stiffness < LEAST_N_M:
            break
        found = trial.failures(loop, [Tried(share * stiffness, elements) for share in _BEYOND], cases)
        broke = ((share, each) for share, each in zip(_BEYOND, found, strict=True) if each)
        share, failure = next(broke, None) or (1.0, _judged(loop, Tried(stiffness, elements), of))
        if not failure:
            return stiffness, broken
        broken = share * stiffness, failure
        stiffness = rounded_down(stiffness * _LOWER)
    return 0.0, broken


def _judged(loop: Scene, wall: Tried, of: Ranges) -> Failure | None:
    """Judges the wall by pushes and with exact friction, see ``haploop.launch.stability``, in the cases tried first.

    They are the loop as described and the likely worst corner, in which all that is uncertain is least.
    """
    for case in (Case(hold, some, sway=0.0) for some in ((), corner(of, 0)) for hold in FIRST_HOLDS):
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
