"""Confidence intervals, at 95 %: of a share, and of a mean."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

_Z = 1.959964


class Interval(NamedTuple):
    """An estimate and the ends of its interval."""

    value: float
    low: float
    high: float

    def apart(self, other: Interval) -> bool:
        """Tells whether two intervals have no point in common."""
        return self.low > other.high or other.low > self.high


def share_interval(held: Sequence[bool] | np.ndarray, clusters: Sequence[object] | None = None) -> Interval:
    """Returns the share of True with its interval by Wilson (1927); NaN if there are no values.

    Draws in clusters tell less than as many single draws: n is then p (1 - p) over the variance of p between clusters
    (Kish's effective size), at most the number drawn.
    """
    n = float(len(held))
    if not n:
        return Interval(math.nan, math.nan, math.nan)
    p = float(np.mean(held))
    if clusters is not None and 0.0 < p < 1.0:
        _, of = np.unique(np.asarray([repr(one) for one in clusters]), return_inverse=True)
        count = int(of.max()) + 1
        off = np.bincount(of, weights=np.asarray(held, float) - p)
        if count > 1 and off.any():
            n = min(n, p * (1.0 - p) / (count / (count - 1.0) * float(off @ off) / n**2))
    middle, width = (p + _Z**2 / (2 * n)), _Z * math.sqrt(p * (1.0 - p) / n + _Z**2 / (4 * n**2))
    scale = 1.0 + _Z**2 / n
    return Interval(p, max(0.0, (middle - width) / scale), min(1.0, (middle + width) / scale))


def mean_interval(values: Sequence[float] | np.ndarray) -> Interval:
    """Returns the mean with its interval by Student's t; infinitely wide for one value."""
    n, mean = len(values), float(np.mean(values))
    if n < 2:
        return Interval(mean, -math.inf, math.inf)
    from scipy.special import stdtrit  # a tenth of a second to import

    half = float(stdtrit(n - 1, 0.975)) * float(np.std(values, ddof=1)) / math.sqrt(n)
    return Interval(mean, mean - half, mean + half)
