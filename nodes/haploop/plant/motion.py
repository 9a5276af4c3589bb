"""Which motion a scene asks for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from haploop.plant.linear_motion import LinearMotion
from haploop.plant.sensors import accelerometer_is_used
from haploop.protocol.ticks import Timebase

if TYPE_CHECKING:
    from haploop.plant.chain_motion import ChainMotion


def needs_chain(scene: dict[str, Any]) -> bool:
    """Whether there is more than one mass under held forces that change at the same steps of every interval."""
    sensor = scene.get("accelerometer", {}) if accelerometer_is_used(scene) else {}
    return (
        any(table in scene for table in ("friction", "transmission", "jitter", "loss"))
        or "grip" in scene.get("hand", {})
        or "bandwidth" in scene.get("actuator", {})
        or "bandwidth" in sensor
        or sensor.get("delay", 0.0) > 0.0
    )


def motion_of(scene: dict[str, Any], time: Timebase) -> LinearMotion | ChainMotion:
    """The least that moves this scene; nothing else is even imported."""
    if "friction" in scene:
        from haploop.plant.friction_motion import FrictionMotion

        return FrictionMotion(scene, time)
    if needs_chain(scene):
        from haploop.plant.chain_motion import ChainMotion

        return ChainMotion(scene, time)
    return LinearMotion(scene, time)
