"""The elements that are compared, each family with its parameters."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from haploop.protocol.amounts import fixed
from haploop.protocol.filled import filled
from haploop.protocol.scene.scene import ElementTable, Hand, Scene

Values = tuple[float, ...]
# How many parameters of one element are tried, from the largest that a loop can bear down, and the factor between them;
# around the best its square root. Of two elements together, each takes these factors of its best alone.
_COUNT, FACTOR, _OF_BOTH = 7, 2.0, (1.0, 0.5, 0.25)
# Bases of the Halton sequence.
_BASES = (2, 3, 5)


@dataclass(frozen=True)
class Family:
    """One element, or two together, by its name and the kind and key of each parameter that is searched.

    Attributes:
        acts: as in a scene's element.
    """

    name: str
    parts: tuple[tuple[str, str], ...]
    acts: Literal["in-contact", "always"] = "in-contact"

    def elements(self, values: Values) -> tuple[ElementTable, ...]:
        """Returns the tables of a scene."""
        tables: dict[str, dict[str, float]] = {}
        for (kind, key), value in zip(self.parts, values, strict=True):
            tables.setdefault(kind, {})[key] = value
        return tuple(ElementTable(name=kind, acts=self.acts, parameters=of) for kind, of in tables.items())

    def words(self, values: Values) -> str:
        """Formats the parameters: ``0.6 N s/m`` or ``9 g``; a dash for none."""
        return " and ".join(self._amounts(values)) or "–"

    def phrase(self, values: Values) -> str:
        """Formats the parameters for a sentence: ``0.6 N s/m of damping``."""
        told: dict[str, list[str]] = {}
        for words, (kind, _) in zip(self._amounts(values), self.parts, strict=True):
            told.setdefault(kind, []).append(words)
        return " and ".join(f"{', '.join(of)} of {kind.replace('-', ' ')}" for kind, of in told.items()) or "no element"

    def _amounts(self, values: Values) -> list[str]:
        return [_format(value, key) for (_, key), value in zip(self.parts, values, strict=True)]


def _format(value: float, key: str) -> str:
    if key == "mass":
        return f"{fixed(value * 1e3, 2)} g" if value < 1.0 else f"{fixed(value, 2)} kg"
    number = {
        "damping": filled("{:.2g} N s/m", value),
        "time": f"{fixed(value * 1e3, 2)} ms",
        "share": filled("{:.2g} %", value * 100),
    }
    return number.get(key) or f"{fixed(value / 1e3, 2)} N/mm"


NOTHING = Family("nothing", ())
DAMPING = Family("damping", (("damping", "damping"),))
BIDIRECTIONAL = Family("bidirectional inertia", (("bidirectional-inertia", "mass"),))
UNIDIRECTIONAL = Family("unidirectional inertia", (("unidirectional-inertia", "mass"),))
BOTH = Family("damping and unidirectional inertia", DAMPING.parts + UNIDIRECTIONAL.parts)
SINGLE = (DAMPING, BIDIRECTIONAL, UNIDIRECTIONAL)
ADAPTIVE_DAMPING = Family("passivity controller", (("passivity-controller", "damping"),))
ADAPTIVE_INERTIA = Family("adaptive inertia", (("adaptive-inertia", "mass"),))
ADAPTIVE_BOTH = Family(
    "passivity controller with inertia", (("adaptive-inertia", "damping"), ("adaptive-inertia", "mass"))
)
FORCE_BOUNDING = Family("force bounding", (("force-bounding", "share"),), "always")
COUPLING = Family(
    "virtual coupling",
    (("virtual-coupling", "stiffness"), ("virtual-coupling", "damping"), ("virtual-coupling", "mass")),
    "always",
)
# Every stabilizer that comes with haploop, in the order in which tables list them.
STABILIZERS = (
    NOTHING,
    DAMPING,
    Family("damping on the way in", (("unidirectional-damping", "damping"),)),
    BIDIRECTIONAL,
    UNIDIRECTIONAL,
    BOTH,
    ADAPTIVE_DAMPING,
    Family("passivity controller, reset", (("passivity-controller-reset", "damping"),)),
    Family("passivity controller, reference", (("passivity-controller-reference", "damping"),)),
    ADAPTIVE_INERTIA,
    ADAPTIVE_BOTH,
    FORCE_BOUNDING,
    Family("force rate", (("force-rate", "time"),)),
    COUPLING,
)
# Those that render less than the stiffness of their wall, and all that are neither these nor simple ones.
HIDING = (FORCE_BOUNDING, COUPLING)
OTHERS = tuple(each for each in STABILIZERS if each not in (NOTHING, *SINGLE, BOTH, ADAPTIVE_BOTH, *HIDING))


def first_choices(family: Family, loop: Scene) -> list[Values]:
    """Returns parameters downwards from about the largest that a loop can bear.

    That is B = m / (T/2 + td) for damping, the moved mass for inertia, four ticks plus the delay for a force's lead.
    """
    [(_, key)] = family.parts
    most = {"mass": _moved_kg, "damping": _most_damping, "time": _most_time}[key](loop)
    return [(_rounded(most / FACTOR**i),) for i in range(_COUNT)]


def box(family: Family, loop: Scene, alone_N_m: float) -> list[tuple[float, float]]:
    """Returns the ends between which each parameter of a family is searched, given the stiffest wall without any.

    Damping is searched up to twice what a loop can bear, B = 2 m / (T/2 + td); inertia up to the moved mass; a coupling
    up to 32 times as stiff as that wall; a force's lead up to four ticks plus the delay.
    """
    damping, moved = _most_damping(loop), _moved_kg(loop)
    ends = {
        "damping": (damping / 128.0, damping * 2.0),
        "mass": (moved / 1024.0, moved),
        "stiffness": (alone_N_m / 4.0, alone_N_m * 32.0),
        "time": (0.125 / loop.clock.control_rate, _most_time(loop)),
        "share": (1.0 / 64.0, 1.0),
    }
    return [ends[key] for _, key in family.parts]


def _moved_kg(loop: Scene) -> float:
    hand = loop.hand or Hand()
    motor = loop.transmission.motor_mass if loop.transmission else 0.0
    return loop.device.mass + motor + (0.0 if hand.grip else hand.mass)


def _most_time(loop: Scene) -> float:
    return 4.0 / loop.clock.control_rate + loop.clock.round_trip_delay


def _most_damping(loop: Scene) -> float:
    return _moved_kg(loop) / (0.5 / loop.clock.control_rate + loop.clock.round_trip_delay)


def applies(family: Family, loop: Scene) -> bool:
    """Tells whether a family can act: force bounding lets no force pass where the device declares no damping."""
    return family is not FORCE_BOUNDING or bool(loop.device.damping)


def beside(values: Values) -> list[Values]:
    """Returns these parameters with each in turn moved by half a step down and up."""
    return [
        (*values[:index], _rounded(value * FACTOR**half), *values[index + 1 :])
        for index, value in enumerate(values)
        for half in (-0.5, 0.5)
    ]


def around(values: Values) -> list[Values]:
    """Returns the parameters at 0.5, 0.7, 1 and 1.4 times their sizes, all by the same factor."""
    return [scaled_values(values, half) for half in (-1.0, -0.5, 0.0, 0.5)]


def scaled_values(values: Values, steps: float) -> Values:
    """Returns the parameters this many steps larger, all by the same factor."""
    return tuple(_rounded(value * FACTOR**steps) for value in values)


def together(damping: Values, inertia: Values) -> list[Values]:
    """Returns combinations in which each element has at most its best size alone."""
    return [(_rounded(damping[0] * b), _rounded(inertia[0] * m)) for b, m in itertools.product(_OF_BOTH, _OF_BOTH)]


def halton(ends: Sequence[tuple[float, float]], count: int) -> list[Values]:
    """Returns points of the Halton sequence between the ends, evenly on logarithmic axes, to two digits."""
    points = []
    for index in range(1, count + 1):
        unit = [_radical_inverse(index, base) for base in _BASES[: len(ends)]]
        points.append(tuple(float(f"{low * (high / low) ** u:.2g}") for u, (low, high) in zip(unit, ends, strict=True)))
    return list(dict.fromkeys(points))


def _radical_inverse(index: int, base: int) -> float:
    found, share = 0.0, 1.0
    while index:
        share /= base
        index, digit = divmod(index, base)
        found += digit * share
    return found


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")
