"""Which motion a scene asks for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from haploop.plant.motion.one_mass import LinearMotion
from haploop.plant.sensing.encoder import accelerometer_is_used
from haploop.protocol.ticks import Timebase

if TYPE_CHECKING:
    from haploop.plant.chain.history import ChainHistory


def integrator_of(scene: dict[str, Any]) -> str:
    """What moves the bodies from one plant step to the next."""
    return scene["clock"].get("integrator", "exact")


def needs_chain(scene: dict[str, Any]) -> bool:
    """Whether there is more than one mass under held forces that change at the same steps of every interval.

    All integrators but the exact flow move a chain of bodies, be it of one.
    """
    sensor = scene.get("accelerometer", {}) if accelerometer_is_used(scene) else {}
    return (
        integrator_of(scene) != "exact"
        or any(table in scene for table in ("friction", "transmission", "jitter", "loss"))
        or "grip" in scene.get("hand", {})
        or "bandwidth" in scene.get("actuator", {})
        or "bandwidth" in sensor
        or sensor.get("delay", 0.0) > 0.0
    )


def motion_of(scene: dict[str, Any], time: Timebase) -> LinearMotion | ChainHistory:
    """The least that moves this scene; nothing else is even imported."""
    integrator = integrator_of(scene)
    if integrator != "exact":
        return _integrated(integrator, scene, time)
    if "friction" in scene:
        from haploop.plant.friction.motion import FrictionMotion

        return FrictionMotion(scene, time)
    if needs_chain(scene):
        from haploop.plant.chain.motion import ChainMotion

        return ChainMotion(scene, time)
    return LinearMotion(scene, time)


def _integrated(integrator: str, scene: dict[str, Any], time: Timebase) -> ChainHistory:
    """The motion by another method than the exact flow."""
    if integrator == "dop853":
        if "friction" in scene:
            from haploop.plant.integrators.dop853_friction import Dop853FrictionMotion

            return Dop853FrictionMotion(scene, time)
        from haploop.plant.integrators.dop853 import Dop853Motion

        return Dop853Motion(scene, time)
    if "friction" in scene:
        from haploop.plant.integrators.stepwise_friction import StepwiseFrictionMotion

        return StepwiseFrictionMotion(scene, time)
    from haploop.plant.integrators.stepwise import StepwiseMotion

    return StepwiseMotion(scene, time)
