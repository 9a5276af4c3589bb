"""Idealised loops: a scene without one part of it that may cause a swing, for each such part."""

from __future__ import annotations

import math
from dataclasses import replace

from haploop.launch.plan.effects import all_effects
from haploop.protocol.scene.paths import value_at, with_value, with_values, without
from haploop.protocol.scene.scene import Scene

DELAY = "round-trip delay"
HOLD = "sampling and hold"
# Parts by name: keys that are 0 without them.
OF_TABLES = {
    "low-pass of the estimates": ("velocity.cutoff", "acceleration.cutoff"),
    "lag of the accelerometer": ("accelerometer.bandwidth", "accelerometer.delay"),
    "wall damping": ("wall.damping", "wall.damping_factor"),
    "ridges of the wall": ("wall.ridge_force",),
}
# Of these keys, those that are left out instead: 0 Hz lets nothing pass.
_RATES = ("velocity.cutoff", "acceleration.cutoff", "accelerometer.bandwidth")
# The control rate is raised by this.
_FASTER = 10


def idealised(scene: Scene) -> dict[str, Scene]:
    """Returns a resolved scene without each part of the device and its line that is not ideal, by the part's name.

    The parts are the round-trip delay and what effects free a scene of (``Effect.frees``): integration error,
    structural mode, actuator limits, friction, noise, quantisation, jitter and loss.
    """
    found = {DELAY: with_value(scene, "clock.round_trip_delay", 0.0)} if scene.clock.round_trip_delay else {}
    for name in dict.fromkeys(name for effect in all_effects() for name in effect.frees):
        changed = scene
        for effect in all_effects():
            if name in effect.frees and effect.is_in(changed):
                changed = effect.frees[name](changed)
        if changed is not scene:
            found[name] = changed
    return found


def uncontrolled(scene: Scene) -> dict[str, Scene]:
    """Returns a resolved scene without each part of its controller but the wall's stiffness, by the part's name.

    The parts are each dissipation element, and the low-pass filters of the estimates, the lag of the accelerometer,
    the damping and the ridges of the wall (``OF_TABLES``).
    """
    elements = scene.dissipation
    found = {
        f"element {place} ({table.name})": replace(scene, dissipation=elements[:place] + elements[place + 1 :])
        for place, table in enumerate(elements)
    }
    for name, keys in OF_TABLES.items():
        if given := [key for key in keys if value_at(scene, key)]:
            rates = [key for key in given if key in _RATES]
            found[name] = with_values(without(scene, *rates), {key: 0.0 for key in given if key not in rates})
    return found


def faster(scene: Scene) -> Scene:
    """Returns a resolved scene at ten times the control rate, and at the least multiple of the plant rate for that."""
    clock = scene.clock
    more = _FASTER // math.gcd(_FASTER, clock.plant_rate // clock.control_rate)
    rates = {"clock.plant_rate": more * clock.plant_rate, "clock.control_rate": _FASTER * clock.control_rate}
    return with_values(scene, rates)
