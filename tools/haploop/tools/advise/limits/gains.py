"""Which walls are steady with which element, and with which parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

from haploop.tools.advise.limits.families import (
    BOTH,
    DAMPING,
    FAMILIES,
    GRIDS,
    NOTHING,
    UNIDIRECTIONAL,
    Family,
    around,
    beside,
    first_choices,
    late_s,
)
from haploop.tools.advise.limits.largest import LEAST_N_M, Limit, Loops, largest
from haploop.tools.advise.limits.pace import BEYOND, WIDE, way
from haploop.tools.advise.limits.tasks import Tasks
from haploop.tools.advise.limits.variations import Change

if TYPE_CHECKING:
    from haploop.tools.advise.limits.steady import Judge

Scene = dict[str, Any]
Values = tuple[float, ...]
Choice = tuple[Family, Values]


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


class Search:
    """The whole search for one set of tasks.

    Args:
        tasks: that judge a loop.
        judge: runs them.
        stage: told what comes next.
    """

    def __init__(self, tasks: Tasks, judge: Judge, stage: Callable[[str], object] = lambda name: None) -> None:
        self.tasks, self.judge, self.stage = tasks, judge, stage
        ways = way(tasks.first)
        self.grid, self._wide, self._beyond = GRIDS[ways], WIDE[ways], BEYOND[ways]
        self.tolerance = self._wide.tolerance
        scene = tasks.first
        # Whatever the device, a sampled spring this stiff is unstable: the swing is beyond half the sampling rate.
        mass = scene["device"]["mass"] + scene.get("hand", {}).get("mass", 0.0)
        self.most_N_m = 8.0 * mass * float(scene["clock"]["control_rate"]) ** 2

    def families(self) -> list[Gains]:
        """The largest steady stiffness of every family, with its best parameters."""
        self.stage("the wall alone")
        scene = self.tasks.first
        damping = scene["device"]["damping"] + scene.get("hand", {}).get("damping", 0.0)
        known = self.limits([(NOTHING, ())], max(20.0 * LEAST_N_M, damping / late_s(scene)))
        start = max(10.0 * LEAST_N_M, known[NOTHING, ()].stiffness_N_m)
        alone = [family for family in FAMILIES if len(family.parts) == 1]
        self.stage("one element")
        first = [(family, values) for family in alone for values in first_choices(family, scene, self.grid)]
        known = self._refined(alone, known | self.limits(first, start))
        self.stage("two elements")
        values = _best(known, DAMPING) + _best(known, UNIDIRECTIONAL)
        most = max(limit.stiffness_N_m for limit in known.values())
        known |= self.limits([(BOTH, near) for near in around(BOTH, values, self.grid)], max(LEAST_N_M, most))
        known = self._refined([BOTH], known)
        return [_gains(family, known) for family in FAMILIES]

    def _refined(self, families: list[Family], known: dict[Choice, Limit]) -> dict[Choice, Limit]:
        for times in range(self.grid.refined):
            choices, reached = [], {}
            for family in families:
                tried = [values for other, values in known if other is family]
                best = _best(known, family)
                choices += [(family, values) for values in beside(family, best, tried, self.grid, times)]
                reached[family] = known[family, best].stiffness_N_m
            known = known | self.limits(choices, LEAST_N_M, reached)
        return known

    def limits(
        self, choices: list[Choice], start_N_m: float, reached: Mapping[Family, float] | None = None
    ) -> dict[Choice, Limit]:
        """The limit of each choice, of those of a family in full only of the one that allows most.

        Where a family has reached so much already, the search starts there, and others count only beyond.
        """
        reached = reached or {}

        def loops(family: Family, values: Values) -> Loops:
            elements, start = family.elements(values), max(start_N_m, reached.get(family, 0.0))
            make = partial(self.tasks.of, elements=elements)
            return Loops(lambda k, thorough: make(k, thorough=thorough), start, self.most_N_m, self.tasks.is_one_run)

        cells = {choice: loops(*choice) for choice in choices}
        pace = self._beyond if reached else self._wide
        return largest(cells, self.judge.judged, pace, rivals=lambda choice: choice[0], reached=reached)


def _best(known: dict[Choice, Limit], family: Family) -> Values:
    """The parameters that allow most; of equals the smallest."""
    own = {values: limit.stiffness_N_m for (other, values), limit in known.items() if other is family}
    return min(own, key=lambda values: (-own[values], values))


def _gains(family: Family, known: dict[Choice, Limit]) -> Gains:
    tried = {values: limit for (other, values), limit in known.items() if other is family}
    values = _best(known, family)
    return Gains(family, values, tried[values], tried)
