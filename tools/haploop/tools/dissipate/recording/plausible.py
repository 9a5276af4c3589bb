"""Limits of what a recorded device can have done: beyond them, more often a unit is wrong than the device unusual."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from haploop.protocol.amounts import amount
from haploop.tools.dissipate.recording.samples import Floats

# Time over which velocities are taken, s: from sample to sample an encoder's counts look faster than any hand.
_OVER_S = 0.01


class Limits(NamedTuple):
    """The range of a quantity, in its SI unit, and the option that gives the unit of its column."""

    words: str
    unit: str
    least: float
    most: float
    option: str


_LIMITS = {
    "period": Limits("samples {} apart", "s", 2e-5, 0.1, "--time-unit"),
    "way": Limits("a device that moves {} in all", "m", 1e-5, 1.0, "--unit"),
    "speed": Limits("a device that moves at {}", "m/s", 0.0, 10.0, "--unit"),
    "velocity": Limits("a recorded velocity of {} at most", "m/s", 1e-4, 10.0, "--velocity-unit"),
    "acceleration": Limits("a recorded acceleration of {} at most", "m/s²", 1e-2, 1e3, "--acceleration-unit"),
    "force": Limits("a recorded force of {} at most", "N", 0.02, 200.0, "--force-unit"),
}
_CAN_HARDLY_BE = "Can this be right: {what}? If not, a unit is wrong; give the right one with {option}."


class Largest:
    """Keeps the largest value of every quantity of a recording."""

    def __init__(self, period_s: float) -> None:
        self._period_s, self._apart = period_s, max(1, round(_OVER_S / period_s))
        self._found = {"period": period_s, "way": 0.0}
        self._low, self._high = np.inf, -np.inf

    def add(self, part: Mapping[str, Floats]) -> None:
        """Takes columns in SI units, by quantity, of samples without a gap."""
        x = part["position"]
        self._low, self._high = min(self._low, float(x.min())), max(self._high, float(x.max()))
        ways = x[self._apart :] - x[: -self._apart]
        found = {"way": [self._high - self._low], "speed": ways / (self._apart * self._period_s)}
        found |= {name: part[name] for name in ("velocity", "acceleration", "force") if name in part}
        for name, values in found.items():
            self._found[name] = float(np.max(np.abs(values), initial=self._found.get(name, 0.0)))

    def remarks(self) -> list[str]:
        """Returns a sentence on each quantity outside its limits; one that is 0 throughout has no unit to be wrong."""
        found = ((_LIMITS[name], value) for name, value in self._found.items())
        return [
            _CAN_HARDLY_BE.format(what=of.words.format(amount(value, of.unit)), option=of.option)
            for of, value in found
            if value and not of.least <= value < of.most
        ]
