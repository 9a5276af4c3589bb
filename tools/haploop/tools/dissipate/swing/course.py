"""Widths of a swing along its windows, and the word for their course: grew, died down, varied or stayed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from haploop.tools.dissipate.recording.samples import Floats

Course = Literal["stayed", "grew", "died down", "varied"]

# Each window is evaluated at this many places; the fit around each spans this many periods, but no less than this long,
# s, and no more than this share of the window.
PLACES = 32
_PERIODS, _LEAST_S, _MOST = 3.0, 0.03, 0.6
# The degree of the drift that is fitted beside the sine.
_DRIFT = 2
# A width has changed by at least this factor, and by more than this many standard errors, as far apart as extremes of
# noise may lie.
TELLS, _UNSURE = 1.2, 7.0
# A swing grew or died down all the way where it never went back by more than this share of the change.
_BACK = 0.15
# A swing that fills a part of a window is nowhere narrower there than this share of its widest place.
_FILLS = 0.5
_WAYS: dict[Course, int] = {"grew": 1, "died down": -1}


@dataclass(frozen=True, eq=False)
class Widths:
    """Widths along a window, m, peak to peak of the sine fitted around each place, and their standard error, m."""

    width_m: Floats
    error_m: float

    def varies(self, places: slice) -> bool:
        """Tells whether the widths at some places differ by more than a tenth and what noise causes together."""
        some = self.width_m[places]
        return bool(np.ptp(some) > 0.1 * some.mean() + _UNSURE * self.error_m)

    def fills(self, places: slice) -> bool:
        """Tells whether the swing is there at all of some places, neither at its onset nor at its end."""
        some = self.width_m[places]
        return bool(some.min() > _FILLS * some.max())


def widths(x_m: Floats, rate_Hz: float, frequency_Hz: float) -> Widths:
    """Returns the widths of a swing at ``PLACES`` places along a window.

    Around each place a sine of that frequency and a parabola are fitted under a Hann window: this follows the width of
    a swing that beats or grows to some 3 % where the width changes ten times as slowly as it swings. Near the ends of
    the window the fit is that of the nearest place with enough samples around it. The error is that of white noise as
    large as the residual of the fits.
    """
    count = len(x_m)
    size = int(min(max(_PERIODS / frequency_Hz, _LEAST_S) * rate_Hz, _MOST * count)) | 1
    u = np.arange(size) - size // 2
    turn, weight = 2.0 * np.pi * frequency_Hz / rate_Hz * u, np.cos(np.pi * u / (size + 1.0))
    drift = np.vander(u / size, _DRIFT + 1)
    columns = np.column_stack([np.cos(turn), np.sin(turn), drift])
    fit = np.linalg.pinv(columns * weight[:, None]) * weight
    middles = (np.arange(PLACES) + 0.5) / PLACES * count
    first = np.clip(middles.astype(int) - size // 2, 0, count - size)
    around = np.lib.stride_tricks.sliding_window_view(x_m, size)[first]
    found = around @ fit.T
    left = (around - found @ columns.T) * weight
    noise_m = np.sqrt(np.median((left**2).sum(axis=-1)) / (weight**2).sum())
    error_m = 2.0 * float(noise_m) * float(np.linalg.norm(fit[0]))
    return Widths(2.0 * np.hypot(found[:, 0], found[:, 1]), error_m)


def course(width_m: Floats, error_m: float) -> Course:
    """Returns the course of a swing from its widths in the order of time, m."""
    least_m, most_m = float(width_m.min()), float(width_m.max())
    if most_m < TELLS * least_m or most_m - least_m < _UNSURE * error_m:
        return "stayed"
    for word, along in _WAYS.items():
        ordered_m = width_m[::along]
        back_m = float((np.maximum.accumulate(ordered_m) - ordered_m).max())
        change_m = float(ordered_m[-1] - ordered_m[0])
        if change_m > (TELLS - 1.0) * ordered_m[0] and back_m < _BACK * change_m + _UNSURE * error_m:
            return word
    return "varied"
