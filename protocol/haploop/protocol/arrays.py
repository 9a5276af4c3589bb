"""Choice and rounding written once, for a float of one loop or an array over many loops, its last axis."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np


def where(condition: Any, yes: Any, no: Any) -> Any:
    """``yes`` where ``condition`` holds, else ``no``: a plain choice for one loop, element by element for arrays."""
    if condition is True:
        return yes
    if condition is False:
        return no
    return condition.__array_namespace__().where(condition, yes, no)


def rint(value: Any) -> Any:
    """Nearest whole number, halves to even, as ``numpy.rint``, but never -0.0; values of one loop are finite."""
    if value.__class__ is float:
        return float(round(value))
    return value.__array_namespace__().rint(value) + 0.0


def floor(value: Any) -> Any:
    """Greatest whole number not above ``value``, but never -0.0; values of one loop are finite."""
    if isinstance(value, float):
        return float(math.floor(value))
    return value.__array_namespace__().floor(value) + 0.0


def nearest_multiple(value: Any, unit: Any) -> Any:
    """``unit * rint(value / unit)``; a value without a finite count of units (infinite, not a number) stays."""
    counts = value / unit
    if counts.__class__ is float:
        return unit * float(round(counts)) if counts - counts == 0.0 else value
    xp = counts.__array_namespace__()
    return xp.where(xp.isfinite(counts), unit * (xp.rint(counts) + 0.0), value)


def clipped(value: Any, most: Any) -> Any:
    """``value``, but not beyond +-``most``; what is no number stays none."""
    if value.__class__ is float and most.__class__ is float:
        return most if value > most else -most if value < -most else value
    return where(value > most, most, where(value < -most, -most, value))


def each(function: Callable[..., Any], *numbers: Any) -> Any:
    """What ``function`` gives of these numbers; where some are arrays, of those of every loop by themselves.

    Coefficients of many loops come so from the same code as those of one, to the same bits. Where equal numbers recur
    they are asked for once.

    Args:
        function: from floats to a float, an array, or a tuple of these.
        numbers: floats, or arrays of shape (loops,).

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


def rows_of(values: Sequence[Any], loops: int) -> np.ndarray:
    """One number for all loops, or an array over them, in each row; shape (rows, loops)."""
    import numpy as np

    rows = np.empty((len(values), loops))
    for row, value in zip(rows, values, strict=True):
        row[:] = value
    return rows


def first_row(column: np.ndarray) -> Any:
    """The first entry of a column: a float, or an array over many loops."""
    row = column[0]
    return row if row.shape else float(row)


class Shared:
    """Holds what all loops share: no array in it has an axis for them."""

    def __init__(self, held: Any) -> None:
        self.held = held


def of_one(scene: dict[str, Any]) -> dict[str, Any]:
    """The scene of the first loop of a stacked one."""
    one = of_loop(scene, 0)
    del one["loops"]
    return one


def of_loop(value: Any, loop: int) -> Any:
    """The same for one loop: of every array within dicts and lists its number."""
    if isinstance(value, dict):
        return {key: of_loop(entry, loop) for key, entry in value.items()}
    if isinstance(value, list):
        return [of_loop(entry, loop) for entry in value]
    return value[loop].item() if getattr(value, "shape", ()) else value


def of_loops(value: Any, places: np.ndarray) -> Any:
    """The same for some loops: of every array within dicts and lists the numbers at these places."""
    if isinstance(value, dict):
        return {key: of_loops(entry, places) for key, entry in value.items()}
    if isinstance(value, list):
        return [of_loops(entry, places) for entry in value]
    return value[places] if getattr(value, "shape", ()) else value


def by_loop(value: Any, loops: int) -> list[Any]:
    """The same for each of so many loops by itself: of every array within dicts and lists its number."""
    if isinstance(value, dict):
        return [dict(zip(value, row, strict=True)) for row in _rows([*value.values()], loops)]
    if isinstance(value, list):
        return [list(row) for row in _rows(value, loops)]
    return value.tolist() if getattr(value, "shape", ()) else [value] * loops


def _rows(entries: list[Any], loops: int) -> list[tuple[Any, ...]]:
    return list(zip(*(by_loop(entry, loops) for entry in entries), strict=True)) if entries else [()] * loops
