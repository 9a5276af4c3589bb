"""The scenes of a map's panel, and the lines on which a function of its axes is zero, every point of them exact."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeVar

import numpy as np

from haploop.protocol.scene.paths import value_at, with_value
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import DELAY, TimebaseError
from haploop.tools.sweep.map.axis import Axis
from haploop.tools.sweep.map.data import STIFFNESS

# Points along an axis between which a line is looked for; areas narrower than their distance are not seen. Fewer where
# every point takes a one-tick map of its own.
POINTS, FEW_POINTS = 41, 21
Level = Callable[[float, float], float]
T = TypeVar("T")


@dataclass(frozen=True)
class Plane:
    """All scenes of a panel, including those between its cells.

    Attributes:
        axes: x first; with only one axis, y has no effect.
    """

    scene: Scene
    axes: Sequence[Axis]

    def at(self, x: float, y: float) -> Scene:
        """Returns the scene at a place; a whole number stays whole."""
        scene = self.scene
        for axis, value in zip(self.axes, (x, y), strict=False):
            number = type(value_at(scene, axis.key))
            scene = with_value(scene, axis.key, number(value))
        return scene

    def once_for_all_stiffnesses(self, make: Callable[[Scene], T]) -> Callable[[float, float], T]:
        """Makes the function from a place to the result of ``make``; scenes that differ only in stiffness share one."""
        made: dict[tuple[float, ...], T] = {}

        def at(x: float, y: float) -> T:
            key = tuple(v for axis, v in zip(self.axes, (x, y), strict=False) if axis.key != STIFFNESS)
            if key not in made:
                made[key] = make(self.at(x, y))
            return made[key]

        return at

    def stiffness(self, x: float, y: float) -> float:
        """Returns the wall's stiffness at a place, in N/m."""
        here = [v for axis, v in zip(self.axes, (x, y), strict=False) if axis.key == STIFFNESS]
        return here[0] if here else value_at(self.scene, STIFFNESS)

    def own_scenes(self) -> list[Scene]:
        """Returns the scenes at the values of the axes, one axis after the other: all that may differ in kind."""
        ends = [axis.values for axis in self.axes] + [np.zeros(1)]
        along_x = [self.at(x, ends[1][0]) for x in ends[0]]
        return along_x + [self.at(ends[0][-1], y) for y in ends[1]]

    def zero_lines(self, level: Level, whole_ticks: bool = False) -> list[np.ndarray]:
        """Finds where a function of the axes' values is zero; points of each line in SI units, shape (n, axes).

        Args:
            level: the function; NaN where it has no value.
            whole_ticks: whether it is evaluated only at delays of whole control ticks; else of whole plant steps.
        """

        @cache
        def where_it_runs(x: float, y: float) -> float:
            try:
                return level(x, y)
            except TimebaseError:  # the clock's numbers make no scene
                return math.nan

        (xs, x_exact), (ys, y_exact) = self._grid(0), self._grid(1)
        clock = self.scene.clock
        between = self._between(where_it_runs, clock.control_rate if whole_ticks else clock.plant_rate)
        return [line[:, : len(self.axes)] for line in zero_lines(between, xs, ys, (x_exact, y_exact))]

    def _grid(self, which: int) -> tuple[np.ndarray, bool]:
        """Returns values along an axis, and whether values between them make scenes as well."""
        if which >= len(self.axes):
            return np.zeros(1), False
        axis = self.axes[which]
        if axis.names or isinstance(value_at(self.scene, axis.key), int):
            return axis.values, False
        swept = any(other.key == STIFFNESS for other in self.axes)
        return _fine_values(axis, POINTS if swept else FEW_POINTS), True

    def _between(self, level: Level, rate: float) -> Level:
        """Returns the level, interpolated between delays that are whole multiples of 1/rate, where delay is an axis."""
        keys = [axis.key for axis in self.axes]
        if DELAY not in keys:
            return level
        delay = keys.index(DELAY)

        def between(x: float, y: float) -> float:
            at = [x, y]
            steps = round(at[delay] * rate, 6)
            ends = []
            for whole in (math.floor(steps), math.ceil(steps)):
                at[delay] = whole / rate
                ends.append(level(*at))
            return ends[0] + (steps - math.floor(steps)) * (ends[1] - ends[0])

        return between


