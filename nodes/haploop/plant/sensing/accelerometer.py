"""The reading of an accelerometer: bias, noise, range and resolution."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from haploop.plant.counters import CLIPPED, Counter, make_counter
from haploop.plant.sensing.noise import Noise, make_noise
from haploop.plant.streams import make_normal, select_draws
from haploop.protocol.arrays import clipped, each, nearest_multiple
from haploop.protocol.scene import effects
from haploop.protocol.scene.scene import Scene, accelerometer_is_used
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_select


class Reading(NamedTuple):
    """Parameters of a reading: (a + bias + noise), clipped to +-range, rounded to the nearest count within the range.

    A parameter that is None has no effect. In a batch numbers may be arrays of shape (members,).

    Attributes:
        bias, range, resolution: m/s^2.
        last_count: the last whole count within the range, m/s^2.
    """

    bias: Any
    noise: Noise | None
    range: Any
    resolution: Any
    last_count: Any

    def of(self, acceleration: Any, noise: Any) -> tuple[Any, Any]:
        """Returns (reading in m/s^2, whether the range clipped it) of an acceleration and the noise of this tick."""
        bias, has_noise, most, resolution, last_count = self
        value = acceleration if bias is None else acceleration + bias
        if has_noise is not None:
            value = value + noise
        is_clipped: Any = False
        if most is not None:
            limited = clipped(value, most)
            if limited is not value or value != value:  # not a float within the range
                inside = (value >= -most) & (value <= most)
                is_clipped = not inside if inside.__class__ is bool else ~inside
            value = limited
        if resolution is not None:
            value = clipped(nearest_multiple(value, resolution), last_count)
        return value, is_clipped


class Accelerometer:
    """An accelerometer read once a tick; the motion applies its delay and the effect of its bandwidth on the signal.

    The noise is white with one-sided density D (m/s^2/sqrt(Hz)). Through a first-order bandwidth B its deviation is
    D sqrt(pi / 2 B), and it is correlated from tick to tick; without a bandwidth the sensor passes all that the tick
    rate can resolve: the deviation is D sqrt(rate / 2), and the noise is white.

    Attributes:
        draw: returns the next standard normal number of the noise, or a row of them; None without noise.
        state: (ticks read so far, noise at the last one or None, clipped readings).
        counters: the ticks at which the range clipped the reading, where there is a range.
    """

    def __init__(self, table: effects.Accelerometer, seed: Any, time: Timebase, members: int | None = None) -> None:
        self._seed, self._steps = seed, time.steps_per_tick
        self._read, self._noise = 0, None
        noise = _noise(table, time) if np.any(table.noise_density) else None
        self.draw = make_normal(seed, "accelerometer") if noise else None
        most, resolution, last_count = table.range, table.resolution, None
        if resolution is not None:
            last_count = each(_last_count, resolution, math.inf if most is None else most)
        bias = table.bias if np.any(table.bias) else None
        self.parameters = Reading(bias, noise, most, resolution, last_count)
        self._clipped = make_counter(members)
        self.counters: dict[str, Counter] = {} if most is None else {CLIPPED: self._clipped}

    def reading(self, acceleration: Any) -> Any:
        """Returns the reading of the next tick, m/s^2; to be called at every tick from tick 0 on."""
        if self.draw:
            assert self.parameters.noise
            self._noise = self.parameters.noise.after(self._noise, self.draw())
        value, is_clipped = self.parameters.of(acceleration, self._noise)
        if is_clipped is not False:
            self._clipped.note(self._read * self._steps, is_clipped)
        self._read += 1
        return value

    @property
    def state(self) -> tuple[int, Any, Any]:
        return self._read, self._noise, self._clipped.state

    def restore(self, state: tuple[int, Any, Any]) -> None:
        self._read, self._noise, clipped = state
        self._clipped.restore(clipped)
        if self.draw:
            self.draw = make_normal(self._seed, "accelerometer", self._read)

    def select(self, kept: np.ndarray) -> None:
        self.parameters, self._noise, self._seed = tree_select((self.parameters, self._noise, self._seed), kept)
        self._clipped.select(kept)
        select_draws(self.draw, kept)


def make_accelerometer(scene: Scene, time: Timebase, members: int | None = None) -> Accelerometer | None:
    """Makes the sensor of the true acceleration; None if this is read unchanged, or not at all."""
    if scene.accelerometer is None or not accelerometer_is_used(scene):
        return None
    return Accelerometer(scene.accelerometer, scene.seed, time, members)


def _noise(table: effects.Accelerometer, time: Timebase) -> Noise:
    density = table.noise_density
    if table.bandwidth is None:
        return Noise(density * math.sqrt(time.control_rate / 2.0))
    deviation = density * each(math.sqrt, math.pi / 2.0 * table.bandwidth)
    return make_noise(deviation, table.bandwidth, time.period_s)


def _last_count(resolution: float, most: float) -> float:
    if math.isinf(most):
        return most
    return min(most, math.floor(most / resolution * (1.0 + 1e-12)) * resolution)  # 0.3 holds three counts of 0.1
