"""Amplitude spectra of force and position, and the line that stands out in one."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from haploop.logger.verdict.about_trend import about_trend

# A line is reported if it holds this share of all that swings; below, there are many lines or noise.
_STANDS_OUT = 0.25
# Lines up to this many resolved frequencies beside the highest are part of it: a Hann window is that wide.
_HALF_WIDTH = 2
_FEWEST = 16


class Line(NamedTuple):
    """The line of a spectrum: its frequency, its swing peak to peak in the unit of the samples, and its share.

    ``share`` is that of the variance, 0 to 1.
    """

    frequency_Hz: float
    width: float
    share: float


@lru_cache(maxsize=8)
def _hann(count: int) -> np.ndarray:
    return np.hanning(count + 1)[:-1]


def amplitudes(samples: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns frequencies in Hz and amplitudes, 0 to peak, of samples of shape (..., count) less their straight trend.

    A Hann window is used, so that a sine of amplitude A shows as A at its frequency; frequencies are spaced by
    ``rate / count``, and the first is above 0.
    """
    count = samples.shape[-1]
    window = _hann(count)
    found = np.abs(np.fft.rfft(about_trend(samples) * window)) * (2.0 / window.sum())
    return np.fft.rfftfreq(count, 1.0 / rate)[1:], found[..., 1:]


def main_line(samples: np.ndarray, rate: float, above_Hz: float = 0.0) -> Line | None:
    """Returns the line that stands out in the spectrum of samples, shape (count,); None if none does.

    Under a Hann window, a sine that lies d lines beside the highest, of height h, has neighbours of
    h (1 - d) / (2 + d) and h (1 + d) / (2 - d), and the amplitude h pi d (1 - d^2) / sin(pi d): its frequency and
    height follow from the three without bias, except for leakage from other lines. The result is None, too, if fewer
    than three periods were seen, for which a frequency is a guess. What is no faster than ``above_Hz`` does not count,
    nor does leakage from there: a peak with a higher neighbour at the next lower frequency is no line.
    """
    if len(samples) < _FEWEST or not np.isfinite(samples).all():
        return None
    at, height = amplitudes(samples, rate)
    power = np.where(at > above_Hz, height**2, 0.0)
    peak = int(np.argmax(power))
    if peak < 2 or height[peak - 1] > height[peak] or not height[peak] > 1e-12 * np.abs(samples).max():
        return None
    line = line_at(at, height, peak, float(power[lobe(peak)].sum() / power.sum()))
    return line if line.share >= _STANDS_OUT else None


def lobe(peak: int) -> slice:
    """Returns the part of a spectrum that belongs to the line with this peak."""
    return slice(max(0, peak - _HALF_WIDTH), peak + _HALF_WIDTH + 1)


def line_at(at: np.ndarray, height: np.ndarray, peak: int, share: float) -> Line:
    """Returns the line of a peak in a spectrum, with frequency and width interpolated as in ``main_line``."""
    offset = 0.0
    if peak + 1 < len(height):
        low, mid, high = height[peak - 1 : peak + 2]
        offset = 2.0 * (high - low) / (low + 2.0 * mid + high)
    top = height[peak] * (1.0 - offset**2) / np.sinc(offset)
    return Line(float(at[peak] + offset * (at[1] - at[0])), float(2.0 * top), share)
