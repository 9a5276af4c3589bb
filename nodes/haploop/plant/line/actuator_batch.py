"""What the actuators of many loops make of their commands."""

from __future__ import annotations

from typing import Any

from haploop.plant.line.actuator import Actuator
from haploop.protocol.arrays import nearest_multiple, where


class ActuatorArray(Actuator):
    """``Actuator`` with an array over many loops in place of every force.

    Attributes:
        saturated: how many commands were clipped so far, shape (loops,).
    """

    saturated: Any = 0

    def _driven(self, force: Any, step: int) -> Any:
        if self._resolution is not None:
            force = nearest_multiple(force, self._resolution)
        if self._most is None:
            return force
        most, is_finite = self._most, force - force == 0.0
        clipped = where(force > most, most, where(force < -most, -most, force))
        self.saturated = self.saturated + (is_finite & (clipped != force))
        return where(is_finite, clipped, force)
