"""The lines over a map that need no run: where the linear loop begins to grow."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from haploop.tools.linear.linearity import left_out, why_not_linear
from haploop.tools.linear.one_tick import NotLinear, OneTickMap
from haploop.tools.sweep.map.plane import Plane

EXACT = "ρ(M) = 1"


@dataclass(frozen=True)
class Boundary:
    """A named line over a map.

    Attributes:
        name: what is written on it.
        words: what it says, and its source.
        lines: points of each piece, values of the axes in SI, shape (n, axes).
    """

    name: str
    words: str
    lines: list[np.ndarray]


def exact_boundary(plane: Plane) -> Boundary:
    """Where rho(M) = 1 for the linear loop at every place; without lines where it grows nowhere or everywhere.

    Raises:
        NotLinear: the loop of some place is no linear map; the message names what makes it none, in a few words.
    """
    scenes = plane.own_scenes()
    if any("wall" not in scene for scene in scenes):
        raise NotLinear("there is no wall")
    if curved := [reason for scene in scenes for reason in why_not_linear(scene)]:
        raise NotLinear(", ".join(dict.fromkeys(curved)))
    loops: dict[tuple[float, ...], OneTickMap] = {}

    def level(x: float, y: float) -> float:
        key = plane.but_for_stiffness(x, y)
        if key not in loops:
            loops[key] = OneTickMap.of(plane.at(x, y))
        return math.log(loops[key].growth(plane.stiffness(x, y)))

    without = f", without {', '.join(left)}" if (left := left_out(plane.scene)) else ""
    return Boundary(EXACT, f"exact, linear loop in contact{without}", plane.zero_lines(level))
