"""The dissipation elements that are compared, and the parameters each is tried with."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

from haploop.tools.render.units import amount

Scene = dict[str, Any]
_UNITS = {"damping": "N s/m", "mass": "kg"}


@dataclass(frozen=True)
class Family:
    """One element, or two together.

    Attributes:
        name: for people.
        parts: kind and parameter of each.
    """

    name: str
    parts: tuple[tuple[str, str], ...]

    def elements(self, values: tuple[float, ...]) -> list[dict[str, Any]]:
        """The scene's ``[[dissipation]]`` tables with these parameters."""
        return [
            {"kind": kind, "acts": "in-contact", key: value}
            for (kind, key), value in zip(self.parts, values, strict=True)
        ]

    def words(self, values: tuple[float, ...]) -> str:
        """The parameters: ``0.6 N s/m`` or ``9 g``; a dash for none."""
        told = [_amount(value, key) for (_, key), value in zip(self.parts, values, strict=True)]
        return " and ".join(told) or "–"

    def phrase(self, values: tuple[float, ...]) -> str:
        """As in a sentence: ``0.6 N s/m of damping``."""
        told = [
            f"{_amount(value, key)} of {kind.replace('-', ' ')}"
            for (kind, key), value in zip(self.parts, values, strict=True)
        ]
        return " and ".join(told) or "no element"


NOTHING = Family("nothing", ())
DAMPING = Family("damping", (("damping", "damping"),))
BIDIRECTIONAL = Family("bidirectional inertia", (("bidirectional-inertia", "mass"),))
UNIDIRECTIONAL = Family("unidirectional inertia", (("unidirectional-inertia", "mass"),))
BOTH = Family("damping and unidirectional inertia", DAMPING.parts + UNIDIRECTIONAL.parts)
FAMILIES = (NOTHING, DAMPING, BIDIRECTIONAL, UNIDIRECTIONAL, BOTH)


@dataclass(frozen=True)
class Grid:
    """How finely parameters are tried: first so many apart by a factor, then half way beside the best.

    Attributes:
        damping, mass: count and factor of a single element's parameter.
        both: count and factor of each parameter of two elements, around what is best alone.
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


def first_choices(family: Family, scene: Scene, grid: Grid) -> list[tuple[float, ...]]:
    """Parameters from the largest that a loop can bear, about, down: B = m / (T/2 + td), and the moved mass itself."""
    if len(family.parts) != 1:
        return [()]
    [(_, key)] = family.parts
    most = scale(scene, key)
    count, factor = grid.damping if key == "damping" else grid.mass
    return [(_rounded(most / factor**i),) for i in range(count)]


def around(family: Family, best: tuple[float, ...], grid: Grid) -> list[tuple[float, ...]]:
    """Every combination of some values around those that are best alone, which are the largest of each."""
    count, factor = grid.both
    above = count // 2
    return [
        tuple(_rounded(value * factor ** (above - i)) for value, i in zip(best, indices, strict=True))
        for indices in itertools.product(range(count), repeat=len(family.parts))
    ]


def beside(
    family: Family, best: tuple[float, ...], tried: list[tuple[float, ...]], grid: Grid, times: int
) -> list[tuple[float, ...]]:
    """Parameters half a step from the best, a whole step where it is at the end of what was tried."""
    found = []
    for index, (_, key) in enumerate(family.parts):
        _, factor = grid.both if len(family.parts) > 1 else grid.damping if key == "damping" else grid.mass
        values = [choice[index] for choice in tried]
        for sign, end in ((1, max(values)), (-1, min(values))):
            step = factor if best[index] == end and times == 0 else factor ** (0.5 ** (times + 1))
            found.append((*best[:index], _rounded(best[index] * step**sign), *best[index + 1 :]))
    return [choice for choice in dict.fromkeys(found) if choice not in tried]


def scale(scene: Scene, key: str) -> float:
    """The damping, or the mass, about which no loop can bear, in SI units."""
    hand = scene.get("hand", {})
    mass = scene["device"]["mass"] + scene.get("transmission", {}).get("motor_mass", 0.0)
    mass += 0.0 if "grip" in hand else hand.get("mass", 0.0)
    return mass / late_s(scene) if key == "damping" else mass


def late_s(scene: Scene) -> float:
    """T/2 + td: how late a held force is on average."""
    return 0.5 / scene["clock"]["control_rate"] + scene["clock"]["round_trip_delay"]


def _rounded(value: float) -> float:
    """Two digits, as one would set it."""
    return float(f"{value:.2g}")


def _amount(value: float, key: str) -> str:
    if key == "mass":
        return amount(value * 1e3, "g", 2) if value < 1.0 else amount(value, "kg", 2)
    return f"{value:.2g} {_UNITS[key]}"
