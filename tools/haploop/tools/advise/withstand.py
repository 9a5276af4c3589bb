"""The last part of the search: walls are lowered until no attack breaks one, with whichever element bears most."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from haploop.launch.stability.judge import judge_scene
from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.families import Family, Values, beside
from haploop.tools.advise.walls.cases import FIRST_HOLDS, Case, Ranges, attack, corner, every_case
from haploop.tools.advise.walls.limit import LEAST_N_M, Limit, Query, ladder, limits
from haploop.tools.advise.walls.trial import Failure, Trial, Tried
from haploop.tools.linear.linearity import installed_kinds

# How closely limits are found while elements are compared, and that of the one advised.
ROUGH, _FINE = 0.12, 0.02
# An element that allows no more than this much beyond a simpler one is not worth having.
WORTH = 1.1
# Softer walls that have to bear everything, too, as shares of the limit.
_SOFTER = (0.8, 0.62, 0.48, 0.35, 0.25, 0.15, 0.08, 0.03)
# A wall that does not withstand the attack is lowered by this, to this share at least.
_LOWER, _LEAST = 0.97, 0.16
# So much stiffer walls have to withstand it, too: where a count lies in the hold is chance, and differs with each.
BEYOND = (1.0, 1.02, 1.04)
_STEADY = ("steady", "no-contact")
# The softest wall known not to bear everything, and what it does.
Broken = tuple[float, Failure]


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


@dataclass
class Rival:
    """A family that may be advised.

    Attributes:
        bound_N_m: no stiffer wall withstands, as far as is known.
        worth: how many times as much as the others it has to bear.
        floor_N_m: the wall is not lowered below; None until softer walls were tried.
    """

    best: Best
    bound_N_m: float
    worth: float
    broken: Broken | None = None
    floor_N_m: float | None = None


def rivals(bests: Sequence[Best]) -> list[Rival]:
    """Returns every family with a limit in every corner, that which would be advised first.

    One with more elements than that has to bear a tenth more than it.
    """
    first = advised(bests)
    found, worth = [], 1.0
    for best in bests:
        if best.safe:
            found.append(Rival(best, best.safe.stiffness_N_m, worth))
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
    """Lowers the walls of rivals until that of the one with the stiffest withstands every attack, and returns that one.

    Its bound is the stiffness then, 0 where none withstands; others have lower ones.
    """
    while True:
        rival = max(some, key=lambda each: each.bound_N_m / each.worth)
        if rival.floor_N_m is None:
            _prepare(loop, trial, rival, of)
        elif rival.bound_N_m < max(LEAST_N_M, rival.floor_N_m):
            rival.bound_N_m = 0.0
            if not any(each.bound_N_m for each in some):
                return rival
        elif broken := _breaks(loop, trial, rival, of):
            rival.broken = broken
            rival.bound_N_m = rounded_down(rival.bound_N_m * _LOWER)
        else:
            return rival


def _prepare(loop: Scene, trial: Trial, rival: Rival, of: Ranges) -> None:
    """Moves the parameters of a rival as long as that helps, and tries it at every hold, and softer walls."""
    values, safe = _refined(loop, trial, rival.best, of)
    rival.best = replace(rival.best, values=values, safe=safe)
    top = _softer(loop, trial, rival.best, of)
    rival.broken = (top.fails_N_m, top.failure) if top.failure else None
    rival.bound_N_m = rounded_down(top.stiffness_N_m)
    rival.floor_N_m = rival.bound_N_m * _LEAST


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


def _softer(loop: Scene, trial: Trial, best: Best, of: Ranges) -> Limit:
    """Returns the limit at every hold in every corner, with all softer walls bearing it, too."""
    assert best.safe
    near = best.safe.stiffness_N_m
    if not near:
        return best.safe
    elements, cases = best.family.elements(best.values), every_case(of)
    rungs = (*sorted(near * share for share in _SOFTER), near, min(best.safe.fails_N_m, near * 1.1))
    return limits(trial, [Query(loop, elements, cases, rungs)], _FINE)[0]


def _breaks(loop: Scene, trial: Trial, rival: Rival, of: Ranges) -> Broken | None:
    """Attacks a wall and slightly stiffer ones: projected friction in every case, exact friction in a few."""
    elements = rival.best.family.elements(rival.best.values)
    found = trial.failures(loop, [Tried(share * rival.bound_N_m, elements) for share in BEYOND], attack(of))
    broke = ((share, each) for share, each in zip(BEYOND, found, strict=True) if each)
    share, failure = next(broke, None) or (1.0, _judged(loop, Tried(rival.bound_N_m, elements), of))
    return (share * rival.bound_N_m, failure) if failure else None


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
