"""Search of the gains: the elements that are compared, and the parameters with which the stiffest wall is steady."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

from haploop.protocol.scene.scene import ElementTable, Hand, Scene
from haploop.tools.advise.judge import Judge, execution_mode
from haploop.tools.advise.largest import BEYOND, LEAST_N_M, WIDE, Limit, StiffnessQuery, largest_steady
from haploop.tools.advise.tasks import Tasks
from haploop.tools.advise.variations import Change
from haploop.tools.render.units import amount

Values = tuple[float, ...]


@dataclass(frozen=True)
class Family:
    """A family of gains: one element, or two together, by its name and the kind and parameter of each."""

    name: str
    parts: tuple[tuple[str, str], ...]

    def elements(self, values: Values) -> list[ElementTable]:
        pairs = zip(self.parts, values, strict=True)
        return [ElementTable(name=kind, parameters={key: value}) for (kind, key), value in pairs]

    def words(self, values: Values) -> str:
        """Formats the parameters: ``0.6 N s/m`` or ``9 g``; a dash for none."""
        return " and ".join(self._amounts(values)) or "–"

    def phrase(self, values: Values) -> str:
        """Formats the parameters for a sentence: ``0.6 N s/m of damping``."""
        told = zip(self._amounts(values), self.parts, strict=True)
        return " and ".join(f"{words} of {kind.replace('-', ' ')}" for words, (kind, _) in told) or "no element"

    def _amounts(self, values: Values) -> list[str]:
        def words(value: float, key: str) -> str:
            if key == "damping":
                return f"{value:.2g} N s/m"
            return amount(value * 1e3, "g", 2) if value < 1.0 else amount(value, "kg", 2)

        return [words(value, key) for (_, key), value in zip(self.parts, values, strict=True)]


Choice = tuple[Family, Values]
NOTHING = Family("nothing", ())
DAMPING = Family("damping", (("damping", "damping"),))
BIDIRECTIONAL = Family("bidirectional inertia", (("bidirectional-inertia", "mass"),))
UNIDIRECTIONAL = Family("unidirectional inertia", (("unidirectional-inertia", "mass"),))
BOTH = Family("damping and unidirectional inertia", DAMPING.parts + UNIDIRECTIONAL.parts)
FAMILIES = (NOTHING, DAMPING, BIDIRECTIONAL, UNIDIRECTIONAL, BOTH)


@dataclass(frozen=True)
class Grid:
    """The grid of parameters: first so many apart by a factor, then half way beside the best.

    Attributes:
        damping, mass, both: count and factor of a single element's parameter, and of each of two around their best.
        refined: how often points beside the best are tried.
        finalists: choices of each family that are compared by what they allow when the loop is not as it was taken for.
    """

    damping: tuple[int, float]
    mass: tuple[int, float]
    both: tuple[int, float]
    refined: int
    finalists: int


FINE = Grid(damping=(8, 2.0), mass=(5, 2.0), both=(4, 2.0), refined=2, finalists=3)
MIDDLE = Grid(damping=(6, 2.5), mass=(4, 2.5), both=(3, 2.5), refined=1, finalists=2)
COARSE = Grid(damping=(5, 3.0), mass=(4, 3.0), both=(2, 3.0), refined=1, finalists=2)
# By the way the scenes run.
GRIDS = {"arrays": FINE, "friction": MIDDLE, "alone": COARSE}


def first_choices(family: Family, scene: Scene, grid: Grid) -> list[Values]:
    """Returns parameters from about the largest that a loop can bear down: B = m / (T/2 + td), or the moved mass."""
    if len(family.parts) != 1:
        return [()]
    [(_, key)] = family.parts
    hand = scene.hand or Hand()
    most = scene.device.mass + (scene.transmission.motor_mass if scene.transmission else 0.0)
    most += 0.0 if hand.grip else hand.mass
    count, factor = grid.mass
    if key == "damping":
        most, (count, factor) = most / late_s(scene), grid.damping
    return [(_rounded(most / factor**i),) for i in range(count)]


def around(family: Family, best: Values, grid: Grid) -> list[Values]:
    """Returns every combination of some values around those that are best alone, which are the largest of each."""
    count, factor = grid.both
    above = count // 2
    return [
        tuple(_rounded(value * factor ** (above - i)) for value, i in zip(best, indices, strict=True))
        for indices in itertools.product(range(count), repeat=len(family.parts))
    ]


def beside(family: Family, best: Values, tried: list[Values], grid: Grid, times: int) -> list[Values]:
    """Returns parameters half a step from the best, a whole step where it is at the end of what was tried."""
    found = []
    for index, (_, key) in enumerate(family.parts):
        _, factor = grid.both if len(family.parts) > 1 else grid.damping if key == "damping" else grid.mass
        values = [choice[index] for choice in tried]
        for sign, end in ((1, max(values)), (-1, min(values))):
            step = factor if best[index] == end and times == 0 else factor ** (0.5 ** (times + 1))
            found.append((*best[:index], _rounded(best[index] * step**sign), *best[index + 1 :]))
    return [choice for choice in dict.fromkeys(found) if choice not in tried]


def late_s(scene: Scene) -> float:
    """Returns T/2 + td, s: how late a held force is on average."""
    return 0.5 / scene.clock.control_rate + scene.clock.round_trip_delay


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")


@dataclass
class Gains:
    """The limits of one family.

    Attributes:
        values, limit: the parameters with the largest steady stiffness, and that stiffness.
        tried: the limit of every choice of parameters.
        safe_values: the parameters that allow most when all else is a fifth more or less, in the worst way.
        alone: limit with one quantity a fifth more or less, with the best parameters.
        corner: the worst signs of all uncertain_quantities together.
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
        """The single change that lowers the limit most."""
        return min(self.alone, key=lambda change: self.alone[change].stiffness_N_m, default=None)


