"""Velocity and acceleration from sampled positions: backward differences, low-passed where the scene says so."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

Sample = Sequence[Any]


class LowPass:
    """First-order low-pass y += (1 - exp(-2 pi fc T)) (u - y), y starting at the first input.

    Delays slow signals by about 1 / (2 pi fc).
    """

    def __init__(self, cutoff_hz: float, period_s: float, first: Any) -> None:
        self._gain = 1.0 - math.exp(-2.0 * math.pi * cutoff_hz * period_s)
        self._y = first

    def __call__(self, u: Any) -> Any:
        self._y = self._y + self._gain * (u - self._y)
        return self._y


class Difference:
    """Backward difference (u[k] - u[k-1]) / T, 0 at the first input; delays by half a period."""

    def __init__(self, period_s: float, first: Any) -> None:
        self._period_s = period_s
        self._previous = first

    def __call__(self, u: Any) -> Any:
        rate = (u - self._previous) / self._period_s
        self._previous = u
        return rate


def velocity_estimator(table: dict[str, Any], period_s: float, first: Sample) -> Callable[[Any], Any]:
    """From measured position to v[k] by the ``[velocity]`` table; ``first`` is the sample of the first tick."""
    difference = Difference(period_s, first[0])
    if "cutoff" not in table:
        return difference
    low_pass = LowPass(table["cutoff"], period_s, 0.0 * first[0])
    return lambda x: low_pass(difference(x))


def acceleration_estimator(table: dict[str, Any], period_s: float, first: Sample) -> Callable[[Any, Sample], Any]:
    """From v[k] (as filtered) and the sample to a[k] by the ``[acceleration]`` table."""
    raw: Callable[[Any, Sample], Any]
    if table.get("source") == "accelerometer":
        start = first[1]
        raw = _reading
    else:
        start = 0.0 * first[0]
        difference = Difference(period_s, start)
        raw = lambda v, _sample: difference(v)  # noqa: E731
    if "cutoff" not in table:
        return raw
    low_pass = LowPass(table["cutoff"], period_s, start)
    return lambda v, sample: low_pass(raw(v, sample))


def _reading(_v: Any, sample: Sample) -> Any:
    return sample[1]
