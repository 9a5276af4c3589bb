"""The encoder: the measured position at a tick."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from haploop.protocol.arrays import floor, rint
from haploop.protocol.scene.scene import Encoder
from haploop.protocol.trees import tree_select

ROUNDINGS = {"nearest": rint, "floor": floor}


def make_encoder(table: Encoder | None) -> Callable[[Any], Any]:
    """Makes the function from true to measured position: q rint(x / q) or q floor(x / q); without a table, x itself."""
    if table is None:
        return lambda x: x
    resolution, whole = table.resolution, ROUNDINGS[table.rounding]
    if whole is not rint:
        return lambda x: resolution * whole(x / resolution)

    def nearest(x: Any) -> Any:  # the same as with ``whole``, with one call less for a number
        counts = x / resolution
        return resolution * (float(round(counts)) if counts.__class__ is float else rint(counts))

    return nearest


class PositionSensor:
    """Measured position of the device, as the encoder rounds it.

    Attributes:
        reading: returns the measured position of x in m at the next tick; to be called at every tick from tick 0 on.
        state: empty for a sensor without noise.
    """

    def __init__(self, encoder: Encoder | None) -> None:
        self.encoder = encoder
        self.reading = make_encoder(encoder)

    @property
    def state(self) -> Any:
        return ()

    def restore(self, state: Any) -> None:
        """Continues from a state."""

    def select(self, kept: np.ndarray) -> None:
        self.encoder = tree_select(self.encoder, kept)
        self.reading = make_encoder(self.encoder)
