"""Measures of a swing: how wide, at which frequency, how fast it grows, and whether a hand feels it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from haploop.logger.verdict.about_trend import about_trend

# Widths below this are rounding.
LEAST_WIDTH_M = 1e-15
# Frequency in Hz and smallest amplitude in m that is felt, 0 to peak (Israr, Choi and Tan 2006, three of their points).
_FREQUENCIES_HZ = (10.0, 20.0, 320.0)
_SMALLEST_M = (26e-6, 8.5e-6, 0.06e-6)


class Trend(NamedTuple):
    """Growth of the width of swings, e^(rate t); arrays of one shape.

    Attributes:
        rate_1_s: from a straight line through the logarithms of the widths.
        error_1_s: its standard error, from how the widths scatter about the line.
        change: change of the logarithm over the time looked at; ``error`` its standard error.
    """

    rate_1_s: np.ndarray
    error_1_s: np.ndarray
    change: np.ndarray
    error: np.ndarray


def widths(x: np.ndarray, size: int) -> np.ndarray:
    """Returns the width of x about its straight trend, peak to peak, in pieces of ``size`` samples, oldest first.

    ``x`` is of shape (..., samples), the result of shape (..., pieces); leftover samples, at the start, are dropped.
    """
    pieces = x[..., x.shape[-1] % size :].reshape(*x.shape[:-1], -1, size)
    return np.ptp(about_trend(pieces), axis=-1)


def level_widths(x: np.ndarray, size: int) -> np.ndarray:
    """Returns what ``widths`` does, but about a trend that a swing does not tilt, fitted under a Hann window.

    A swing tilts a straight line through a piece that does not hold whole periods of it, and the width about that line
    is up to 15 % too large if a piece covers two periods; this width is up to 8 % too large, from four periods on 3 %.
    """
    return np.ptp(_about_trend(x, size)[0], axis=-1)


def sizes(x: np.ndarray, size: int) -> np.ndarray:
    """Returns what ``widths`` would return for a sine, from the mean square about the trend under a Hann window.

    The minimum and maximum of a piece that does not hold whole periods depend on where it begins. Over a row of pieces
    this looks like growth, of up to 0.2 in the logarithm over twelve of them; with these sizes it is up to 0.03 if a
    piece covers two periods, and 0.002 if it covers three.
    """
    offset, weight = _about_trend(x, size)
    return np.sqrt(8.0 * np.vecdot(np.square(offset, out=offset), weight))


def _about_trend(x: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns pieces of ``size`` samples about lines that are fitted under a Hann window, and the window."""
    pieces = x[..., x.shape[-1] % size :].reshape(*x.shape[:-1], -1, size)
    t = np.arange(size) - (size - 1) / 2.0
    weight = np.hanning(size + 2)[1:-1]
    weight /= weight.sum()
    offset = pieces - np.vecdot(pieces, weight)[..., None]
    offset -= t * (np.vecdot(offset, weight * t) / np.vecdot(weight * t, t))[..., None]
    return offset, weight


def trend(width: np.ndarray, spacing_s: float, unsure: np.ndarray | float = 0.0) -> Trend:
    """Returns the growth of widths that lie ``spacing_s`` apart, shape (..., at least three).

    ``unsure`` is a standard error of the change that does not show in the scatter, shape (...).
    """
    count = width.shape[-1]
    t_s = (np.arange(count) - (count - 1) / 2.0) * spacing_s
    return trend_at(width, t_s, count * spacing_s, unsure)


def trend_at(width: np.ndarray, t_s: np.ndarray, seconds: float, unsure: np.ndarray | float = 0.0) -> Trend:
    """Returns the growth of widths at times ``t_s`` from their mean, and the change over ``seconds``; see ``trend``."""
    logs = np.log(np.maximum(width, LEAST_WIDTH_M))
    square = np.vecdot(t_s, t_s)
    rate = np.vecdot(logs, t_s) / square
    left = logs - logs.mean(axis=-1, keepdims=True) - rate[..., None] * t_s
    error = np.hypot(np.sqrt(np.vecdot(left, left) / ((len(t_s) - 2) * square)), unsure / seconds)
    return Trend(rate, error, rate * seconds, error * seconds)


def frequency_Hz(x: np.ndarray, rate: float) -> np.ndarray:
    """Returns the frequency at which x, sampled at ``rate`` in Hz, swings most; 0 if it rests.

    The lines of a spectrum lie 1 / duration apart; the peak between them is that of a parabola through the logarithms
    of the highest line and its neighbours, which under a Hann window is right to 0.05 of that spacing for a sine of
    three periods or more.

    Args:
        x: shape (..., samples).
    """
    count = x.shape[-1]
    power = np.abs(np.fft.rfft((x - x.mean(axis=-1, keepdims=True)) * np.hanning(count)))
    peak, last = 1 + np.argmax(power[..., 1:], axis=-1), power.shape[-1] - 1
    beside = [np.minimum(peak + i, last)[..., None] for i in (-1, 0, 1)]
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = [np.log(np.take_along_axis(power, line, axis=-1)[..., 0]) for line in beside]
        between = 0.5 * (logs[0] - logs[2]) / (logs[0] - 2.0 * logs[1] + logs[2])
    between = np.where((np.abs(between) <= 0.5) & (peak < last), between, 0.0)
    return np.where(power[..., 1:].any(axis=-1), (peak + between) * rate / count, 0.0)


def most_felt(x: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns the strength of x as a multiple of the least that is felt, and the frequency in Hz that is felt most.

    The energies of all frequencies add, each divided by that of the least felt there (Bensmaia, Hollins and Yau 2005):
    a fast chatter may be felt under a slow swing that is wider and not felt. ``x`` is of shape (..., samples).
    """
    count = x.shape[-1]
    window, t = np.hanning(count), np.arange(count) - (count - 1) / 2.0
    offset = x - x.mean(axis=-1, keepdims=True)
    offset -= t * (np.vecdot(offset, t) / np.vecdot(t, t))[..., None]
    frequencies = np.fft.rfftfreq(count, 1.0 / rate)[1:]
    amplitude = 2.0 / window.sum() * np.abs(np.fft.rfft(offset * window))[..., 1:]
    times_felt = amplitude / smallest_felt_m(frequencies)
    # A sine has one and a half times the square of its amplitude under a Hann window.
    return np.sqrt(np.vecdot(times_felt, times_felt) / 1.5), frequencies[np.argmax(times_felt, axis=-1)]


def smallest_felt_m(frequency_Hz: Any) -> Any:
    """Returns the smallest amplitude that is felt at a frequency or at each of an array, 0 to peak, in m.

    Straight lines in the logarithms join the points of Israr, Choi and Tan (2006); below the first and above the last
    the lines continue, and nothing is felt at 0 Hz.
    """
    f, a = np.log(_FREQUENCIES_HZ), np.log(_SMALLEST_M)
    with np.errstate(divide="ignore"):
        at = np.log(np.asarray(frequency_Hz, float)) - f[1]
    slow, fast = np.diff(a) / np.diff(f)
    return np.exp(a[1] + np.where(at < 0.0, slow, fast) * at)


def is_felt(width_m: float, frequency_Hz: float) -> bool:
    """Tells whether a swing of a width, peak to peak, is felt at its frequency."""
    return bool(width_m / 2.0 >= smallest_felt_m(frequency_Hz))
