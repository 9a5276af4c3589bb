"""Taps of a free mass on walls that are not springs, written from their laws with penetrations and pushes.

The mass comes from above onto a wall below 0; ``p`` is its penetration, ``push`` a force out of the wall. A law is a
function of p and of the rate of p, which the controller knows as a backward difference.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

from oracles.element_laws import fallen

Law = Callable[[float, float], float]


class Tap(NamedTuple):
    """Depths at the ticks, m; pushes at each, N; the speed at the end, m/s, out of the wall."""

    depth: list[float]
    push: list[float]
    speed: float

    def taken_J(self) -> float:
        """The energy that the wall took: each push times the displacement to the next tick, summed."""
        ways = [after - before for before, after in pairwise(self.depth[:-1])]
        return math.fsum(push * way for push, way in zip(self.push, ways, strict=False))


def tap(law: Law, *, mass: float, height: float, speed: float, period: float, ticks: int, late: int) -> Tap:
    """Lets the mass fall from ``height`` at ``speed`` and answers each tick ``late`` ticks later."""
    p, inward, before = -height, speed, -height
    depths, pushes = [p], []
    for tick in range(ticks):
        pushes.append(law(p, (p - before) / period) if p > 0.0 else 0.0)
        before = p
        p, inward = fallen(p, inward, pushes[tick - late] if tick >= late else 0.0, mass, 0.0, period)
        depths.append(p)
    return Tap(depths, pushes, -inward)


def damped(stiffness: float, damping: float) -> Law:
    """A damped spring that never pulls."""
    return lambda p, rate: max(0.0, stiffness * p + damping * rate)


def crossley(stiffness: float, factor: float, exponent: float, depth: float) -> Law:
    """The law of Hunt and Crossley, with its stiffness at rest given at one depth."""
    return lambda p, rate: max(0.0, stiffness * depth ** (1 - exponent) * p**exponent * (1 + factor * rate))


def ridged(stiffness: float, force: float, spacing: float) -> Law:
    """A spring with ridges of parabolas: in one half of each up from 0 and back, in the other half down and back."""

    def push(p: float, _rate: float) -> float:
        u = math.fmod(p, spacing) / spacing
        return stiffness * p + force * (16 * u * (0.5 - u) if u < 0.5 else -16 * (u - 0.5) * (1 - u))

    return push


def leaving_speed(speed: float, factor: float) -> float:
    """Speed at which a free mass leaves a wall of Hunt and Crossley in continuous time, by bisection."""

    def side(v: float) -> float:
        return v / factor - math.log1p(factor * v) / factor**2

    low, high = 0.0, min(speed, 1.0 / factor)
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if side(-middle) < side(speed) else (low, middle)
    return (low + high) / 2
