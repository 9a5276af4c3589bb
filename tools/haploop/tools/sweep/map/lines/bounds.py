"""The analytic bounds over a map: the stiffness that each allows, where it speaks of the scene."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from haploop.tools.linear.bounds import Bound, bounds_of
from haploop.tools.sweep.map.data import STIFFNESS
from haploop.tools.sweep.map.lines.limit import Boundary
from haploop.tools.sweep.map.plane import Plane, value_at

_MEANING = {"passivity": "passive, whatever passive hand holds it", "stability": "stable with the scene's own hand"}
_MOST_LOG = 50.0


def bound_boundaries(plane: Plane) -> list[Boundary]:
    """Every known bound that applies at some place of a panel, as the line on which the wall is as stiff as it allows.

    A bound that applies but allows no wall of the panel, or every one, has no lines.
    """
    if value_at(plane.scene, STIFFNESS) is None:
        return []
    known: dict[tuple[float, ...], dict[str, Bound]] = {}

    def at(x: float, y: float) -> dict[str, Bound]:
        key = plane.but_for_stiffness(x, y)
        if key not in known:
            known[key] = {bound.name: bound for bound in bounds_of(plane.at(x, y))}
        return known[key]

    first = {bound.name: bound for bound in bounds_of(plane.scene)}
    lines = {name: plane.zero_lines(_level(plane, at, name), whole_ticks=True) for name in first}
    applied = {name for bounds in known.values() for name, bound in bounds.items() if bound.applies}
    return [Boundary(name, _MEANING[bound.kind], lines[name]) for name, bound in first.items() if name in applied]


def _level(plane: Plane, at: Callable[[float, float], dict[str, Bound]], name: str) -> Callable[[float, float], float]:
    """How far the wall is beyond what a bound allows, as a logarithm; NaN where the bound does not apply."""

    def level(x: float, y: float) -> float:
        allowed = at(x, y)[name].stiffness_N_m
        if allowed is None:
            return math.nan
        stiffness = plane.stiffness(x, y)
        if not allowed or not stiffness:
            return _MOST_LOG if stiffness > allowed else -_MOST_LOG
        return float(np.clip(math.log(stiffness / allowed), -_MOST_LOG, _MOST_LOG))

    return level
