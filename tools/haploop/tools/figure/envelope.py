"""Long series with their extremes kept: what a line of some thousand pixels can show."""

from __future__ import annotations

import numpy as np


def extremes(y: np.ndarray, buckets: int = 1500) -> np.ndarray:
    """Which samples to draw so that the line looks like the whole series: of each bucket the smallest and the largest.

    Args:
        y: shape (samples,); samples that are no finite number are passed over where others are at hand.
        buckets: stretches of equal length into which the series is cut.

    Returns:
        Indices in rising order, at most ``2 * buckets + 2``, the first and last sample among them; all of a short
        series.
    """
    samples = len(y)
    width = -(-samples // buckets)
    if width <= 2:
        return np.arange(samples)
    table = np.pad(y, (0, -samples % width), constant_values=np.nan).reshape(-1, width)
    finite = np.isfinite(table)
    starts = np.arange(len(table)) * width
    lowest = starts + np.where(finite, table, np.inf).argmin(axis=1)
    highest = starts + np.where(finite, table, -np.inf).argmax(axis=1)
    return np.unique(np.concatenate([[0, samples - 1], lowest, highest]))
