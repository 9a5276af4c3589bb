"""Samples less their straight trend."""

from __future__ import annotations

from functools import lru_cache

import numpy as np


def about_trend(samples: np.ndarray) -> np.ndarray:
    """Returns samples at equal steps, shape (..., count), less their least-squares straight line.

    With steps t around 0 the line is mean(x) + t (t·x) / (t·t).
    """
    t, square = _centred(samples.shape[-1])
    offset = samples - samples.mean(axis=-1, keepdims=True)
    offset -= t * (np.vecdot(offset, t) / square)[..., None]
    return offset


@lru_cache(maxsize=8)
def _centred(count: int) -> tuple[np.ndarray, float]:
    """Returns ``count`` equal steps centred on 0, and the sum of their squares."""
    t = np.arange(count) - (count - 1) / 2.0
    return t, float(np.vecdot(t, t))
