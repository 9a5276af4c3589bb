"""Energy that walls better than the true one would have taken on the same motion; the leak is the difference."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from haploop.protocol.arrays import where
from haploop.protocol.walls.wall import Wall

# The walls whose books split the leak into its causes, as ``ideal_walls`` yields them.
CAUSES = ("ideal", "sampled_and_held", "quantised")
# What the law of a wall in continuous time takes besides what it stores.
DISSIPATED = "dissipated"
# Gauss-Legendre with three nodes on 0 ... 1: exact for polynomials up to the fifth degree.
_NODES = ((0.5 - 0.15**0.5, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + 0.15**0.5, 5.0 / 18.0))
# Steps of Newton's method from the chord to where a cubic crosses the surface.
_NEWTON = 3


def leak_books(wall: type[Wall]) -> tuple[str, ...]:
    """Returns the names of the books that a wall of this class needs."""
    return (*CAUSES, *[DISSIPATED] * wall.dissipates)


def inside(wall: Wall, x: Any) -> Any:
    """Returns how deep x (m) is in a wall, 0 outside."""
    depth = (x - wall.position) * wall.inward
    return where(depth > 0.0, depth, 0.0)


def ideal_walls(wall: Wall, x: Any, v: Any, way: Any, force: Any) -> Iterator[Any]:
    """Yields the energy taken out of the device on the same trajectory by walls better than the true one, J.

    ideal             stored in the wall itself, always there: the change of V(p), p the true penetration
    sampled_and_held  its force at the true position and velocity of the tick, held: what sampling and hold add
    quantised         the force the controller computed, without delay: what quantisation, noise and estimates add
    The true book adds the delay. Leak = true - ideal - dissipated; its parts are the differences between these lines.

    Args:
        x, v: true position and velocity at the ticks and at the end, m and m/s, shape (ticks + 1,).
        way: displacement over each interval, shape (ticks,), m.
        force: that the controller computed for the wall at these ticks, shape (ticks,), N.

    Yields:
        Shape (ticks,) each, ordered as ``CAUSES``; all arrays may have a last axis for a batch.
    """
    depth = x.__array_namespace__().maximum(0.0, (x - wall.position) * wall.inward)
    before, after = depth[:-1], depth[1:]
    yield wall.stored_between(before, after)
    push = wall.inward * wall.push(before, v[:-1] * wall.inward)
    yield where(before > 0.0, push, 0.0) * way
    yield -force * way


def dissipated(wall: Wall, x: Any, v: Any, step_s: float) -> Any:
    """Returns what a wall's law in continuous time takes in each plant step besides what it stores, J, shape (steps,).

    It is the integral of (f(p, p') - V'(p)) p' while p > 0, along the cubic through positions and velocities at both
    ends of a step, from or to the point where the cubic crosses the surface.

    Args:
        x, v: true positions and velocities at all plant steps and at the end, m and m/s, shape (steps + 1,).
    """
    depth, rate = (x - wall.position) * wall.inward, v * wall.inward * step_s
    course = depth[:-1], depth[1:] - depth[:-1], rate[:-1], rate[1:]
    enters = (depth[:-1] <= 0.0) & (depth[1:] > 0.0)
    leaves = (depth[:-1] > 0.0) & (depth[1:] <= 0.0)
    chord = where(enters | leaves, course[1], 1.0)
    surface = where(enters | leaves, -depth[:-1] / chord, 0.0)
    for _ in range(_NEWTON):
        at, slope = _cubic(course, surface)
        moved = surface - at / where(slope == 0.0, 1.0, slope)
        surface = where((moved >= 0.0) & (moved <= 1.0) & (slope != 0.0), moved, surface)
    begin, end = where(enters, surface, 0.0), where(leaves, surface, 1.0)
    taken = 0.0 * chord
    for place, weight in _NODES:
        at, slope = _cubic(course, begin + (end - begin) * place)
        at, speed = where(at > 0.0, at, 0.0), slope / step_s
        taken = taken + weight * (wall.push(at, speed) - wall.held(at)) * slope
    is_in = (depth[:-1] > 0.0) | (depth[1:] > 0.0)
    return where(is_in, (end - begin) * taken, 0.0)


def _cubic(course: tuple[Any, Any, Any, Any], s: Any) -> tuple[Any, Any]:
    """Returns Hermite's cubic at a fraction s of the step, m, and its derivative with respect to s, m."""
    start, rise, rate, end_rate = course
    bend, twist = 3.0 * rise - 2.0 * rate - end_rate, rate + end_rate - 2.0 * rise
    return start + s * (rate + s * (bend + s * twist)), rate + s * (2.0 * bend + s * (3.0 * twist))
