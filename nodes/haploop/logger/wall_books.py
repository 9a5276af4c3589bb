"""Where a virtual spring leaks: its book with the causes switched on one after the other."""

from __future__ import annotations

import numpy as np

CAUSES = ("ideal", "sampled_and_held", "quantised")


def held_J(x: float, wall: tuple[float, float], into_wall: float) -> float:
    """What an ideal spring of position and stiffness ``wall`` holds with the device at x: k p^2 / 2."""
    position, stiffness = wall
    return stiffness * max(0.0, (x - position) * into_wall) ** 2 / 2.0


def ideal_and_undelayed(
    x: np.ndarray, dx: np.ndarray, rows: dict[str, np.ndarray], into_wall: float, steps_per_tick: int
) -> np.ndarray:
    """Energy taken out of the device on the same trajectory by springs that are better than the true one, J per step.

    ideal             a real spring, always there: change of k p^2 / 2, p the true penetration
    sampled_and_held  its force taken from the true position at the tick and held: what sampling and hold add
    quantised         the force the controller computed, without delay: what quantisation and noise add
    The true book adds the delay. Leak = true - ideal; its parts are the differences from line to line.

    Args:
        x: true position at the steps and at the end, shape (ticks * n + 1,), m.
        dx: displacement over each step, shape (ticks * n,), m.
        rows: controller columns of these ticks (wall, wall_position, wall_stiffness).
        into_wall: +1 or -1.
        steps_per_tick: n.

    Returns:
        Shape (3, ticks * n), ordered as ``CAUSES``.
    """
    n = steps_per_tick
    position, stiffness = np.repeat(rows["wall_position"], n), np.repeat(rows["wall_stiffness"], n)
    before = np.maximum(0.0, (x[:-1] - position) * into_wall)
    after = np.maximum(0.0, (x[1:] - position) * into_wall)
    ideal = stiffness * (after - before) * (after + before) / 2.0
    depth = np.maximum(0.0, (x[:-1:n] - rows["wall_position"]) * into_wall)
    held = np.repeat(-into_wall * rows["wall_stiffness"] * depth, n)
    return np.stack([ideal, -held * dx, -np.repeat(rows["wall"], n) * dx])
