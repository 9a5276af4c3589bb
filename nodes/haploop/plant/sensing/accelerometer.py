"""What an accelerometer makes of the acceleration it feels."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from haploop.plant.counters import CLIPPED, Tally
from haploop.plant.random.streams import Draw, stream_of
from haploop.plant.sensing.band_limited_noise import band_limited_noise
from haploop.protocol.arrays import clipped, each, nearest_multiple
from haploop.protocol.ticks import Timebase


class Accelerometer:
    """Reading = (a + bias + noise), clipped to +-range, rounded to the nearest whole count within the range.

    The noise is white with one-sided density D (m/s^2/sqrt(Hz)). Through a first-order bandwidth B its deviation is
    D sqrt(pi / 2 B), and it is correlated from tick to tick; without a bandwidth the sensor passes what the tick rate
    can tell, D sqrt(rate / 2), and it is white. The bandwidth's effect on the acceleration itself, and the delay,
    are the motion's.

    Args:
        table: the resolved ``[accelerometer]`` table.
        seed: the scene's.
        time: the integers of the run.

    Attributes:
        tallies: the ticks at which the range clipped the reading, where there is a range.
    """

    def __init__(self, table: dict[str, Any], seed: int, time: Timebase) -> None:
        self._tick, self._steps = 0, time.steps_per_tick
        self._most = table.get("range", math.inf)
        self._clipped = Tally()
        self.tallies: dict[str, Tally] = {}
        self._stages: list[Callable[[float], float]] = []
        bias = table["bias"]
        if np.any(bias):
            self._stages.append(lambda a: a + bias)
        if np.any(table["noise_density"]):
            noise = _noise(table, seed, time)
            self._stages.append(lambda a: a + noise())
        if "range" in table:
            self.tallies[CLIPPED] = self._clipped
            self._stages.append(self._clip)
        if "resolution" in table:
            self._stages.append(_rounded(table["resolution"], self._most))

    def reading(self, acceleration: float) -> float:
        """What is read at the next tick, m/s^2; to be called at every tick from tick 0 on."""
        for stage in self._stages:
            acceleration = stage(acceleration)
        return acceleration

    def _clip(self, reading: float) -> float:
        most, tick = self._most, self._tick
        self._tick += 1
        if -most <= reading <= most:
            return reading
        self._clipped.note(tick * self._steps)
        return clipped(reading, most)


def _noise(table: dict[str, Any], seed: Any, time: Timebase) -> Draw:
    normal, density = stream_of(seed, "accelerometer").normal(), table["noise_density"]
    if "bandwidth" not in table:
        deviation = density * math.sqrt(time.control_rate / 2.0)
        return lambda: deviation * normal()
    deviation = density * each(math.sqrt, math.pi / 2.0 * table["bandwidth"])
    return band_limited_noise(normal, deviation, table["bandwidth"], time.period_s)


def _rounded(resolution: Any, most: Any) -> Callable[[Any], Any]:
    """Rounding to whole counts that keeps to the last count within the range."""
    most = each(_last_count, resolution, most)
    return lambda reading: clipped(nearest_multiple(reading, resolution), most)


def _last_count(resolution: float, most: float) -> float:
    if math.isinf(most):
        return most
    return min(most, math.floor(most / resolution * (1.0 + 1e-12)) * resolution)  # 0.3 holds three counts of 0.1
