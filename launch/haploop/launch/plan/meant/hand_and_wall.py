"""Numbers of a scene that several rules ask for: the hand's largest force, the way to the wall."""

from __future__ import annotations

import math

from haploop.protocol.scene.hand_force import Sine, Trace
from haploop.protocol.scene.scene import Scene, Wall


def most_force_N(scene: Scene) -> float:
    """Returns the largest force of the hand, to either side."""
    force = scene.hand.force if scene.hand else None
    if force is None:
        return 0.0
    if isinstance(force, Trace):
        return max(map(abs, force.force))
    return abs(force.amplitude) + abs(force.offset) if isinstance(force, Sine) else abs(force.value)


def inward(wall: Wall) -> float:
    return -1.0 if wall.occupies == "below" else 1.0


def inward_force_N(scene: Scene) -> float:
    """Returns the largest force of the hand towards the wall; 0 where it has none."""
    force = scene.hand.force if scene.hand else None
    if force is None or scene.wall is None:
        return 0.0
    sign = inward(scene.wall)
    if isinstance(force, Trace):
        return max(0.0, *(sign * each for each in force.force))
    at_most_N = abs(force.amplitude) + sign * force.offset if isinstance(force, Sine) else sign * force.value
    return max(0.0, at_most_N)


def start_depth_m(scene: Scene) -> float:
    """Returns how deep in the wall the device begins; negative outside, minus infinity without a wall."""
    wall: Wall | None = scene.wall
    if wall is None:
        return -math.inf
    return (scene.device.position - wall.position) * inward(wall)


def count_m(scene: Scene) -> float:
    return scene.encoder.resolution if scene.encoder else 0.0


def wall_moves(scene: Scene) -> bool:
    return any("wall.position" in (event.set or {}) for event in scene.event)
