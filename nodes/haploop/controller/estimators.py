"""Velocity and acceleration from sampled positions: backward differences, low-passed where the scene says so."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

Sample = Sequence[Any]
# From the newest input and the sample it came with to the estimate; what it remembers is its own.
Estimator = Callable[[Any, Sample], Any]


def difference(period_s: float, first: Any) -> Estimator:
    """Backward difference (u[k] - u[k-1]) / T, 0 at the first input; delays by half a period."""
    before = first

    def estimate(u: Any, _sample: Sample) -> Any:
        nonlocal before
        rate = (u - before) / period_s
        before = u
        return rate

    return estimate


def low_passed(raw: Estimator, cutoff_hz: float, period_s: float, first: Any) -> Estimator:
    """First-order low-pass y += (1 - exp(-2 pi fc T)) (u - y), y starting at the first input.

    Delays slow signals by about 1 / (2 pi fc).
    """
    gain = 1.0 - math.exp(-2.0 * math.pi * cutoff_hz * period_s)
    y = first

    def estimate(u: Any, sample: Sample) -> Any:
        nonlocal y
        y = y + gain * (raw(u, sample) - y)
        return y

    return estimate


def reading(_v: Any, sample: Sample) -> Any:
    """The accelerometer's own, as it came with the sample."""
    return sample[1]


def velocity_estimator(table: dict[str, Any], period_s: float, first: Sample) -> Estimator:
    """From measured position to v[k] by the ``[velocity]`` table; ``first`` is the sample of the first tick."""
    raw = difference(period_s, first[0])
    return low_passed(raw, table["cutoff"], period_s, 0.0 * first[0]) if "cutoff" in table else raw


def acceleration_estimator(table: dict[str, Any], period_s: float, first: Sample) -> Estimator:
    """From v[k], as filtered, to a[k] by the ``[acceleration]`` table."""
    start = 0.0 * first[0]
    if table.get("source") == "accelerometer":
        raw, start = reading, first[1]
    else:
        raw = difference(period_s, start)
    return low_passed(raw, table["cutoff"], period_s, start) if "cutoff" in table else raw
