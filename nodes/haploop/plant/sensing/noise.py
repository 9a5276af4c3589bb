"""Noise of sensors at ticks: white, or white through a first-order low-pass."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from haploop.plant.sensing.encoder import PositionSensor, make_encoder
from haploop.plant.streams import make_normal, select_draws
from haploop.protocol.arrays import each
from haploop.protocol.scene import effects
from haploop.protocol.scene.scene import Encoder
from haploop.protocol.trees import tree_select


class Noise(NamedTuple):
    """Samples of a stationary Ornstein-Uhlenbeck process, exact at ticks.

        n[0] = sigma xi[0],  n[k+1] = rho n[k] + sigma sqrt(1 - rho^2) xi[k+1],  rho = exp(-2 pi cutoff T)

    Its deviation is sigma at every tick and its autocorrelation sigma^2 rho^|j| at a distance of j ticks: those of
    white noise of density D through 1 / (1 + s / (2 pi cutoff)) with sigma = D sqrt(pi / 2 cutoff) (one-sided).
    What lies above half the tick rate is folded back, as by any sampler (Uhlenbeck and Ornstein 1930).

    Attributes:
        deviation: sigma; in a batch a number for all members or an array of shape (members,), like the others.
        keep: rho, or None for white noise.
        fresh: sigma sqrt(1 - rho^2), or None for white noise.
    """

    deviation: Any
    keep: Any = None
    fresh: Any = None

    def after(self, before: Any, draw: Any) -> Any:
        """Returns the noise at a tick from that of the tick before (None at tick 0) and a standard normal number."""
        if before is None or self.keep is None:
            return self.deviation * draw
        return self.keep * before + self.fresh * draw


def make_noise(deviation: Any, cutoff_Hz: Any, period_s: float) -> Noise:
    """Makes band-limited noise from its deviation, the cutoff at which its spectrum is down to half, and the tick."""
    decay = -math.tau * cutoff_Hz * period_s
    keep, fresh = each(math.exp, decay), deviation * each(math.sqrt, -each(math.expm1, 2.0 * decay))
    return Noise(deviation, keep, fresh)


class NoisyPositionSensor(PositionSensor):
    """Measured position of the device plus band-limited noise, as the encoder rounds it; stationary from tick 0 on.

    Attributes:
        draw: returns the standard normal number of the next tick, or a row of shape (members,).
        state: (ticks measured so far, noise at the last one or None).
    """

    def __init__(self, encoder: Encoder | None, table: effects.Noise, seed: Any, period_s: float) -> None:
        super().__init__(encoder)
        self.noise = make_noise(table.deviation, table.cutoff, period_s)
        self._seed, self.draw = seed, make_normal(seed, "noise")
        self._measured, self._last = 0, None
        self._prepare()

    def _prepare(self) -> None:
        self._encode, self.reading = make_encoder(self.encoder), self._noisy

    def _noisy(self, x: Any) -> Any:
        self._last = noise = self.noise.after(self._last, self.draw())
        self._measured += 1
        return self._encode(x + noise)

    @property
    def state(self) -> Any:
        return self._measured, self._last

    def go_on(self, measured: int, noise: Any) -> None:
        """Continues from the noise after ``measured`` ticks, whose numbers have all been drawn."""
        self._measured, self._last = measured, noise

    def restore(self, state: Any) -> None:
        self._measured, self._last = state
        self.draw = make_normal(self._seed, "noise", self._measured)

    def select(self, kept: np.ndarray) -> None:
        self.encoder, self.noise, self._last, self._seed = tree_select(
            (self.encoder, self.noise, self._last, self._seed), kept
        )
        select_draws(self.draw, kept)
        self._prepare()
