"""Lines on which a function of two numbers is zero: contours of a grid, every point of them exact."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from haploop.tools.sweep.map.axis import Ruler

# Points along an axis between which a line is looked for; windows narrower than that are not seen. Few where every
# point takes a map of its own.
POINTS, FEW_POINTS = 41, 21
# Bends of a line, in rad where every cell of the grid is a square, that ask for another point.
_SHARP = 0.15
Level = Callable[[float, float], float]


def fine_values(ruler: Ruler, points: int, own: bool) -> np.ndarray:
    """Returns values along an axis between its cells' outermost edges, even in its scale.

    Args:
        ruler: the axis.
        points: how many, about.
        own: only the axis' own values are allowed.
    """
    values = ruler.axis.values
    if own or len(values) < 2:
        return values
    if ruler.scale == "even":
        between = max(2, points // len(values))
        places = np.arange((len(values) - 1) * between + 1) / between
        found = np.interp(places, np.arange(len(values)), values)
    elif ruler.scale == "log":
        found = np.geomspace(ruler.edges[0], ruler.edges[-1], points) * ruler.factor
    else:
        found = np.linspace(ruler.edges[0], ruler.edges[-1], points) * ruler.factor
        found = found[found >= 0.0] if values[0] >= 0.0 else found
    return np.unique([values[0], *found, values[-1]])


def zero_lines(level: Level, xs: np.ndarray, ys: np.ndarray, exact: tuple[bool, bool]) -> list[np.ndarray]:
    """Returns the lines on which ``level`` is zero.

    A contour of the grid meets its edges where interpolation has it; along the edge, Brent's method puts the point
    where the level itself is zero, so that only the way from one edge to the next is a guess.

    Args:
        level: of x and y; NaN where there is none.
        xs, ys: the grid, ascending.
        exact: whether a point may be moved along x, along y; not where values between the grid's are not allowed.

    Returns:
        Points of each line, shape (n, 2).
    """
    if min(len(xs), len(ys)) < 2:
        return _along_one(level, xs, ys, exact)
    from contourpy import contour_generator

    heights = np.array([[level(x, y) for x in xs] for y in ys])
    x_places, y_places = np.arange(len(xs), dtype=float), np.arange(len(ys), dtype=float)
    contour = contour_generator(x_places, y_places, np.ma.masked_invalid(heights))
    lines = []
    for line in contour.lines(0.0):
        points = [_exact(level, place, xs, ys, exact) for place in _at_scenes(np.asarray(line), exact)]
        lines.append(_rounded(level, np.array(points), xs, ys, exact))
    return lines


def _at_scenes(places: np.ndarray, exact: tuple[bool, bool]) -> np.ndarray:
    """Returns the places that lie on the values of an axis that has no others between; all where none do."""
    whole = np.abs(places - np.rint(places)) == 0.0
    kept = places[(whole | np.array(exact)).all(axis=1)]
    return kept if len(kept) else places


def _along_one(level: Level, xs: np.ndarray, ys: np.ndarray, exact: tuple[bool, bool]) -> list[np.ndarray]:
    """Finds the zeros along the one axis that has several values, each a line of one point."""
    heights = np.array([[level(x, y) for x in xs] for y in ys]).ravel()
    found = []
    for first in np.flatnonzero(heights[:-1] * heights[1:] < 0.0):
        share = heights[first] / (heights[first] - heights[first + 1])
        place = np.array([first + share, 0.0] if len(xs) > 1 else [0.0, first + share])
        found.append(_exact(level, place, xs, ys, exact)[None, :])
    return found


def _exact(level: Level, place: np.ndarray, xs: np.ndarray, ys: np.ndarray, exact: tuple[bool, bool]) -> np.ndarray:
    """Returns the zero on the edge of the grid on which ``place`` (counted in grid lines) lies."""
    grid = (xs, ys)
    whole = np.rint(place)
    off = np.abs(place - whole)
    moving = int(off[1] > off[0])
    point = np.array([np.interp(place[i], np.arange(len(grid[i])), grid[i]) for i in (0, 1)])
    if not exact[moving] or off[moving] == 0.0:
        return point
    point[1 - moving] = grid[1 - moving][int(whole[1 - moving])]
    low, high = (grid[moving][int(end(place[moving]))] for end in (np.floor, np.ceil))
    return _root(level, point, moving, float(low), float(high))


def _rounded(level: Level, line: np.ndarray, xs: np.ndarray, ys: np.ndarray, exact: tuple[bool, bool]) -> np.ndarray:
    """Returns the line with a point more on either side of each sharp bend, looked for across the line."""
    cells = np.column_stack([np.interp(line[:, i], grid, np.arange(len(grid))) for i, grid in enumerate((xs, ys))])
    steps = np.diff(cells, axis=0)
    angles = np.abs(np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))))
    sharp = np.flatnonzero(angles > _SHARP)
    points = [line[:1]]
    for number, step in enumerate(steps):
        across = int(abs(step[0]) >= abs(step[1]))
        if exact[across] and (number in sharp or number - 1 in sharp):
            points.append(_across(level, line[number : number + 2], across, (xs, ys)[across])[None, :])
        points.append(line[number + 1 : number + 2])
    return np.concatenate(points)


def _across(level: Level, ends: np.ndarray, moving: int, grid: np.ndarray) -> np.ndarray:
    """Returns the zero half way between two points, moved along one axis within a cell of the grid."""
    point = ends.mean(axis=0)
    place = int(np.clip(np.searchsorted(grid, point[moving]), 1, len(grid) - 1))
    reach = grid[place] - grid[place - 1]
    low, high = max(point[moving] - reach, grid[0]), min(point[moving] + reach, grid[-1])
    return _root(level, point, moving, float(low), float(high))


def _root(level: Level, point: np.ndarray, moving: int, low: float, high: float) -> np.ndarray:
    """Moves a point along one axis to the zero by Brent's method; leaves it where the ends do not enclose one."""
    from scipy.optimize import brentq

    def along(value: float) -> float:
        return level(value, float(point[1])) if moving == 0 else level(float(point[0]), value)

    root: Any = point[moving]
    if along(low) * along(high) < 0.0:
        with suppress(ValueError):  # the level is not a number somewhere in between
            root = brentq(along, low, high, xtol=1e-11 * max(abs(low), abs(high)))
    return np.array([root, point[1]] if moving == 0 else [point[0], root])
