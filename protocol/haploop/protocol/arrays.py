"""Selection and rounding, written once for floats of one run and for arrays over a batch's members (last axis)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np


def where(condition: Any, yes: Any, no: Any) -> Any:
    """Returns ``yes`` where ``condition`` holds, else ``no``; element by element for arrays."""
    if condition is True:
        return yes
    if condition is False:
        return no
    return condition.__array_namespace__().where(condition, yes, no)


def rint(value: Any) -> Any:
    """Returns the nearest whole number, halves to even, as ``numpy.rint``, but never -0.0; a float must be finite."""
    if value.__class__ is float:
        return float(round(value))
    return value.__array_namespace__().rint(value) + 0.0


def floor(value: Any) -> Any:
    """Returns the greatest whole number not above ``value``, but never -0.0; a float must be finite."""
    if isinstance(value, float):
        return float(math.floor(value))
    return value.__array_namespace__().floor(value) + 0.0


def root(value: Any) -> Any:
    """Returns the square root, correctly rounded for floats and arrays alike; a float must not be negative."""
    return math.sqrt(value) if isinstance(value, float) else value.__array_namespace__().sqrt(value)


def nearest_multiple(value: Any, unit: Any) -> Any:
    """Returns ``unit * rint(value / unit)``, or ``value`` if the quotient is not finite (infinite, NaN)."""
    counts = value / unit
    if counts.__class__ is float:
        return unit * float(round(counts)) if counts - counts == 0.0 else value
    xp = counts.__array_namespace__()
    return xp.where(xp.isfinite(counts), unit * (xp.rint(counts) + 0.0), value)


def clipped(value: Any, most: Any) -> Any:
    """Returns ``value`` limited to +-``most``; NaN stays NaN."""
    if value.__class__ is float and most.__class__ is float:
        return most if value > most else -most if value < -most else value
    return where(value > most, most, where(value < -most, -most, value))


def each(function: Callable[..., Any], *numbers: Any) -> Any:
    """Returns ``function`` of these numbers; where some are arrays, evaluates it for every member separately.

    Thus the coefficients of a batch come from the same code as those of one run, to the same bits. For members with
    equal numbers the function is called once.

    Args:
        function: from floats to a float, an array, or a tuple of these.
        numbers: floats, or arrays of shape (members,).

    Returns:
        The result, or the results stacked along a new last axis.
    """
    if not any(getattr(number, "shape", ()) for number in numbers):
        return function(*numbers)
    import numpy as np

    rows = list(zip(*(column.tolist() for column in np.broadcast_arrays(*numbers)), strict=True))
    known = {row: function(*row) for row in dict.fromkeys(rows)}
    found = [known[row] for row in rows]
    if isinstance(found[0], tuple):
        return tuple(np.stack(parts, axis=-1) for parts in zip(*found, strict=True))
    return np.stack(found, axis=-1)


def rows_of(values: Sequence[Any], members: int) -> np.ndarray:
    """Returns one row for each value (a number for all members, or an array over them); shape (rows, members)."""
    import numpy as np

    rows = np.empty((len(values), members))
    for row, value in zip(rows, values, strict=True):
        row[:] = value
    return rows


def first_row(column: np.ndarray) -> Any:
    """Returns the first entry of a column: a float, or an array over the members."""
    row = column[0]
    return row if row.shape else float(row)
