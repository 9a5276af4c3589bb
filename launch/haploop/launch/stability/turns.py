"""A slow swing from turn to turn: its logarithmic decrement needs a few periods, not necessarily of equal length."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from haploop.launch.stability.traces import Trend, trend_at

# At least this many swings, each half a period, show how they change, and how surely.
_LEAST = 6
# A turn counts once the way back is this share of the way before.
_BACK = 0.3


class Turns(NamedTuple):
    """The swings of a trace, each from one turn to the next.

    Attributes:
        trend: growth over the second half of the trace.
        first_m, last_m: width of the first swing, and mean width of the last two.
        frequency_Hz: frequency over the second half.
    """

    trend: Trend
    first_m: float
    last_m: float
    frequency_Hz: float


def turns_of(x: np.ndarray, rate: float) -> Turns | None:
    """Returns the swings of x, shape (ticks,), at ``rate`` ticks a second; None if its second half has fewer than 6."""
    ticks, at = _turns(x)
    begins = int(np.searchsorted(ticks, len(x) // 2))
    swings_m = np.abs(np.diff(at))
    if len(swings_m) - begins < _LEAST:
        return None
    middles_s = (ticks[begins:-1] + ticks[begins + 1 :]) / 2.0 / rate
    frequency_Hz = (len(ticks) - 1 - begins) / 2.0 / (ticks[-1] - ticks[begins]) * rate
    last_m = float(swings_m[-2:].mean())
    found = trend_at(swings_m[begins:], middles_s - middles_s.mean(), len(x) / 2.0 / rate)
    return Turns(found, float(swings_m[0]), last_m, float(frequency_Hz))


def _turns(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the ticks at which x turns, and x there, without its ends; a small way back is no turn."""
    moving = np.flatnonzero(np.diff(x))
    ways = np.sign(np.diff(x)[moving])
    extremes = moving[1:][ways[1:] != ways[:-1]]
    kept: list[int] = []
    for tick in extremes.tolist():
        if len(kept) > 1 and (x[tick] - x[kept[-1]]) * (x[kept[-1]] - x[kept[-2]]) > 0.0:
            kept[-1] = tick
        elif len(kept) < 2 or abs(x[tick] - x[kept[-1]]) > _BACK * abs(x[kept[-1]] - x[kept[-2]]):
            kept.append(tick)
    ticks = np.array(kept, int)
    return ticks, x[ticks]