def _fine_values(axis: Axis, points: int) -> np.ndarray:
    """Returns about ``points`` values along an axis between its cells' outermost edges, even in its scale."""
    values = axis.values
    if len(values) < 2:
        return values
    if axis.scale == "even":
        between = max(2, points // len(values))
        places = np.arange((len(values) - 1) * between + 1) / between
        found = np.interp(places, np.arange(len(values)), values)
    else:
        space = np.geomspace if axis.scale == "log" else np.linspace
        found = space(axis.edges[0], axis.edges[-1], points) * axis.factor_and_unit[0]
        found = found[found > 0.0] if values[0] >= 0.0 else found
    return np.unique([values[0], *found, values[-1]])


def zero_lines(level: Level, xs: np.ndarray, ys: np.ndarray, exact: tuple[bool, bool]) -> list[np.ndarray]:
    """Returns the lines on which ``level`` is zero.

    A contour meets the edges of the grid at interpolated points; along each edge, Brent's method moves the point to
    where the level itself is zero, so that only the course from one edge to the next is a guess.

    Args:
        level: function of x and y, whose grid is ascending; NaN where it has no value.
        exact: whether a point may be moved along x, and along y; not where values between those of the grid are not
            allowed.

    Returns:
        Points of each line, shape (n, 2).
    """
    heights = np.array([[level(x, y) for x in xs] for y in ys])
    grid = xs, ys
    if min(heights.shape) < 2:
        return _along_one(level, heights.ravel(), grid, exact)
    from contourpy import contour_generator

    x_places, y_places = np.arange(len(xs), dtype=float), np.arange(len(ys), dtype=float)
    contour = contour_generator(x_places, y_places, np.ma.masked_invalid(heights))
    lines = []
    for line in contour.lines(0.0):
        places = _at_scenes(np.asarray(line), exact)
        lines.append(np.array([_exact(level, place, grid, exact) for place in places]))
    return lines


Grid = tuple[np.ndarray, np.ndarray]


def _at_scenes(places: np.ndarray, exact: tuple[bool, bool]) -> np.ndarray:
    """Returns the places that lie on values of any axis without values in between; all places where none do."""
    whole = np.abs(places - np.rint(places)) == 0.0
    kept = places[(whole | np.array(exact)).all(axis=1)]
    return kept if len(kept) else places


def _along_one(level: Level, heights: np.ndarray, grid: Grid, exact: tuple[bool, bool]) -> list[np.ndarray]:
    """Finds the zeros along the one axis that has several values, each a line of one point."""
    found = []
    for first in np.flatnonzero(heights[:-1] * heights[1:] < 0.0):
        share = heights[first] / (heights[first] - heights[first + 1])
        place = np.array([first + share, 0.0] if len(grid[0]) > 1 else [0.0, first + share])
        found.append(_exact(level, place, grid, exact)[None, :])
    return found


def _exact(level: Level, place: np.ndarray, grid: Grid, exact: tuple[bool, bool]) -> np.ndarray:
    """Returns the zero on the edge of the grid on which ``place`` (counted in grid lines) lies, by Brent's method.

    Where the ends of the edge do not enclose a zero, returns the place itself.
    """
    from scipy.optimize import brentq

    whole = np.rint(place)
    off = np.abs(place - whole)
    moving = int(off[1] > off[0])
    point: Any = np.array([np.interp(place[i], np.arange(len(grid[i])), grid[i]) for i in (0, 1)])
    if not exact[moving] or off[moving] == 0.0:
        return point
    point[1 - moving] = grid[1 - moving][int(whole[1 - moving])]
    low, high = (float(grid[moving][int(end(place[moving]))]) for end in (np.floor, np.ceil))

    def along(value: float) -> float:
        return level(value, float(point[1])) if moving == 0 else level(float(point[0]), value)

    if along(low) * along(high) < 0.0:
        with suppress(ValueError):  # the level is not a number somewhere in between
            point[moving] = brentq(along, low, high, xtol=1e-11 * max(abs(low), abs(high)))
    return point
