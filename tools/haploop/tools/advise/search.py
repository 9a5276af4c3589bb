"""The search of the advice: which element with which parameter, how stiff, and that it withstands an attack."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

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
from haploop.tools.advise.hardest import hardest
from haploop.tools.advise.others import Choice, Hidden, hiding, others_bearing
from haploop.tools.advise.walls.cases import FIRST_HOLDS, Case, attack, every_case
from haploop.tools.advise.walls.corners import Corner, ranges
from haploop.tools.advise.walls.limit import LEAST_N_M, Limit, Query, ladder, limits
from haploop.tools.advise.walls.trial import Trial
from haploop.tools.advise.withstand import (
    BEYOND,
    ROUGH,
    WORTH,
    Best,
    Broken,
    Rival,
    advised,
    is_less,
    rivals,
    withstand,
)  # fmt: skip

# The stages reported while it runs; the last is reported by the advice.
STAGES = (
    "the wall alone",
    "one element",
    "two elements",
    "every corner",
    "every other element",
    "softer walls and the attack",
    "changes of the device",
)
# How many of the corners hardest on the wall alone are added to those of the design.
_HARDEST = 6
# How many of each wall's hardest corners are used to find what a change would gain.
_TOLD = 2


@dataclass(frozen=True)
class Found:
    """What the search found.

    Attributes:
        bests: the best of every family.
        advised: the best of the family to use.
        stiffness_N_m: the stiffness that withstood the attack, rounded down; 0 if none does.
        as_assumed: the best, and how stiff, if every assumed number were right; None if nothing is assumed.
        breaks: the softest wall known not to bear everything, and what it does; None if none was found.
        cases: how many cases it was tried in, attack included.
        others: elements that bear no wall of ``worth_N_m`` in every corner, a tenth more than the best simple one.
        hidden: elements that render less than their wall, and may hold more than any other.
        alone_N_m: the wall without an element that withstood the attack in the same way.
        hardest: the corners that are hardest on the wall with the element advised, and on that without.
        fell: elements that bore more in every corner, each with the softest wall, N/m, known not to bear everything.
    """

    bests: tuple[Best, ...]
    advised: Best
    stiffness_N_m: float
    as_assumed: Best | None
    breaks: Broken | None
    cases: int
    others: tuple[Family, ...] = ()
    worth_N_m: float = 0.0
    hidden: tuple[Hidden, ...] = ()
    fell: tuple[tuple[Best, float], ...] = ()
    alone_N_m: float = 0.0
    hardest: tuple[Corner, ...] = ()

    def attacked(self, best: Best) -> tuple[float, bool] | None:
        """Returns the wall, N/m, of one of ``bests`` that withstood the attack and True, or the softest that did not.

        None if it was not attacked, since another bears more, or as much with fewer elements.
        """
        if best is self.advised:
            return self.stiffness_N_m, True
        if best.family is NOTHING:
            return self.alone_N_m, True
        below = [stiffness_N_m for fallen, stiffness_N_m in self.fell if fallen.family is best.family]
        return (min(below), False) if below else None


def search(
    loop: Scene, assumed: Sequence[str], trial: Trial, stage: Callable[[str], object] = lambda name: None
) -> Found:
    """Finds the element that bears the stiffest wall in all cases, assumed keys halved and doubled, and that wall."""
    first = tuple(Case(hold) for hold in FIRST_HOLDS)

    def nominal(choices: Sequence[Choice], rungs: tuple[float, ...], least_N_m: float) -> dict[Choice, Limit]:
        queries = [Query(loop, family.elements(values), first, rungs, least_N_m) for family, values in choices]
        return dict(zip(choices, limits(trial, queries, ROUGH), strict=True))

    stage("the wall alone")
    known = nominal([(NOTHING, ())], ladder(10.0, 1e5, 1.6), LEAST_N_M)
    near = max(10.0 * LEAST_N_M, known[NOTHING, ()].stiffness_N_m)
    stage("one element")
    rungs = ladder(near / 2.0, near * 8.0, 1.4), near / 2.0
    known |= nominal([(family, values) for family in SINGLE for values in first_choices(family, loop)], *rungs)
    more = [(family, values) for family in SINGLE for values in beside(_equals(known, family)[0])]
    known |= nominal([choice for choice in more if choice not in known], *rungs)
    stage("two elements")
    pairs = together(_equals(known, DAMPING)[-1], _equals(known, UNIDIRECTIONAL)[-1])
    known |= nominal([(BOTH, values) for values in pairs], *rungs)
    stage("every corner")
    of, measured = ranges(loop, assumed), ranges(loop)
    query = Query(loop, (), every_case(of, FIRST_HOLDS), ladder(near / 4.0, near, 1.6))
    worst = hardest(loop, trial, (), of, limits(trial, [query], ROUGH)[0].stiffness_N_m)[:_HARDEST]
    cases, some = every_case(of, FIRST_HOLDS, worst), (*SINGLE, BOTH)
    bests = in_corners(loop, trial, known, cases, some, worth_trying(known, some))
    stage("every other element")
    borne = max(best.safe.stiffness_N_m for best in bests if best.safe)
    worth = max(LEAST_N_M, WORTH * borne)
    going_on = others_bearing(loop, trial, cases, worth)
    known |= nominal(going_on, *rungs)
    good = [family for family in OTHERS if family in dict(going_on)]
    bests += in_corners(loop, trial, known, cases, good, going_on)[1:] if good else []
    hidden = hiding(loop, trial, near, WORTH * max(limit.stiffness_N_m for limit in known.values()))
    as_assumed = None
    if of != measured:
        some = (*some, *good)
        right = every_case(measured, FIRST_HOLDS)
        as_assumed = advised(in_corners(loop, trial, known, right, some, worth_trying(known, some)))
    stage("softer walls and the attack")
    compared = rivals(bests, worst)
    won = withstand(loop, trial, compared, of)
    fell = fallen(compared, won)
    alone = withstand(loop, trial, [rival for rival in compared if rival.best.family is NOTHING], of)
    hard = tuple(dict.fromkeys((*won.hardest[:_TOLD], *alone.hardest[:_TOLD])))
    choice = won.best.family, won.best.values
    described = known.get(choice) or nominal([choice], *rungs)[choice]
    best = replace(won.best, nominal=described)
    count = len(BEYOND) * len(attack(of, won.hardest)) + len(every_case(of, hardest=won.hardest))
    shown = tuple(best if each.family is best.family else each for each in bests)
    others = tuple(family for family in OTHERS if family not in good)
    return Found(
        shown, best, won.bound_N_m, as_assumed, won.broken, count, others, worth, hidden, fell, alone.bound_N_m, hard
    )


def fallen(compared: Sequence[Rival], won: Rival) -> tuple[tuple[Best, float], ...]:
    """Returns the rivals but the winner that more holds or the attack broke on a wall which they bear in every corner.

    Each comes with that wall, N/m. A stiffer wall that breaks does not count: every limit has one.
    """
    lost = ((each.best, each.broken[0]) for each in compared if each is not won and each.broken)
    return tuple((best, below) for best, below in lost if best.safe and below <= best.safe.stiffness_N_m)


def _equals(known: dict[Choice, Limit], family: Family) -> list[Values]:
    """Returns the parameters whose limits are the largest within their tolerance, from small to large."""
    tried = {values: known[family, values].stiffness_N_m for values in _values(known, family)}
    most = max(tried.values())
    return sorted(values for values, stiffness in tried.items() if stiffness >= most / (1.0 + ROUGH))


def _values(known: dict[Choice, Limit], family: Family) -> list[Values]:
    return [values for other, values in known if other is family]


def worth_trying(known: dict[Choice, Limit], families: Sequence[Family]) -> list[Choice]:
    """Returns the choices of some families that bear a tenth more than the wall alone in the loop as described.

    All of them: the one that bears most there may bear nothing in a corner in which half its size bears twice the wall
    alone.
    """
    least_N_m = WORTH * known[NOTHING, ()].stiffness_N_m
    return [choice for choice, limit in known.items() if choice[0] in families and limit.stiffness_N_m > least_N_m]


def in_corners(
    loop: Scene,
    trial: Trial,
    known: dict[Choice, Limit],
    cases: tuple[Case, ...],
    families: Sequence[Family],
    candidates: Sequence[Choice],
) -> list[Best]:
    """Returns the wall alone and the best of every family, chosen among the candidates by their limits in all cases.

    No candidate is tried with walls too soft to make it worth having.
    """
    alone = known[NOTHING, ()]

    def query(choice: Choice, least_N_m: float) -> Query:
        family, values = choice
        top = known[choice].stiffness_N_m or LEAST_N_M
        rungs = ladder(max(least_N_m, top / 3.0), max(least_N_m, top) * 1.06, 1.5)
        return Query(loop, family.elements(values), cases, rungs, least_N_m)

    bests = [Best(NOTHING, (), alone, limits(trial, [query((NOTHING, ()), LEAST_N_M)], ROUGH / 2.0)[0])]
    least = max(LEAST_N_M, WORTH * bests[0].safe.stiffness_N_m) if bests[0].safe else LEAST_N_M
    bests += [Best(family, first := _equals(known, family)[0], known[family, first]) for family in families]
    found = limits(trial, [query(each, least) for each in candidates], ROUGH / 2.0)
    safe = {choice: limit for choice, limit in zip(candidates, found, strict=True) if limit.stiffness_N_m}
    for place, best in enumerate(bests):
        of_family = {values: limit for (family, values), limit in safe.items() if family is best.family}
        if of_family:
            ranked = sorted(of_family, key=lambda some: (-of_family[some].stiffness_N_m, some))
            first, *rest = (Best(best.family, some, known[best.family, some], of_family[some]) for some in ranked)
            less = tuple(each for each in rest if is_less(each.values, first.values))
            bests[place] = replace(first, smaller=less)
    return bests
