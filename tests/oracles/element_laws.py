"""Taps of a free mass on a sampled spring under stabilizers, written from their sources with penetrations and pushes.

The mass comes from above onto a wall below 0; ``p`` is its penetration, ``push`` a force out of the wall. A law is a
generator: it is sent (depth, whether inside, push of the spring) and yields the push that is added.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from itertools import pairwise
from typing import NamedTuple

Law = Generator[float, tuple[float, bool, float], None]


class Tap(NamedTuple):
    """Depths at the ticks, m; pushes of spring and law at each, N; the speed at the end, m/s, out of the wall."""

    depth: list[float]
    spring: list[float]
    added: list[float]
    speed: float

    def taken_J(self) -> tuple[float, float]:
        """The energies that spring and law took: each push times the displacement to the next tick, summed."""
        ways = [after - before for before, after in pairwise(self.depth[:-1])]
        rows = (self.spring, self.added)
        return tuple(math.fsum(push * way for push, way in zip(row, ways, strict=False)) for row in rows)  # type: ignore


def tap(
    law: Law | None, *, mass: float, damping: float, stiffness: float, height: float, speed: float,
    period: float, ticks: int, late: int, always: bool = False,
) -> Tap:  # fmt: skip
    """Lets the mass fall from ``height`` at ``speed`` and answers each tick ``late`` ticks later."""
    p, inward = -height, speed
    depths, springs, added = [p], [], []
    if law:
        next(law)
    for tick in range(ticks):
        inside = p > 0.0
        springs.append(stiffness * p if inside else 0.0)
        wanted = law.send((p, inside, springs[-1])) if law else 0.0
        added.append(wanted if inside or always else 0.0)
        push = springs[tick - late] + added[tick - late] if tick >= late else 0.0
        p, inward = fallen(p, inward, push, mass, damping, period)
        depths.append(p)
    return Tap(depths, springs, added, -inward)


def fallen(p: float, inward: float, push: float, mass: float, damping: float, period: float) -> tuple[float, float]:
    """Depth and speed a period later under a held push."""
    if not damping:
        rate = -push / mass
        return p + inward * period + rate * period**2 / 2, inward + rate * period
    end, kept = -push / damping, math.exp(-damping * period / mass)
    return p + end * period + (inward - end) * mass / damping * (1 - kept), end + (inward - end) * kept


def observed(most: float, *, reference: float = 0.0, reset: bool = False, inertia: float = 0.0, period: float) -> Law:
    """Passivity observer and controller: each push times the way after it; the damper takes what is missing."""
    energy, push, before, speeds = 0.0, 0.0, None, (0.0, 0.0)
    p, inside, spring = yield 0.0
    while True:
        way = 0.0 if before is None else p - before
        energy += push * way
        if reset and not inside:
            energy = 0.0
        rate = way / period
        held = reference * p * p / 2 if inside else 0.0
        missing = max(0.0, held - energy)
        alpha = min(most, missing / (rate**2 * period)) if missing and rate else 0.0
        change = (rate - speeds[0]) / period if before is not None else 0.0
        left = missing - alpha * rate**2 * period
        drawn = 0.0
        if left > 1e-30 and rate and rate * speeds[1] >= 0.0 and change:
            drawn = min(inertia, left / (period * abs(change * rate))) * change
        speeds, before = (rate, change), p
        answer = alpha * rate + drawn
        push = spring + (answer if inside else 0.0)
        p, inside, spring = yield answer


def resisting(damping: float = 0.0, mass: float = 0.0, *, one_way: bool = False, period: float) -> Law:
    """Damping and inertia; one way: damping only on the way in, inertia while speed and last change agree in sign."""
    p, _, _ = yield 0.0
    before, rate_before, change_before = p, 0.0, 0.0
    while True:
        rate = (p - before) / period
        change = (rate - rate_before) / period
        push = 0.0 if one_way and rate <= 0.0 else damping * rate
        push += 0.0 if one_way and rate * change_before < 0.0 else mass * change
        before, rate_before, change_before = p, rate, change
        p, _, _ = yield push


def bounded(damping: float, *, period: float) -> Law:
    """Force bounding: the push may be no larger than the damping of the device can dissipate."""
    energy, push, before = 0.0, 0.0, None
    p, inside, spring = yield 0.0
    while True:
        way = 0.0 if before is None else p - before
        energy += damping * way * way / period + push * way
        most = math.sqrt(4 * damping * max(energy, 0.0) / period)
        limited = max(-most, min(most, spring))
        before, push = p, limited if inside else 0.0
        p, inside, spring = yield limited - spring


def leading(time: float, *, period: float) -> Law:
    """Input-to-state stable: the push leads by its own rate."""
    before = 0.0
    spring = (yield 0.0)[2]
    while True:
        lead = time * (spring - before) / period
        before = spring
        spring = (yield lead)[2]


def coupled(stiffness: float, damping: float, mass: float, wall: float, *, ticks: int = 1, period: float) -> Law:
    """A virtual tool that steps every ``ticks`` ticks, implicitly, by bisection; the wall pushes only the tool."""
    p, _, spring = yield 0.0
    y, inward, before, at_step, step, tick = p, 0.0, p, p, ticks * period, 0

    def excess(u: float) -> float:
        place = y + step * u
        pulled = stiffness * (p - place) + damping * ((p - at_step) / step - u)
        return mass * (u - inward) / step - pulled + wall * max(0.0, place)

    while True:
        if tick % ticks == 0:
            u = root_of(excess)
            y, inward, at_step = y + step * u, u, p
        push = stiffness * (p - y) + damping * ((p - before) / period - inward)
        before, tick = p, tick + 1
        p, _, spring = yield push - spring


def root_of(rising: Callable[[float], float]) -> float:
    """Zero of a rising, piecewise linear function, by bisection."""
    low, high = -10.0, 10.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if rising(middle) < 0.0 else (low, middle)
    return (low + high) / 2
