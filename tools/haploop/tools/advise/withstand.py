"""The last part of the search: walls are lowered until no attack breaks one, with whichever element bears most."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from haploop.launch.stability.judge import judge_scene
from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.families import Family, Values, beside
from haploop.tools.advise.hardest import hardest
from haploop.tools.advise.walls.cases import FIRST_HOLDS, Case, attack, every_case
from haploop.tools.advise.walls.corners import Corner, Ranges
from haploop.tools.advise.walls.limit import LEAST_N_M, Limit, Query, ladder, limits
from haploop.tools.advise.walls.store import Failure, Tried
from haploop.tools.advise.walls.trial import Trial
from haploop.tools.linear.linearity import installed_kinds

# How closely limits are found while elements are compared, and that of the one advised.
ROUGH, _FINE = 0.12, 0.02
# An element that does not allow more than this many times as much as a simpler one is not worth having.
WORTH = 1.1
# Softer walls that have to bear everything, too, as shares of the limit.
_SOFTER = (0.8, 0.62, 0.48, 0.35, 0.25, 0.15, 0.08, 0.03)
# A wall that does not withstand the attack is lowered by this factor, but not below this share.
_LOWER, _LEAST = 0.97, 0.16
# Below this share of its limit in every corner, an element is tried in a smaller size.
_FALLEN = 0.5
# Walls stiffer by these factors have to withstand it, too: where within a count the hold lies is chance, and differs
# from wall to wall.
BEYOND = (1.0, 1.02, 1.04)
# How often parameters are moved, each time in the corners that were hardest on the previous ones.
_MOVES = 3
# How many of the hardest corners are pushed.
_PUSHED = 3
_STEADY = ("steady", "no-contact")
# The softest wall known not to bear everything, and what it does.
Broken = tuple[float, Failure]


@dataclass(frozen=True)
class Best:
    """The best of one family.

    Attributes:
        nominal: the limit of the loop as described, at the holds tried first.
        safe: the limit in every corner, if the family came that far; None if a simpler one bears as much.
        smaller: the same family with no parameter larger, those that bear most in every corner first.
    """

    family: Family
    values: Values
    nominal: Limit
    safe: Limit | None = None
    smaller: tuple[Best, ...] = ()


@dataclass
class Rival:
    """A family that may be advised.

    Attributes:
        bound_N_m: no stiffer wall withstands, as far as is known.
        worth: how many times as much as the others it has to bear.
        floor_N_m: the wall is not lowered below this; None until softer walls have been tried.
        hardest: corners known to be hard on its walls, the hardest first.
        broke: cases that broke stiffer ones under attack.
        most: a larger size whose walls had to be lowered far: parameters are moved only below it; None without.
    """

    best: Best
    bound_N_m: float
    worth: float
    broken: Broken | None = None
    floor_N_m: float | None = None
    hardest: tuple[Corner, ...] = ()
    broke: list[Case] = field(default_factory=list)
    most: Values | None = None


def rivals(bests: Sequence[Best], hardest: tuple[Corner, ...] = ()) -> list[Rival]:
    """Returns every family with a limit in every corner, beginning with the one that would be advised.

    One with more elements than that has to bear a tenth more than it. ``hardest`` are corners known to be hard on all.
    """
    first = advised(bests)
    found, worth = [], 1.0
    for best in bests:
        if best.safe:
            found.append(Rival(best, best.safe.stiffness_N_m, worth, hardest=hardest))
        worth = WORTH if best is first else worth
    return sorted(found, key=lambda rival: rival.best is not first)


def advised(bests: Sequence[Best]) -> Best:
    """Returns the family that bears most in every corner; one with more elements has to bear a tenth more."""
    found = bests[0]
    for best in bests[1:]:
        less = found.safe.stiffness_N_m if found.safe else 0.0
        if best.safe and best.safe.stiffness_N_m > WORTH * less:
            found = best
    return found


def withstand(loop: Scene, trial: Trial, some: Sequence[Rival], of: Ranges) -> Rival:
    """Lowers the walls of rivals until the stiffest of them withstands every attack, and returns its rival.

    Its bound is then that stiffness, 0 if none withstands; the others have lower bounds. A smaller size of an element
    joins the rivals once the wall of a larger one had to be lowered far below what it bears in every corner.
    """
    some = [*some]
    while True:
        rival = max(some, key=lambda each: each.bound_N_m / each.worth)
        if rival.floor_N_m is None:
            _prepare(loop, trial, rival, of)
        elif rival.bound_N_m < max(LEAST_N_M, rival.floor_N_m):
            rival.bound_N_m = 0.0
            if not (rival.best.smaller or any(each.bound_N_m for each in some)):
                return rival
        elif broken := _breaks(loop, trial, rival, of):
            rival.broken = broken
            if case := broken[1].tried:
                rival.broke.append(case)
                rival.hardest = tuple(dict.fromkeys((case.corner, *rival.hardest))) if case.corner else rival.hardest
            rival.bound_N_m = rounded_down(rival.bound_N_m * _LOWER)
        else:
            return rival
        if rival.best.smaller and rival.best.safe and rival.bound_N_m < _FALLEN * rival.best.safe.stiffness_N_m:
            some.append(smaller_than(rival))
            rival.best = replace(rival.best, smaller=())


def smaller_than(rival: Rival) -> Rival:
    """Returns the rival with less of its element, in the corners and cases known to be hard on it."""
    first, *rest = rival.best.smaller
    assert first.safe
    best = replace(first, smaller=tuple(each for each in rest if is_less(each.values, first.values)))
    hard = rival.hardest, [*rival.broke]
    return Rival(best, first.safe.stiffness_N_m, rival.worth, None, None, *hard, most=rival.best.values)


def is_less(some: Values, others: Values) -> bool:
    """Tells whether no parameter is larger, and one is smaller."""
    return some != others and all(value <= other for value, other in zip(some, others, strict=True))


def _prepare(loop: Scene, trial: Trial, rival: Rival, of: Ranges) -> None:
    """Moves the parameters of a rival as long as that helps, then tries it at every hold, and softer walls.

    The corners that are hardest on it before and after are included.
    """
    for _ in range(_MOVES):
        values = rival.best.values
        if rival.best.safe and (near := rival.best.safe.stiffness_N_m):
            found = hardest(loop, trial, rival.best.family.elements(values), of, near)
            rival.hardest = tuple(dict.fromkeys((*found, *rival.hardest)))
            if values:
                _refine(loop, trial, rival, of)
        if rival.best.values == values:
            break
    top = _softer(loop, trial, rival, of)
    rival.broken = (top.fails_N_m, top.failure) if top.failure else None
    rival.bound_N_m = rounded_down(top.stiffness_N_m)
    rival.floor_N_m = rival.bound_N_m * _LEAST


def _refine(loop: Scene, trial: Trial, rival: Rival, of: Ranges) -> None:
    """Moves parameters half a step up or down, as long as that bears more in every corner known to be hard."""
    cases = every_case(of, FIRST_HOLDS, rival.hardest)

    def found(some: Sequence[Values], rungs: tuple[float, ...]) -> list[tuple[Values, Limit]]:
        queries = [Query(loop, rival.best.family.elements(each), cases, rungs) for each in some]
        return list(zip(some, limits(trial, queries, ROUGH / 2.0), strict=True))

    assert rival.best.safe
    near = rival.best.safe.stiffness_N_m
    [best], tried = found([rival.best.values], ladder(near * 0.7, near, 1.2)), {rival.best.values}
    while near := best[1].stiffness_N_m:
        new = [other for other in beside(best[0]) if other not in tried]
        if most := rival.most:
            new = [other for other in new if is_less(other, most)]
        tried |= set(new)
        more = max(found(new, ladder(near, near * 1.5, 1.07)), key=lambda each: each[1].stiffness_N_m, default=best)
        if more[1].stiffness_N_m <= near * 1.01:
            break
        best = more
    rival.best = replace(rival.best, values=best[0], safe=best[1])


def _softer(loop: Scene, trial: Trial, rival: Rival, of: Ranges) -> Limit:
    """Returns the limit at every hold in every corner, with all softer walls bearing it, too."""
    best = rival.best
    assert best.safe
    near = best.safe.stiffness_N_m
    if not near:
        return best.safe
    elements, cases = best.family.elements(best.values), every_case(of, hardest=rival.hardest)
    rungs = (*sorted(near * share for share in _SOFTER), near, min(best.safe.fails_N_m, near * 1.1))
    return limits(trial, [Query(loop, elements, cases, rungs)], _FINE)[0]


def _breaks(loop: Scene, trial: Trial, rival: Rival, of: Ranges) -> Broken | None:
    """Attacks a wall and slightly stiffer ones: projected friction in every case, exact friction in a few."""
    elements = rival.best.family.elements(rival.best.values)
    walls = [Tried(share * rival.bound_N_m, elements) for share in BEYOND]
    for cases in ((*rival.broke,), attack(of, rival.hardest)):  # what broke a stiffer one is tried first
        for wall, failure in zip(walls, trial.failures(loop, walls, cases) if cases else (), strict=False):
            if failure:
                return wall.stiffness_N_m, failure
    failure = _judged(loop, walls[0], rival.hardest)
    return (rival.bound_N_m, failure) if failure else None


def _judged(loop: Scene, wall: Tried, corners: Sequence[Corner]) -> Failure | None:
    """Judges the wall by pushes and with exact friction, see ``haploop.launch.stability``, at the holds tried first.

    That is in the loop as described and in the hardest corners.
    """
    for case in (Case(hold, some, sway=0.0) for some in ((), *corners[:_PUSHED]) for hold in FIRST_HOLDS):
        scene = case.scene(loop)
        assert scene.wall
        scene = replace(scene, wall=replace(scene.wall, stiffness=wall.stiffness_N_m), dissipation=wall.elements)
        # The taps of the attack test how hard a wall may be hit: a blow of three times the hold is harder than those.
        found = judge_scene(scene, installed_kinds(), blows=())
        if found.word not in _STEADY and not (found.word == "limit-cycle" and not found.felt):
            numbers = found.width_m, found.force_ripple_N, found.frequency_Hz
            words = f"{case.words}, pushed: {found.word}"
            return Failure(words, scene.duration, found.word == "diverged", *numbers, tried=case)
    return None


def rounded_down(stiffness: float) -> float:
    """Returns a stiffness rounded down to three digits; if it begins with 5 or more, the last digit is 0 or 5."""
    if not stiffness:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(stiffness)) - 2)
    unit *= 5.0 if stiffness >= 500.0 * unit else 1.0
    return float(f"{math.floor(stiffness / unit * (1.0 + 1e-12)) * unit:.12g}")
