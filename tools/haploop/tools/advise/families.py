"""The elements that are compared, each family with its parameters."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from haploop.protocol.scene.scene import ElementTable, Hand, Scene
from haploop.tools.render.units import fixed

Values = tuple[float, ...]
# Parameters of one element, from the most that a loop can bear down, each the one before by this factor; about the best
# they are narrowed by its square root. Of two together each takes these factors of its best alone.
_COUNT, FACTOR, _OF_BOTH = 7, 2.0, (1.0, 0.5, 0.25)


@dataclass(frozen=True)
class Family:
    """One element, or two together, by its name and the kind and parameter of each."""

    name: str
    parts: tuple[tuple[str, str], ...]

    def elements(self, values: Values) -> tuple[ElementTable, ...]:
        """Returns the tables of a scene."""
        pairs = zip(self.parts, values, strict=True)
        return tuple(ElementTable(name=kind, parameters={key: value}) for (kind, key), value in pairs)

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
            return f"{fixed(value * 1e3, 2)} g" if value < 1.0 else f"{fixed(value, 2)} kg"

        return [words(value, key) for (_, key), value in zip(self.parts, values, strict=True)]


NOTHING = Family("nothing", ())
DAMPING = Family("damping", (("damping", "damping"),))
BIDIRECTIONAL = Family("bidirectional inertia", (("bidirectional-inertia", "mass"),))
UNIDIRECTIONAL = Family("unidirectional inertia", (("unidirectional-inertia", "mass"),))
BOTH = Family("damping and unidirectional inertia", DAMPING.parts + UNIDIRECTIONAL.parts)
SINGLE = (DAMPING, BIDIRECTIONAL, UNIDIRECTIONAL)
FAMILIES = (NOTHING, *SINGLE, BOTH)


def first_choices(family: Family, loop: Scene) -> list[Values]:
    """Returns parameters from about the largest that a loop can bear down: B = m / (T/2 + td), or the moved mass."""
    [(_, key)] = family.parts
    hand = loop.hand or Hand()
    most = loop.device.mass + (loop.transmission.motor_mass if loop.transmission else 0.0)
    most += 0.0 if hand.grip else hand.mass
    if key == "damping":
        most /= 0.5 / loop.clock.control_rate + loop.clock.round_trip_delay
    return [(_rounded(most / FACTOR**i),) for i in range(_COUNT)]


def beside(values: Values) -> list[Values]:
    """Returns parameters half a step about some, each by itself."""
    return [
        (*values[:index], _rounded(value * FACTOR**half), *values[index + 1 :])
        for index, value in enumerate(values)
        for half in (-0.5, 0.5)
    ]


def together(damping: Values, inertia: Values) -> list[Values]:
    """Returns combinations of what is best alone, which are the largest of each."""
    return [(_rounded(damping[0] * b), _rounded(inertia[0] * m)) for b, m in itertools.product(_OF_BOTH, _OF_BOTH)]


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")
