"""Numbers of a scene that several rules need: the hand's largest force, the distance to the wall."""

from __future__ import annotations

import math

from haploop.protocol.scene.hand_force import Constant, Ramp, Sine, Step, Trace
from haploop.protocol.scene.scene import Scene, Wall

_SAMPLES = 10_001


def _extremes_N(scene: Scene) -> tuple[float, float]:
    """Returns the least and the largest lasting force of the hand; of a kind that is not haploop's own, of samples."""
    force = scene.hand.force if scene.hand else None
    if force is None:
        return 0.0, 0.0
    if isinstance(force, Trace):
        return min(force.force), max(force.force)
    if isinstance(force, Sine):
        return force.offset - abs(force.amplitude), force.offset + abs(force.amplitude)
    if isinstance(force, Constant | Ramp | Step):
        return force.value, force.value
    import numpy as np

    samples = force.force_at(np.linspace(0.0, scene.duration, _SAMPLES))
    return float(samples.min()), float(samples.max())


def most_force_N(scene: Scene) -> float:
    """Returns the largest force of the hand, in either direction."""
    return max(map(abs, _extremes_N(scene)))


def inward(wall: Wall) -> float:
    return -1.0 if wall.occupies == "below" else 1.0


def inward_force_N(scene: Scene) -> float:
    """Returns the largest force of the hand towards the wall; 0 where it has none."""
    if scene.wall is None:
        return 0.0
    return max(0.0, *(inward(scene.wall) * force_N for force_N in _extremes_N(scene)))


def start_depth_m(scene: Scene) -> float:
    """Returns how deep in the wall the device begins; negative outside, minus infinity without a wall."""
    wall: Wall | None = scene.wall
    if wall is None:
        return -math.inf
    return (scene.device.position - wall.position) * inward(wall)


def wall_moves(scene: Scene) -> bool:
    return any("wall.position" in (event.set or {}) for event in scene.event)
