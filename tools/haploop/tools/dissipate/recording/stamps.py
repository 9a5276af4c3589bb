"""The period of samples whose time stamps are rounded: even ones, as far as the rounding tells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from haploop.tools.dissipate.recording.samples import Floats

# Digits behind the point that are looked for: stamps with more are taken as they are.
_DIGITS = range(-6, 8)
_ROUNDING = 1e-6
# Steps of an even grid differ by what they are rounded to, and no more; longer ones are gaps.
_LONGER = 1.1
# Thirds that are taken off what is searched.
_NARROWER = 40
# So many samples without a gap tell a period, at least.
_FEWEST = 16
# Periods below which a single sample is missing in a step, or in two of which one is late.
ONE_MISSING = 2.5
# Times scatter where of a hundred steps this many differ from the median by no less than this share of it.
_OF_STEPS, _SCATTER = 80, 0.02

Flags = np.ndarray[tuple[int], np.dtype[np.bool_]]


@dataclass(frozen=True)
class Stamps:
    """The period of samples, and the step to which their times are rounded; 0 where nothing of it is seen, s."""

    period_s: float
    rounded_s: float = 0.0


def stamps(times: Floats, unit_s: float) -> Stamps:
    """Returns the period of samples from the times in seconds that stood in a file in some unit.

    An even grid t0 + k P, rounded to a step r or cut off, deviates from a line by no more than r from its least to its
    greatest deviation. Where all do, though their steps differ, P is that of the line through them (a whole number of
    samples a second where that fits as well); otherwise it is the median of the steps, or where they scatter that of
    the line through the times over their places.
    """
    steps = np.diff(times)
    median_s = float(np.median(steps))
    rounded_s = _resolution(times / unit_s) * unit_s
    breaks = np.flatnonzero(steps > steps.min() + _LONGER * rounded_s) + 1
    longest = max(np.split(times, breaks), key=len)
    if not 0.0 < rounded_s <= median_s or len(longest) < _FEWEST or np.ptp(np.diff(longest)) < 0.5 * rounded_s:
        return Stamps(_scattered_s(times, steps, median_s))
    places = np.arange(float(len(longest)))

    def width_s(period_s: float) -> float:
        return float(np.ptp(longest - places * period_s))

    period_s = float(np.polyfit(places, longest, 1)[0])
    low_s, high_s = period_s - rounded_s / len(longest), period_s + rounded_s / len(longest)
    for _ in range(_NARROWER):  # that of the narrowest band, which is a convex function of the period
        left_s, right_s = (2.0 * low_s + high_s) / 3.0, (low_s + 2.0 * high_s) / 3.0
        low_s, high_s = (low_s, right_s) if width_s(left_s) < width_s(right_s) else (left_s, high_s)
    some = 1.0 / max(1.0, round(1.0 / period_s)), period_s, (low_s + high_s) / 2.0
    found = next((each for each in some if width_s(each) <= rounded_s * (1.0 + _ROUNDING)), None)
    return Stamps(found, rounded_s) if found else Stamps(_scattered_s(times, steps, median_s))


def is_late(steps: Floats, period_s: float) -> Flags:
    """Tells of steps between samples whether the sample at either end is late or early, so that none is missing.

    The step beside it is as much shorter then.
    """
    padded = np.concatenate([[np.inf], steps, [np.inf]])
    return np.minimum(padded[:-2], padded[2:]) + steps < ONE_MISSING * period_s


def _scattered_s(times: Floats, steps: Floats, median_s: float) -> float:
    """Returns the mean period of times that scatter about an even grid; the median of steps that do not."""
    if len(times) < _FEWEST or np.percentile(np.abs(steps - median_s), _OF_STEPS) < _SCATTER * median_s:
        return median_s
    counts = np.where(is_late(steps, median_s), 1.0, np.maximum(1.0, np.round(steps / median_s)))
    places = np.concatenate([[0.0], np.cumsum(counts)])
    return float(np.polyfit(places, times, 1)[0])


def _resolution(numbers: Floats) -> float:
    """Returns the power of ten of which all numbers are multiples; 0 where they have too many digits."""
    for digits in _DIGITS:
        scaled = numbers * 10.0**digits
        if np.abs(scaled).max() < 0.5:  # 0 is a multiple of any power, and all of these are near it
            continue
        if np.abs(scaled - np.round(scaled)).max() < _ROUNDING * max(1.0, np.abs(scaled).max() * 1e-6):
            return 10.0**-digits
    return 0.0
