"""The declaration of a number: its SI unit and its bounds."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

# Bounds of what can be meant, by unit: the largest magnitude in either direction, what that compares to, and the least
# value of what must be above 0. Beyond them products overflow; a quantity that declares its own bounds has those.
MEANT: Mapping[str, tuple[float, str, float]] = {
    "s": (1e9, "thirty years", 1e-9),
    "m": (1e6, "a thousand kilometres", 1e-15),
    "m/s": (1e6, "two thousand times the speed of sound", 1e-12),
    "m/s^2": (1e9, "a hundred million times gravity", 1e-12),
    "kg": (1e6, "a thousand tonnes", 1e-9),
    "N": (1e6, "the weight of a hundred tonnes", 1e-15),
    "N/m": (1e9, "a steel bar a metre long and eight centimetres thick", 1e-9),
    "N s/m": (1e9, "a newton at a nanometre a second", 1e-12),
    "Hz": (1e12, "a thousand times the clock of a computer", 1e-9),
    "rad": (1e6, "more than a hundred thousand turns", 1e-12),
    "m/s^2/Hz^0.5": (1e6, "a sensor that measures nothing but its noise", 1e-15),
}


@dataclass(frozen=True)
class Quantity:
    """Unit and bounds of a number, written once, as metadata of its type.

    ``mass: Annotated[float, Quantity("kg", above=0)]`` declares a field that scene files, the command line,
    the JSON Schema and the documentation all read.

    Attributes:
        unit: SI unit in the spelling of pint (``"N s/m"``), ``""`` for a bare number.
        at_least, above, at_most, below: bounds, each optional; those of ``MEANT`` stand in for the ones left out.
        about: the meaning of the number in a few words, for editors.
        whole: only whole numbers, held as int.
        choices: all allowed values, texts or False and True, if it is not a number; empty if it is one.
        step: only multiples of this are allowed.
    """

    unit: str
    at_least: float | None = None
    above: float | None = None
    at_most: float | None = None
    below: float | None = None
    about: str = ""
    whole: bool = False
    choices: tuple[str | bool, ...] = ()
    step: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """Returns unit and bounds by name, as they travel on the wire; ``choices`` where there are some."""
        names = ("unit", "at_least", "above", "at_most", "below")
        return {name: getattr(self, name) for name in names} | ({"choices": [*self.choices]} if self.choices else {})

    def text(self, value: Any) -> str:
        """Returns a value with its unit, or a choice as a scene file writes it."""
        return json.dumps(value) if self.choices else f"{value:g} {self.unit}".rstrip()

    def complaint(self, value: float) -> str | None:
        """Returns what is wrong with ``value`` ("must be above 0 kg"), or None when it may be used."""
        if not math.isfinite(value):
            return "must be a finite number" + (f" of {self.unit}" if self.unit else "")
        if self.step and value % self.step:
            return f"must be a multiple of {self.step:g} {self.unit}".rstrip()
        return self._out_of_bounds(value) or self._not_meant(value)

    def _out_of_bounds(self, value: float) -> str | None:
        for holds, bound, words in (
            (self.at_least is None or value >= self.at_least, self.at_least, "at least"),
            (self.above is None or value > self.above, self.above, "above"),
            (self.at_most is None or value <= self.at_most, self.at_most, "at most"),
            (self.below is None or value < self.below, self.below, "below"),
        ):
            if not holds:
                return f"must be {words} {bound:g} {self.unit}".rstrip()
        return None

    def _not_meant(self, value: float) -> str | None:
        if self.unit not in MEANT:
            return None
        most, like, least = MEANT[self.unit]
        if value > most and self.at_most is None and self.below is None:
            return f"must be at most {most:g} {self.unit}, which is {like}"
        if value < -most and self.at_least is None and self.above is None:
            return f"must be at least {-most:g} {self.unit}, which is {like} in the other direction"
        if self.above == 0 and value < least:
            return f"must be at least {least:g} {self.unit}; with less, numbers in a loop overflow"
        return None


def si(unit: str, about: str = "", *, whole: bool = False, **bounds: Any) -> Quantity:
    """Makes a ``Quantity`` in one line: ``mass: Annotated[float, si("kg", "mass of the device", above=0)]``."""
    return Quantity(unit, about=about, whole=whole, **bounds)
