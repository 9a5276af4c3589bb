"""White noise through a first-order low-pass, at ticks."""

from __future__ import annotations

import math

from haploop.plant.random.streams import Draw
from haploop.protocol.arrays import each


def band_limited_noise(normal: Draw, deviation: float, cutoff_Hz: float, period_s: float) -> Draw:
    """Samples of a stationary Ornstein-Uhlenbeck process, exact at ticks.

        n[0] = sigma xi[0],  n[k+1] = rho n[k] + sigma sqrt(1 - rho^2) xi[k+1],  rho = exp(-2 pi cutoff T)

    Its deviation is sigma at every tick and its autocorrelation sigma^2 rho^|j| at a distance of j ticks: those of
    white noise of density D through 1 / (1 + s / (2 pi cutoff)) with sigma = D sqrt(pi / 2 cutoff) (one-sided).
    What lies above half the tick rate is folded back, as by any sampler (Uhlenbeck and Ornstein 1930).

    Args:
        normal: standard normal numbers xi.
        deviation: sigma.
        cutoff_Hz: where the spectrum has fallen to half.
        period_s: T, one tick.

    Returns:
        The noise at the next tick, in the unit of ``deviation``; the first call is tick 0.
    """
    decay = -math.tau * cutoff_Hz * period_s
    keep, fresh = each(math.exp, decay), deviation * each(math.sqrt, -each(math.expm1, 2.0 * decay))
    noise = None

    def at_next_tick():
        nonlocal noise
        noise = deviation * normal() if noise is None else keep * noise + fresh * normal()
        return noise

    return at_next_tick
