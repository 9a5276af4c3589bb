"""Which walls are steady with which element, and which stay so when the loop is not quite what it was taken for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from haploop.tools.advise.families import (
    BOTH,
    COARSE,
    DAMPING,
    FAMILIES,
    FINE,
    NOTHING,
    UNIDIRECTIONAL,
    Family,
    around,
    beside,
    first_choices,
    late_s,
)
from haploop.tools.advise.largest import LEAST_N_M, Limit, Loops, Pace, largest
from haploop.tools.advise.steady import is_cheap
from haploop.tools.advise.tasks import Tasks
from haploop.tools.advise.variations import Change, corners, farther, scaled, singles

if TYPE_CHECKING:
    from haploop.tools.advise.families import Grid
    from haploop.tools.advise.steady import Judge

Scene = dict[str, Any]
Values = tuple[float, ...]
Choice = tuple[Family, Values]
# In arrays many stiffnesses at once cost little; where every loop is run by itself, each is chosen by the last.
_QUICK, _SLOW = Pace((1 / 8, 1 / 4, 1 / 2, 1.0, 2.0, 4.0, 8.0), 5, 0.02), Pace((1.0,), 1, 0.05)
# Where the limit is known, about, and so is what lies below it.
_QUICK_NEAR, _SLOW_NEAR = Pace((0.4, 0.7, 0.85, 1.0), 3, 0.02, ()), Pace((0.85,), 1, 0.05, ())
# An element that allows no more than this much beyond a simpler one is not worth having.
_WORTH = 1.1
# A safe stiffness that does not hold in every corner is lowered by this, so often at most.
_LOWER, _OFTEN = 0.9, 12


@dataclass
class Gains:
    """What one family allows.

    Attributes:
        family: the element, or elements.
        values: the parameters with the largest steady stiffness.
        limit: that stiffness.
        tried: the limit of every choice of parameters.
        safe_values: the parameters that allow most when all else is a fifth more or less, in the worst way.
        alone: limit with one quantity a fifth more or less, with the best parameters.
        corner: the worst signs of all quantities together.
        safe: the limit at the nominal loop and in the corners that are likely the worst.
    """

    family: Family
    values: Values
    limit: Limit
    tried: dict[Values, Limit]
    safe_values: Values = ()
    alone: dict[Change, Limit] = field(default_factory=dict)
    corner: dict[str, float] = field(default_factory=dict)
    safe: Limit = field(default_factory=lambda: Limit(0.0, LEAST_N_M))

    @property
    def worst(self) -> Change | None:
        """The single change that takes most."""
        return min(self.alone, key=lambda change: self.alone[change].stiffness_N_m, default=None)


@dataclass(frozen=True)
class Safe:
    """A gain that can be used.

    Attributes:
        gains: of the family recommended.
        stiffness_N_m: steady in every corner that was tried; 0 where none is.
        corners: how many loops it was tried in.
        nearest: the smallest change beyond a fifth at which it is no longer steady; None where none of those tried.
        farthest: the largest change tried.
    """

    gains: Gains
    stiffness_N_m: float
    corners: int
    nearest: Change | None
    farthest: Change | None


class Search:
    """The whole search for one set of tasks.

    Args:
        tasks: that judge a loop.
        judge: runs them.
        stage: told what comes next.
    """

    def __init__(self, tasks: Tasks, judge: Judge, stage: Callable[[str], object] = lambda name: None) -> None:
        self.tasks, self._judge, self._stage = tasks, judge, stage
        self.quick = all(map(is_cheap, tasks.scenes))
        self.grid: Grid = FINE if self.quick else COARSE
        self._wide, self._near = (_QUICK, _QUICK_NEAR) if self.quick else (_SLOW, _SLOW_NEAR)
        self.tolerance = self._wide.tolerance
        scene = tasks.first
        # Whatever the device, a sampled spring this stiff is unstable: the swing is beyond half the sampling rate.
        mass = scene["device"]["mass"] + scene.get("hand", {}).get("mass", 0.0)
        self.most_N_m = 8.0 * mass * float(scene["clock"]["control_rate"]) ** 2

    def families(self) -> list[Gains]:
        """The largest steady stiffness of every family, with its best parameters."""
        self._stage("the wall alone")
        scene = self.tasks.first
        damping = scene["device"]["damping"] + scene.get("hand", {}).get("damping", 0.0)
        bare = self._limits([(NOTHING, ())], max(20.0 * LEAST_N_M, damping / late_s(scene)))
        start = max(10.0 * LEAST_N_M, bare[NOTHING, ()].stiffness_N_m)
        alone = [family for family in FAMILIES if len(family.parts) == 1]
        self._stage("one element")
        known = bare | self._limits(
            [(family, values) for family in alone for values in first_choices(family, scene, self.grid)], start
        )
        known = self._refined(alone, known)
        self._stage("two elements")
        best = _best(known, DAMPING) + _best(known, UNIDIRECTIONAL)
        known |= self._limits([(BOTH, values) for values in around(BOTH, best, self.grid)], _start(known, start))
        known = self._refined([BOTH], known)
        return [_gains(family, known) for family in FAMILIES]

    def _refined(self, families: list[Family], known: dict[Choice, Limit]) -> dict[Choice, Limit]:
        for times in range(self.grid.refined):
            choices = []
            for family in families:
                tried = [values for other, values in known if other is family]
                best = _best(known, family)
                choices += [(family, values) for values in beside(family, best, tried, self.grid, times)]
            known = known | self._limits(choices, _start(known, LEAST_N_M))
        return known

    def _limits(self, choices: list[Choice], start_N_m: float) -> dict[Choice, Limit]:
        def loops(family: Family, values: Values) -> Loops:
            elements = family.elements(values)
            return Loops(lambda k: self.tasks.of(k, elements), start_N_m, self.most_N_m)

        return largest({choice: loops(*choice) for choice in choices}, self._judge.judged, self._wide)

    def uncertain(self, found: list[Gains]) -> None:
        """Find out what every family still allows when the loop is not quite what it was taken for."""
        self._stage("a fifth more or less")
        changes = singles(self.tasks.first)
        cells = {
            (index, change): self._changed(gains, gains.values, [change.on])
            for index, gains in enumerate(found)
            for change in changes
        }
        for (index, change), limit in largest(cells, self._judge.judged, self._near).items():
            found[index].alone[change] = limit
        self._stage("the worst corner")
        finalists = [(gains, values) for gains in found for values in self._finalists(gains)]
        together = {
            index: self._changed(gains, values, _likely_worst(gains)) for index, (gains, values) in enumerate(finalists)
        }
        for index, safe in largest(together, self._judge.judged, self._near).items():
            gains, values = finalists[index]
            if safe.stiffness_N_m > gains.safe.stiffness_N_m or not gains.safe_values:
                gains.safe_values, gains.safe, gains.corner = values, safe, _corner(gains.alone)

    def _finalists(self, gains: Gains) -> list[Values]:
        """The best choice of a family, and gentler ones, which may bear more change."""
        ranked = sorted(gains.tried, key=lambda values: (-gains.tried[values].stiffness_N_m, values))
        chosen = ranked[:1]
        while len(chosen) < self.grid.finalists:
            gentler = [values for values in ranked if _is_gentler(values, chosen[-1])]
            if not gentler or not gains.tried[gentler[0]].stiffness_N_m:
                break
            chosen.append(gentler[0])
        return chosen

    def _changed(
        self, gains: Gains, values: Values, changes: Iterable[Callable[[Scene], Scene]], start_N_m: float | None = None
    ) -> Loops:
        """A family under some changes at once: all of them must be steady."""
        elements, every = gains.family.elements(values), list(changes)
        start = max(LEAST_N_M, gains.tried[values].stiffness_N_m if start_N_m is None else start_N_m)
        return Loops(
            lambda k: [scene for change in every for scene in self.tasks.of(k, elements, change)], start, self.most_N_m
        )

    def safe(self, found: list[Gains]) -> Safe:
        """The family to use and a stiffness that holds in every corner, rounded down to two digits.

        The family that allows most in its likely worst corner is tried in all; where they take so much that another
        comes out above, that is tried, too.
        """
        self._stage("every corner")
        every = [_same, *(lambda scene, c=corner: scaled(scene, c) for corner in corners(self.tasks.first))]
        proved: dict[int, float] = {}
        while True:
            best = found[0]
            for gains in found[1:]:
                if _allows(gains, proved) > _WORTH * _allows(best, proved):
                    best = gains
            if id(best) in proved:
                break
            loops = self._changed(best, best.safe_values, every, best.safe.stiffness_N_m)
            limit = largest({"": loops}, self._judge.judged, self._near)[""]
            proved[id(best)] = rounded_down(min(limit.stiffness_N_m, best.safe.stiffness_N_m))
        stiffness = self._checked(best, every, proved[id(best)])
        changes = farther(self.tasks.first) if stiffness else []
        nearest = self._nearest(best, stiffness, changes)
        return Safe(best, stiffness, len(every), nearest, max(changes, key=lambda c: c.size, default=None))

    def _checked(self, gains: Gains, every: list[Callable[[Scene], Scene]], stiffness: float) -> float:
        """The stiffness as it is rounded, lowered until it holds; 0 where it never does."""
        for _ in range(_OFTEN):
            make = self._changed(gains, gains.safe_values, every).make
            if stiffness < LEAST_N_M:
                break
            if all(judgement.steady for judgement in self._judge.judged(make(stiffness))):
                return stiffness
            stiffness = rounded_down(_LOWER * stiffness)
        return 0.0

    def _nearest(self, gains: Gains, stiffness: float, changes: list[Change]) -> Change | None:
        """The smallest change at which a stiffness is no longer steady."""
        self._stage("the nearest instability")
        elements = gains.family.elements(gains.safe_values)
        runs = [(change, scene) for change in changes for scene in self.tasks.of(stiffness, elements, change.on)]
        judged = self._judge.judged([scene for _, scene in runs])
        failed = [change for (change, _), judgement in zip(runs, judged, strict=True) if not judgement.steady]
        return min(failed, key=lambda change: change.size, default=None)


def _same(scene: Scene) -> Scene:
    return scene


def _likely_worst(gains: Gains) -> list[Callable[[Scene], Scene]]:
    """No change, the worst one, and the worst signs of all together, with every mass also the other way."""
    corner = _corner(gains.alone)
    flipped = {name: 2.0 - factor if name.endswith("mass") else factor for name, factor in corner.items()}
    found: list[Callable[[Scene], Scene]] = [_same, lambda scene: scaled(scene, corner)]
    return [*found, lambda scene: scaled(scene, flipped), *([gains.worst.on] if gains.worst else [])]


def _is_gentler(values: Values, than: Values) -> bool:
    """The last parameter, which is the inertia where there is one, a quarter smaller at least."""
    return bool(values) and values[-1] <= 0.75 * than[-1]


def _allows(gains: Gains, proved: dict[int, float]) -> float:
    """What a family is known, or likely, to bear in its worst corner."""
    return proved.get(id(gains), gains.safe.stiffness_N_m)


def rounded_down(value: float) -> float:
    """To two digits."""
    if value <= 0.0:
        return 0.0
    rounded = float(f"{value:.1e}")
    return rounded if rounded <= value else float(f"{rounded - 10.0 ** (int(f'{value:e}'.partition('e')[2]) - 1):.1e}")


def _best(known: dict[Choice, Limit], family: Family) -> Values:
    """The parameters that allow most; of equals the smallest."""
    own = {values: limit.stiffness_N_m for (other, values), limit in known.items() if other is family}
    return min(own, key=lambda values: (-own[values], values))


def _start(known: dict[Choice, Limit], least: float) -> float:
    return max(least, *(limit.stiffness_N_m for limit in known.values()))


def _gains(family: Family, known: dict[Choice, Limit]) -> Gains:
    tried = {values: limit for (other, values), limit in known.items() if other is family}
    values = _best(known, family)
    return Gains(family, values, tried[values], tried)


def _corner(alone: dict[Change, Limit]) -> dict[str, float]:
    """Of every quantity the sign that allows less by itself."""
    worst: dict[str, Change] = {}
    for change, limit in alone.items():
        before = worst.get(change.quantity)
        if before is None or limit.stiffness_N_m < alone[before].stiffness_N_m:
            worst[change.quantity] = change
    return {name: change.factor for name, change in worst.items()}
