"""The period of samples whose time stamps are rounded but even, as far as the rounding shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from haploop.tools.dissipate.recording.samples import Floats

# Decimal places that are tried: stamps with more are taken as they are.
_DIGITS = range(-6, 8)
_ROUNDING = 1e-6
# Steps of an even grid differ by the step of the rounding at most; longer ones, by this factor, are gaps.
_LONGER = 1.1
# How many times a third is cut off the range that is searched.
_NARROWER = 40
# Fewest samples without a gap that give a period.
_FEWEST = 16
# A step too long for one period but shorter than this many has a single sample missing; two neighbouring steps that are
# together shorter than this have none missing, but a late or early one.
ONE_MISSING = 2.5
# Times scatter where this percentile of the deviations of steps from their median is no less than this share of it.
_OF_STEPS, _SCATTER = 80, 0.02

Flags = np.ndarray[tuple[int], np.dtype[np.bool_]]


@dataclass(frozen=True)
class Stamps:
    """The period of samples, s, and the step to which their times are rounded, s; 0 where no rounding is seen."""

    period_s: float
    rounded_s: float = 0.0


def stamps(times: Floats, unit_s: float) -> Stamps:
    """Returns the period of samples from their times in seconds; ``unit_s``: the unit in which a file gave them.

    An even grid t0 + k P, rounded or truncated to a step r, deviates from a line by no more than r from its least to
    its greatest deviation. Where all times do so although their steps differ, P is the slope of the line through them
    (that of a whole number of samples a second where it fits as well); otherwise it is the median of the steps or,
    where they scatter, the slope of the line through the times over their places.
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
    for _ in range(_NARROWER):  # for the narrowest band, whose width is a convex function of the period
        left_s, right_s = (2.0 * low_s + high_s) / 3.0, (low_s + 2.0 * high_s) / 3.0
        low_s, high_s = (low_s, right_s) if width_s(left_s) < width_s(right_s) else (left_s, high_s)
    some = 1.0 / max(1.0, round(1.0 / period_s)), period_s, (low_s + high_s) / 2.0
    found = next((each for each in some if width_s(each) <= rounded_s * (1.0 + _ROUNDING)), None)
    return Stamps(found, rounded_s) if found else Stamps(_scattered_s(times, steps, median_s))


def is_late(steps: Floats, period_s: float) -> Flags:
    """Tells for each step between samples whether the sample at either end is late or early, so that none is missing.

    The neighbouring step is then shorter by as much.
    """
    padded = np.concatenate([[np.inf], steps, [np.inf]])
    return np.minimum(padded[:-2], padded[2:]) + steps < ONE_MISSING * period_s


def _scattered_s(times: Floats, steps: Floats, median_s: float) -> float:
    """Returns the mean period of times that scatter about an even grid; the median step of those that do not."""
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
