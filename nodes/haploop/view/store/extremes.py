"""Fewer points for a long line, without losing a peak."""

from __future__ import annotations

import numpy as np


def extremes(values: np.ndarray, group: int) -> np.ndarray:
    """The least and the greatest of every ``group`` consecutive values, in the order in which they came.

    A line through the result covers the same band as one through all values, and the extremes of such extremes are
    those of the values themselves: lines may be thinned out again and again. NaN counts for nothing.

    Args:
        values: shape (columns, count), ``count`` a multiple of ``group``.

    Returns:
        Shape (columns, 2 * count / group); NaN where a group holds nothing else.
    """
    columns, count = values.shape
    groups = values.reshape(columns, count // group, group)
    least, greatest = np.fmin.reduce(groups, axis=2), np.fmax.reduce(groups, axis=2)
    rises = (groups == least[..., None]).argmax(axis=2) <= (groups == greatest[..., None]).argmax(axis=2)
    pairs = np.empty((columns, count // group, 2))
    pairs[..., 0] = np.where(rises, least, greatest)
    pairs[..., 1] = np.where(rises, greatest, least)
    return pairs.reshape(columns, 2 * (count // group))
