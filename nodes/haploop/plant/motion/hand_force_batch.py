"""tau(t) of many loops at once."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.plant.motion.hand_force import HandForce


class HandForceArray(HandForce):
    """The hand forces of many loops at plant steps, in N: ``at_steps`` has a last axis for the loops.

    That axis is of length 1 where all loops have the same force.

    Args:
        table: the stacked ``[hand.force]`` table, or None for no force.
        plant_rate: plant steps per second.

    Attributes:
        is_shared: whether all loops have the same force.
    """

    def __init__(self, table: dict[str, Any] | None, plant_rate: int) -> None:
        super().__init__(table, plant_rate)
        self.is_shared = not any(isinstance(value, np.ndarray) for value in (table or {}).values())
        if not self.is_shared:
            self._piece_steps = 256

    def _times(self, index: int) -> np.ndarray:
        return super()._times(index)[:, None]
