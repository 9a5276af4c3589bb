"""Chooses the motion and the position sensor that a scene asks for."""

from __future__ import annotations

from typing import Any

from haploop.plant.integrators.registry import find_integrator
from haploop.plant.motion.one_mass import OneMassMotion
from haploop.plant.sensing.encoder import PositionSensor
from haploop.protocol.scene.scene import Scene, accelerometer_is_used, hand_is_unmodelled
from haploop.protocol.ticks import Timebase


def needs_chain(scene: Scene) -> bool:
    """Tells whether a scene is more than one mass under held forces that change at the same steps of every interval.

    All integrators except the exact transition move a chain of bodies, even if it has only one.
    """
    sensor = scene.accelerometer if accelerometer_is_used(scene) else None
    return bool(
        scene.clock.integrator != "exact"
        or scene.friction
        or scene.transmission
        or scene.jitter
        or scene.loss
        or (scene.hand and scene.hand.grip)
        or (scene.actuator and scene.actuator.bandwidth is not None)
        or (sensor and (sensor.bandwidth is not None or sensor.delay > 0.0))
    )


def make_motion(scene: Scene, time: Timebase, members: int | None = None) -> Any:
    """Makes the simplest motion that can move a scene, or a batch of ``members`` scenes; imports no other.

    The integrator of a batch is exact. Raises ValueError for an unmodelled hand.
    """
    if hand_is_unmodelled(scene):
        raise ValueError("An unmodelled hand cannot be moved: only a foreign plant can run such a scene.")
    if not needs_chain(scene):
        return OneMassMotion(scene, time, members)
    if members is None:
        return find_integrator(scene.clock.integrator).make_motion(scene, time)
    if scene.friction:
        from haploop.plant.friction.batch import BatchFrictionMotion

        return BatchFrictionMotion(scene, time, members)
    from haploop.plant.chain.motion import ChainMotion

    return ChainMotion(scene, time, members)


def make_position_sensor(scene: Scene, time: Timebase) -> PositionSensor:
    if scene.noise is None:
        return PositionSensor(scene.encoder)
    from haploop.plant.sensing.noise import NoisyPositionSensor

    return NoisyPositionSensor(scene.encoder, scene.noise, scene.seed, time.period_s)
