"""Where a virtual spring leaks: its book with the causes switched on one after the other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from haploop.protocol.arrays import each

CAUSES = ("ideal", "sampled_and_held", "quantised")


def held_J(x: Any, wall: tuple[Any, Any], into_wall: float) -> Any:
    """What an ideal spring of position and stiffness ``wall`` holds with the device at x: k p^2 / 2."""
    return each(_held_J, x, *wall, into_wall)


def _held_J(x: float, position: float, stiffness: float, into_wall: float) -> float:
    return stiffness * max(0.0, (x - position) * into_wall) ** 2 / 2.0


def ideal_and_undelayed(x: Any, way: Any, force: Any, wall: tuple[Any, Any], into_wall: float) -> Iterator[Any]:
    """Energy taken out of the device on the same trajectory by springs that are better than the true one, J per tick.

    ideal             that of a real spring, always there: change of k p^2 / 2, p the true penetration
    sampled_and_held  its force taken from the true position at the tick and held: what sampling and hold add
    quantised         the force the controller computed, without delay: what quantisation and noise add
    The true book adds the delay. Leak = true - ideal; its parts are the differences from line to line.

    Args:
        x: true position at the ticks and at the end, shape (ticks + 1,), m.
        way: displacement over each interval, shape (ticks,), m.
        force: what the controller computed for the wall at these ticks, shape (ticks,), N.
        wall: position in m and stiffness in N/m.
        into_wall: +1 or -1.

    Yields:
        Shape (ticks,) each, ordered as ``CAUSES``; all arrays may have a last axis for many loops.
    """
    position, stiffness = wall
    depth = x.__array_namespace__().maximum(0.0, (x - position) * into_wall)
    before, after = depth[:-1], depth[1:]
    yield 0.5 * stiffness * (after - before) * (after + before)
    yield into_wall * stiffness * before * way
    yield -force * way
