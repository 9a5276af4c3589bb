"""Scenes with the ideal in place of an effect: a contact that no longer buzzes tells which effect it buzzed for."""

from __future__ import annotations

from collections.abc import Callable

from haploop.launch.plan.effect import Resolved, without_keys


def unrounded(scene: Resolved) -> Resolved:
    """Takes out the counts of encoder and accelerometer; estimators go on trusting positions as before."""
    one_count, velocity = scene["encoder"]["resolution"], scene.get("velocity", {})
    if velocity.get("estimator") == "kalman" and "measurement_noise" not in velocity:
        velocity = {**velocity, "measurement_noise": one_count / 12**0.5}
    if velocity.get("estimator") == "foaw" and "bound" not in velocity:
        velocity = {**velocity, "bound": one_count}
    kept = without_keys(scene, "encoder", "accelerometer.resolution")
    return {**kept, "velocity": velocity} if velocity else kept


def noiseless(scene: Resolved) -> Resolved:
    """Takes the noise out of an accelerometer; the scene itself where there is none."""
    table = scene["accelerometer"]
    return {**scene, "accelerometer": {**table, "noise_density": 0.0}} if table.get("noise_density") else scene


def rigid(scene: Resolved) -> Resolved:
    """Makes one body of motor and tip."""
    cable, device = scene["transmission"], scene["device"]
    mass, damping = device["mass"] + cable["motor_mass"], device["damping"] + cable["motor_damping"]
    return {**without_keys(scene, "transmission"), "device": {**device, "mass": mass, "damping": damping}}


def left_out(table: str) -> Callable[[Resolved], Resolved]:
    """Makes what leaves a whole table out."""
    return lambda scene: without_keys(scene, table)
