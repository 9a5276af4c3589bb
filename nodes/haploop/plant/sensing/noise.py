"""Noise on the measured position."""

from __future__ import annotations

from typing import Any

from haploop.plant.random.streams import Draw, stream_of
from haploop.plant.sensing.band_limited_noise import band_limited_noise


def position_noise(table: dict[str, Any], seed: Any, period_s: float) -> Draw:
    """Noise in m at the next tick, to be added before the encoder rounds; stationary from tick 0 on.

    Args:
        table: the resolved ``[noise]`` table: deviation in m, cutoff in Hz.
        seed: the scene's, or one for each of many scenes.
        period_s: one tick.
    """
    return band_limited_noise(stream_of(seed, "noise").normal(), table["deviation"], table["cutoff"], period_s)
