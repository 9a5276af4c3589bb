"""First-order adaptive windowing: a difference over the longest window in which the signal is a straight line."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from typing import Any

from haploop.controller.estimators.choose import Estimator, Sample
from haploop.protocol.arrays import where

# A deviation of just the bound, which quantised signals make often, counts as within it however it is rounded.
_ROUNDING = 1e-6


def end_fit(ticks: int, bound: float, period_s: float, _first: Any) -> Estimator:
    """(u[k] - u[k-i]) / (i T), i <= ``ticks`` the longest window that fits (Janabi-Sharifi et al. 2000, end-fit-FOAW).

    Window i fits when the line through its two ends passes within ``bound`` of every sample between:
    |u[k-j] - u[k] + (u[k] - u[k-i]) j / i| <= bound for 0 < j < i; window 1 always does. 0 at the first tick.

    Where the rate is constant and the noise stays within +-bound / 2 every window fits, so that the error is at
    most bound / (n T) with n = ``ticks``: rounding to q is such noise, hence the default bound of one count.
    Delays by i T / 2, white noise sigma becomes sqrt(2) sigma / (i T), each with the i of the moment. Where the rate
    steps, noise apart, by more than 2 bound / T the window is 1 in the tick after, 2 in the next, and grows with the
    new rate. A bound below the noise leaves little but window 1.
    """
    recent: deque[Any] = deque(maxlen=ticks)

    def estimate(u: Any, _sample: Sample) -> Any:
        rate = u - u
        for i, rise, fits in _windows(u, recent, bound):
            rate = where(fits, rise / (i * period_s), rate)
        recent.appendleft(u)
        return rate

    return estimate


def best_fit(ticks: int, bound: float, period_s: float, _first: Any) -> Estimator:
    """The slope of least squares over the window that ``end_fit`` finds (Janabi-Sharifi et al. 2000, best-fit-FOAW).

    With r[j] = u[k] - u[k-j]: 6 (sum of (2 j - i) r[j], j = 1..i) / (T i (i + 1) (i + 2)). Delays by i T / 2 as the
    end-fit does; white noise sigma becomes sqrt(12 / (i (i + 1) (i + 2))) sigma / T, less than there from i = 3 on.
    (The authors' best fit also chooses its window by its own line; here one window serves both.)
    """
    recent: deque[Any] = deque(maxlen=ticks)

    def estimate(u: Any, _sample: Sample) -> Any:
        rate = total = moment = u - u
        for i, rise, fits in _windows(u, recent, bound):
            total = total + rise
            moment = moment + i * rise
            slope = 6.0 * (2.0 * moment - i * total) / (i * (i + 1) * (i + 2) * period_s)
            rate = where(fits, slope, rate)
        recent.appendleft(u)
        return rate

    return estimate


FITS = {"end": end_fit, "best": best_fit}


def _windows(u: Any, recent: deque[Any], bound: float) -> Iterator[tuple[int, Any, Any]]:
    """Every window i = 1, 2, ... with its rise u[k] - u[k-i], and whether its line fits.

    A line through u[k] passes within the bound of u[k-j] when its rise per tick is within (u[k] - u[k-j] +- bound) / j,
    so each sample narrows what the longer windows may be. All windows are tried: a longer one may fit where a shorter
    one does not, and loops evaluated as arrays each have their own longest.
    """
    reach = bound * (1.0 + _ROUNDING)
    least, most = -math.inf, math.inf
    for i, before in enumerate(recent, 1):
        rise = u - before
        slope = rise / i
        yield i, rise, (least <= slope) & (slope <= most)
        low, high = (rise - reach) / i, (rise + reach) / i
        least = where(low > least, low, least)
        most = where(high < most, high, most)
