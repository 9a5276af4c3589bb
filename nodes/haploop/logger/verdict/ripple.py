"""Ripple of a force: the part of it that swings faster than a hand and its task."""

from __future__ import annotations

import numpy as np

from haploop.logger.verdict.about_trend import about_trend

# Swings of the command slower than this are the hand's and the task's; faster ones are felt as a buzz.
RIPPLE_ABOVE_HZ = 30.0


def ripple(force_N: np.ndarray, rate: float) -> np.ndarray:
    """Returns the swing of a force above ``RIPPLE_ABOVE_HZ``, peak to peak in N, about its straight trend.

    A force that does not end where it began would make a jump, which contains every frequency. So the force less its
    trend is mirrored at its end before it is transformed, and one period of ``RIPPLE_ABOVE_HZ``, a quarter of the
    samples at most, is left out at either end. 4 % of a swing at 12 Hz pass, and 2 % of one at 8 Hz. The result is at
    most the swing of the force itself: at 30 Hz the edge of the filter passes a part of the line, which may be a fourth
    wider.

    Args:
        force_N: forces at equal times, shape (..., samples).
        rate: samples a second, Hz.
    """
    if force_N.shape[-1] < 4:
        return np.zeros(force_N.shape[:-1])
    with np.errstate(over="ignore", invalid="ignore"):  # the ripple of a force that is not finite is nan
        return np.minimum(np.ptp(above(force_N, rate), axis=-1), peak_to_peak(force_N))


def peak_to_peak(force_N: np.ndarray) -> np.ndarray:
    """Returns the swing of a force over its last axis, peak to peak in N; 0 without samples."""
    return np.ptp(force_N, axis=-1) if force_N.shape[-1] else np.zeros(force_N.shape[:-1])


def above(force_N: np.ndarray, rate: float) -> np.ndarray:
    """Returns the part of a force, or of another trace, above ``RIPPLE_ABOVE_HZ``, without its ends."""
    count = force_N.shape[-1]
    offset = about_trend(force_N)
    spectrum = np.fft.rfft(np.concatenate([offset, offset[..., ::-1]], axis=-1))
    spectrum[..., np.fft.rfftfreq(2 * count, 1.0 / rate) < RIPPLE_ABOVE_HZ] = 0.0
    left_out = min(round(rate / RIPPLE_ABOVE_HZ), count // 4)
    return np.fft.irfft(spectrum, 2 * count)[..., left_out : count - left_out]