class Search:
    """The search of all families by one set of tasks; ``stage`` is called with the name of each stage."""

    def __init__(self, tasks: Tasks, judge: Judge, stage: Callable[[str], object] = lambda name: None) -> None:
        self.tasks, self.judge, self.stage = tasks, judge, stage
        ways = execution_mode(tasks.first)
        self.grid, self._wide, self._beyond = GRIDS[ways], WIDE[ways], BEYOND[ways]
        self.tolerance = self._wide.tolerance
        scene = tasks.first
        # Whatever the device, a sampled spring this stiff is unstable: the swing is beyond half the sampling rate.
        mass = scene.device.mass + (scene.hand or Hand()).mass
        self.most_N_m = 8.0 * mass * float(scene.clock.control_rate) ** 2

    def families(self) -> list[Gains]:
        """Returns the largest steady stiffness of every family, with its best parameters."""
        self.stage("the wall alone")
        scene = self.tasks.first
        damping = scene.device.damping + (scene.hand or Hand()).damping
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
        return [
            Gains(family, best := _best(known, family), known[family, best], _tried(known, family))
            for family in FAMILIES
        ]

    def _refined(self, families: list[Family], known: dict[Choice, Limit]) -> dict[Choice, Limit]:
        for times in range(self.grid.refined):
            choices, reached = [], {}
            for family in families:
                tried, best = list(_tried(known, family)), _best(known, family)
                choices += [(family, values) for values in beside(family, best, tried, self.grid, times)]
                reached[family] = known[family, best].stiffness_N_m
            known = known | self.limits(choices, LEAST_N_M, reached)
        return known

    def limits(
        self, choices: list[Choice], start_N_m: float, reached: Mapping[Family, float] | None = None
    ) -> dict[Choice, Limit]:
        """Returns the limit of each choice; within a family, in full only of the one that allows most.

        Where a family has reached so much already, the search starts there, and others count only beyond.
        """
        reached = reached or {}

        def loops(family: Family, values: Values) -> StiffnessQuery:
            elements, start = family.elements(values), max(start_N_m, reached.get(family, 0.0))
            make = partial(self.tasks.make_runs, elements=elements)
            return StiffnessQuery(
                lambda k, thorough: make(k, thorough=thorough), start, self.most_N_m, self.tasks.is_one_run
            )

        cells = {choice: loops(*choice) for choice in choices}
        pace = self._beyond if reached else self._wide
        return largest_steady(cells, self.judge.judge, pace, rivals=lambda choice: choice[0], reached=reached)


def _best(known: dict[Choice, Limit], family: Family) -> Values:
    tried = _tried(known, family)
    return min(tried, key=lambda values: (-tried[values].stiffness_N_m, values))


def _tried(known: dict[Choice, Limit], family: Family) -> dict[Values, Limit]:
    return {values: limit for (other, values), limit in known.items() if other is family}
