"""The scenes of a map's panel: one resolved scene, and the keys that the panel's axes set in it."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from haploop.protocol.scene.paths import value_at
from haploop.protocol.ticks import TimebaseError
from haploop.tools.sweep.map.axis import Ruler
from haploop.tools.sweep.map.contour import FEW_POINTS, POINTS, Level, fine_values, zero_lines
from haploop.tools.sweep.map.data import STIFFNESS

_DELAY = "clock.round_trip_delay"


@dataclass(frozen=True)
class Plane:
    """All scenes of a panel, those between its cells included.

    Attributes:
        scene: of one of its cells.
        rulers: of its axes, x first; one of them where there is one axis, whose y is of no account.
    """

    scene: dict[str, Any]
    rulers: Sequence[Ruler]

    def value_at(self, x: float, y: float) -> dict[str, Any]:
        """Returns the resolved scene at a place."""
        scene = copy.deepcopy(self.scene)
        for ruler, value in zip(self.rulers, (x, y), strict=False):
            set_key(scene, ruler.axis.key, value)
        return scene

    def but_for_stiffness(self, x: float, y: float) -> tuple[float, ...]:
        """Returns the values at a place without the wall's stiffness."""
        return tuple(v for r, v in zip(self.rulers, (x, y), strict=False) if r.axis.key != STIFFNESS)

    def stiffness(self, x: float, y: float) -> float:
        """Returns the wall's stiffness at a place, in N/m."""
        here = [v for r, v in zip(self.rulers, (x, y), strict=False) if r.axis.key == STIFFNESS]
        return here[0] if here else self.scene["wall"]["stiffness"]

    def own_scenes(self) -> list[dict[str, Any]]:
        """Returns the scenes along the axes' own values, one axis after the other: all that may differ in kind."""
        ends = [ruler.axis.values for ruler in self.rulers] + [np.zeros(1)]
        along_x = [self.at(x, ends[1][0]) for x in ends[0]]
        return along_x + [self.at(ends[0][-1], y) for y in ends[1]]

    def zero_lines(self, level: Level, whole_ticks: bool = False) -> list[np.ndarray]:
        """Finds where a function of the axes' values is zero; points of each line in SI, shape (n, axes).

        Args:
            level: NaN where there is none.
            whole_ticks: whether it is only asked for delays of whole control ticks; else of whole plant steps.
        """
        (xs, x_exact), (ys, y_exact) = self._grid(0), self._grid(1)
        rate = self.scene["clock"]["control_rate" if whole_ticks else "plant_rate"]
        lines = zero_lines(self._between(cache(_where_it_runs(level)), rate), xs, ys, (x_exact, y_exact))
        return [line[:, : len(self.rulers)] for line in lines]

    def _grid(self, which: int) -> tuple[np.ndarray, bool]:
        """Returns values along an axis, and whether those between them are scenes as well."""
        if which >= len(self.rulers):
            return np.zeros(1), False
        ruler = self.rulers[which]
        key = ruler.axis.key
        own = bool(ruler.axis.names) or isinstance(value_at(self.scene, key), int)
        swept = any(other.axis.key == STIFFNESS for other in self.rulers)
        return fine_values(ruler, POINTS if swept else FEW_POINTS, own), not own

    def _between(self, level: Level, rate: float) -> Level:
        """Returns the level, interpolated between delays that are whole multiples of 1/rate, where delay is an axis."""
        keys = [ruler.axis.key for ruler in self.rulers]
        if _DELAY not in keys:
            return level
        delay = keys.index(_DELAY)

        def between(x: float, y: float) -> float:
            at = [x, y]
            steps = round(at[delay] * rate, 6)
            ends = []
            for whole in (math.floor(steps), math.ceil(steps)):
                at[delay] = whole / rate
                ends.append(level(*at))
            return ends[0] + (steps - math.floor(steps)) * (ends[1] - ends[0])

        return between


def _where_it_runs(level: Level) -> Level:
    """Returns the level, NaN where the clock's numbers make no scene."""

    def known(x: float, y: float) -> float:
        try:
            return level(x, y)
        except TimebaseError:
            return math.nan

    return known


def set_key(scene: dict[str, Any], key: str, value: float) -> None:
    """Sets a number of a resolved scene by its dotted key; a whole number where the scene has one."""
    *path, last = key.split(".")
    node: Any = scene
    for part in path:
        node = node[int(part)] if isinstance(node, list) else node[part]
    place: Any = int(last) if isinstance(node, list) else last
    node[place] = int(value) if isinstance(node[place], int) else float(value)
