"""The rules of effects: checks, notes on valid scenes, and scenes with the ideal in place of an effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

from haploop.launch.plan.effect import Draft
from haploop.plant.integrators.registry import find_integrator
from haploop.protocol.scene.effects import Accelerometer, Actuator, Friction, UniformJitter
from haploop.protocol.scene.paths import value_at, with_value, without
from haploop.protocol.scene.scene import Clock, Hand, Scene
from haploop.protocol.ticks import whole_count

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

# What rounding may add to the growth factor, which is 1 for a body that drifts.
_ROUNDING = 1e-7


def check_friction(draft: Draft) -> None:
    """Refuses a Stribeck law that does not fall, and a plant rate too low for friction.

    A rate is too low if thousands of parts of a step would have to be followed, or if a step of the method does not
    brake.
    """
    friction = draft.table("friction", Friction)
    if friction is None:
        return
    if friction.breakaway is not None and friction.breakaway < friction.kinetic:
        draft.complain(("friction", "breakaway"), f"It must be at least friction.kinetic, {friction.kinetic:g} N.")
    if friction.stribeck_velocity is not None and friction.breakaway is None:
        expected = "It says how breakaway falls towards kinetic, so friction.breakaway must be given too."
        draft.complain(("friction", "stribeck_velocity"), expected)
    scene = draft.scene
    if scene and not find_integrator(scene.clock.integrator).chooses_steps and not _grips_nothing(scene):
        _check_rate(draft, scene)


def _grips_nothing(scene: Scene) -> bool:
    """Tells whether there is a grip without a mass to move, which ``check_grip`` refuses."""
    return scene.hand is not None and scene.hand.grip is not None and not scene.hand.mass


def _check_rate(draft: Draft, scene: Scene) -> None:
    rate, integrator = scene.clock.plant_rate, scene.clock.integrator
    if find_integrator(integrator).method is None:
        from haploop.plant.chain.chain import Chain
        from haploop.plant.friction.substeps import MOST_PARTS, parts_of_a_step

        parts = parts_of_a_step(Chain.from_scene(scene), 1.0 / rate)
        if parts > MOST_PARTS:
            least = rate * parts // MOST_PARTS
            expected = f"With friction on bodies that swing this fast it must be at least {least} Hz."
            draft.complain(("clock", "plant_rate"), expected, f"is {rate} Hz")
        return
    from haploop.plant.integrators.stepwise import friction_brakes

    if not friction_brakes(scene):
        expected = f"With {integrator}, friction does not brake bodies that swing this fast; raise it."
        draft.complain(("clock", "plant_rate"), expected, f"is {rate} Hz")


def check_grip(draft: Draft) -> None:
    """Refuses a grip that holds no mass; the mass is read separately, whatever else is wrong with ``[hand]``."""
    hand = draft.data.get("hand")
    if not isinstance(hand, dict) or "grip" not in hand:
        return
    mass = draft.valid(Hand, {"mass": hand.get("mass", 0.0)})
    if mass and not mass.mass:
        expected = "The grip lies between the device and the hand's mass, so hand.mass must be above 0 kg."
        draft.complain(("hand", "grip"), expected, "holds no mass")


def check_actuator(draft: Draft) -> None:
    if draft.table("actuator", Actuator) == Actuator():
        draft.complain(("actuator",), "It must have at least one of saturation, bandwidth and resolution.", "is empty")


def check_accelerometer(draft: Draft) -> None:
    """Refuses counts larger than the range, and an age of readings that is not a whole number of plant steps."""
    table = draft.table("accelerometer", Accelerometer)
    if table is None:
        return
    if table.range is not None and table.resolution is not None and table.resolution > table.range:
        expected = f"It must be at most accelerometer.range, {table.range:g} m/s^2; otherwise every reading is 0."
        draft.complain(("accelerometer", "resolution"), expected)
    _whole_steps(draft, ("accelerometer", "delay"), "delay of a reading", table.delay)


def check_jitter(draft: Draft) -> None:
    if (jitter := draft.data.get("jitter")) and (uniform := draft.valid(UniformJitter, jitter)):
        _whole_steps(draft, ("jitter", "most"), "longest additional delay", uniform.most)


def _whole_steps(draft: Draft, key: tuple[str, ...], name: str, seconds: float) -> None:
    clock = Clock() if "clock" not in draft.data else draft.table("clock", Clock)
    if clock:
        complaints: list[str] = []
        whole_count(seconds, clock.plant_rate, f"The {name}", "plant steps", complaints)
        for sentence in complaints:
            draft.complain(key, sentence)


def note_accelerometer(scene: Scene) -> list[str]:
    """Says that nothing reads the accelerometer, or that there is no motor to mount it on."""
    from haploop.protocol.scene.scene import accelerometer_is_used

    if not accelerometer_is_used(scene):
        return [
            "[accelerometer] is not simulated, since no estimate reads it; "
            'acceleration.source = "accelerometer" would read it, or velocity.accelerometer with the Kalman filter.'
        ]
    if value_at(scene, "accelerometer.mount") == "motor" and scene.transmission is None:
        return ['accelerometer.mount = "motor" means the only mass, since there is no [transmission].']
    return []


def note_growth(scene: Scene) -> list[str]:
    """Returns a note if a fixed-step method by itself makes the bodies swing ever wider."""
    clock = scene.clock
    if find_integrator(clock.integrator).method is None:
        return []
    from haploop.plant.integrators.stepwise import growth

    factor = growth(scene)
    if factor <= 1.0 + _ROUNDING:
        return []
    return [
        f'clock.integrator = "{clock.integrator}" is unstable by itself at {clock.plant_rate} Hz: it multiplies '
        f"the fastest growing swing of the bodies by {factor:.7g} in every plant step, whatever the controller does."
    ]


def note_order(scene: Scene, kinds: Mapping[str, type[Element]]) -> list[str]:
    """Returns a note on each element that changes what stands before it and is not the last."""
    names = [table.name for table in scene.dissipation]
    return [
        f"dissipation.{place} ({name}) changes the force of the wall and of the elements before it; "
        f"dissipation.{place + 1} ({after}) comes after it and is not limited. Put elements that limit at the end."
        for place, (name, after) in enumerate(pairwise(names))
        if name in kinds and kinds[name].limits
    ]


def unrounded(scene: Scene) -> Scene:
    """Removes the counts of encoder and accelerometer; estimators continue to trust positions as before."""
    velocity = scene.velocity
    if velocity and scene.encoder:
        one_count = scene.encoder.resolution
        if velocity.estimator == "kalman" and velocity.measurement_noise is None:
            velocity = replace(velocity, measurement_noise=one_count / 12**0.5)
        if velocity.estimator == "foaw" and velocity.bound is None:
            velocity = replace(velocity, bound=one_count)
    return replace(without(scene, "encoder", "accelerometer.resolution"), velocity=velocity)


def noiseless(scene: Scene) -> Scene:
    """Removes the noise of an accelerometer; returns the scene itself if there is none."""
    return without(scene, "accelerometer.noise_density") if value_at(scene, "accelerometer.noise_density") else scene


def frictionless(scene: Scene) -> Scene:
    """Removes dry friction; returns the scene itself if its friction is 0."""
    return without(scene, "friction") if has_friction(scene) else scene


def has_friction(scene: Scene) -> bool:
    """Tells whether there is friction, which a scene may have set to 0."""
    return bool(scene.friction and (scene.friction.kinetic or scene.friction.breakaway))


def exactly(scene: Scene) -> Scene:
    return with_value(scene, "clock.integrator", "exact")


def rigid(scene: Scene) -> Scene:
    cable, device = scene.transmission, scene.device
    if cable is None:
        return scene
    mass, damping = device.mass + cable.motor_mass, device.damping + cable.motor_damping
    return replace(scene, transmission=None, device=replace(device, mass=mass, damping=damping))


def left_out(table: str) -> Callable[[Scene], Scene]:
    return lambda scene: without(scene, table)
