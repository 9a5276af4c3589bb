"""The declaration of a number: its SI unit and its bounds."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Quantity:
    """Unit and bounds of a number, written once, as metadata of its type.

    ``mass: Annotated[float, Quantity("kg", above=0)]`` declares a field that scene files, the command line,
    the JSON Schema and the documentation all read.

    Attributes:
        unit: SI unit in the spelling of pint (``"N s/m"``), ``""`` for a bare number.
        at_least, above, at_most, below: bounds, each optional.
        about: the meaning of the number in a few words, for editors.
        whole: only whole numbers, held as int.
    """

    unit: str
    at_least: float | None = None
    above: float | None = None
    at_most: float | None = None
    below: float | None = None
    about: str = ""
    whole: bool = False

    def as_dict(self) -> dict[str, str | float | None]:
        """Returns unit and bounds by name, as they travel on the wire."""
        names = ("unit", "at_least", "above", "at_most", "below")
        return {name: getattr(self, name) for name in names}

    def complaint(self, value: float) -> str | None:
        """Returns what is wrong with ``value`` ("must be above 0 kg"), or None when it may be used."""
        if not math.isfinite(value):
            return "must be a finite number" + (f" of {self.unit}" if self.unit else "")
        for holds, bound, words in (
            (self.at_least is None or value >= self.at_least, self.at_least, "at least"),
            (self.above is None or value > self.above, self.above, "above"),
            (self.at_most is None or value <= self.at_most, self.at_most, "at most"),
            (self.below is None or value < self.below, self.below, "below"),
        ):
            if not holds:
                return f"must be {words} {bound:g} {self.unit}".rstrip()
        return None


def si(unit: str, about: str = "", *, whole: bool = False, **bounds: float) -> Quantity:
    """Makes a ``Quantity`` in one line: ``mass: Annotated[float, si("kg", "mass of the device", above=0)]``."""
    return Quantity(unit, about=about, whole=whole, **bounds)
