"""Where a virtual spring leaks: its book with the causes switched on one after the other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from haploop.protocol.arrays import each

CAUSES = ("ideal", "sampled_and_held", "quantised")


def held_J(x: Any, wall: tuple[Any, Any], into_wall: float) -> Any:
    """What an ideal spring of position and stiffness ``wall`` holds with the device at x: k p^2 / 2."""
    return each(_held_J, x, *wall, into_wall)


def _held_J(x: float, position: float, stiffness: float, into_wall: float) -> float:
    return stiffness * max(0.0, (x - position) * into_wall) ** 2 / 2.0


def ideal_and_undelayed(
    x: np.ndarray, dx: np.ndarray, force: np.ndarray, wall: tuple[Any, Any], into_wall: float, steps_per_tick: int
) -> Iterator[np.ndarray]:
    """Energy taken out of the device on the same trajectory by springs that are better than the true one, J per step.

    ideal             twice that of a real spring, always there: change of k p^2, p the true penetration
    sampled_and_held  its force taken from the true position at the tick and held: what sampling and hold add
    quantised         the force the controller computed, without delay: what quantisation and noise add
    The true book adds the delay. Leak = true - ideal; its parts are the differences from line to line.

    Args:
        x: true position at the steps and at the end, shape (ticks * n + 1,), m.
        dx: displacement over each step, shape (ticks * n,), m.
        force: what the controller computed for the wall at these ticks, shape (ticks,), N.
        wall: position in m and stiffness in N/m.
        into_wall: +1 or -1.
        steps_per_tick: n.

    Yields:
        Shape (ticks * n,) each, ordered as ``CAUSES``; all arrays may have a last axis for many loops.
    """
    n, (position, stiffness) = steps_per_tick, wall
    xp = x.__array_namespace__()
    depth = xp.maximum(0.0, (x - position) * into_wall)
    before, after = depth[:-1], depth[1:]
    held = into_wall * stiffness * depth[:-1:n]
    yield stiffness * (after - before) * (after + before)
    yield xp.repeat(held, n, axis=0) * dx
    yield xp.repeat(-force, n, axis=0) * dx
