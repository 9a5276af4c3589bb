"""Choice and rounding written once, for a float of one loop or an array over many loops."""

from __future__ import annotations

import math
from typing import Any


def where(condition: Any, yes: Any, no: Any) -> Any:
    """``yes`` where ``condition`` holds, else ``no``: a plain choice for one loop, element by element for arrays."""
    if condition is True:
        return yes
    if condition is False:
        return no
    return condition.__array_namespace__().where(condition, yes, no)


def rint(value: Any) -> Any:
    """Nearest whole number, halves to even, as ``numpy.rint``; values are finite."""
    if value.__class__ is float:
        return float(round(value))
    return value.__array_namespace__().rint(value)


def floor(value: Any) -> Any:
    """Greatest whole number not above ``value``; values are finite."""
    if isinstance(value, float):
        return float(math.floor(value))
    return value.__array_namespace__().floor(value)


def nearest_multiple(value: Any, unit: Any) -> Any:
    """``unit * rint(value / unit)``; a value without a finite count of units (infinite, not a number) stays."""
    counts = value / unit
    if counts.__class__ is float:
        return unit * float(round(counts)) if counts - counts == 0.0 else value
    xp = counts.__array_namespace__()
    return xp.where(xp.isfinite(counts), unit * xp.rint(counts), value)
