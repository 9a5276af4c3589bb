"""What the accelerometers of many loops make of the accelerations they feel."""

from __future__ import annotations

from typing import Any

from haploop.plant.sensing.accelerometer import Accelerometer
from haploop.protocol.arrays import clipped, where


class AccelerometerArray(Accelerometer):
    """``Accelerometer`` with an array over many loops in place of every number.

    Attributes:
        clipped: at how many ticks the range clipped the reading so far, shape (loops,).
    """

    clipped: Any = 0

    def _clip(self, reading: Any) -> Any:
        most = self._most
        self.clipped = self.clipped + where((reading >= -most) & (reading <= most), 0, 1)
        return clipped(reading, most)
