"""Difference over a fixed window: quieter than over one tick, and later."""

from __future__ import annotations

from collections import deque
from typing import Any

from haploop.controller.estimators.choose import Estimator, Sample


def window_difference(ticks: int, period_s: float, _first: Any) -> Estimator:
    """(u[k] - u[k-w]) / (w T) with w = ``ticks``, over the ticks there are as long as they are fewer; 0 at the first.

    Exact for a constant rate. Delays slow signals by w T / 2, as every moving average of w values does. White noise of
    standard deviation sigma in u becomes sqrt(2) sigma / (w T), and a rounding to q steps of q / (w T)
    (Brown, Schneider, Mulligan 1992).
    """
    recent: deque[Any] = deque(maxlen=ticks + 1)

    def estimate(u: Any, _sample: Sample) -> Any:
        recent.append(u)
        return (u - recent[0]) / ((len(recent) - 1 or 1) * period_s)

    return estimate
