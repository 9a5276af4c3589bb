"""Which keys of ``[velocity]`` and ``[acceleration]`` an estimator needs, and which it does not take."""

from __future__ import annotations

from typing import Any

from pydantic_core import PydanticCustomError

from haploop.launch.scene.layers import Layers
from haploop.launch.scene.tables.models import keys_of, number_of
from haploop.protocol.scene.effects import Noise
from haploop.protocol.scene.estimators import Acceleration, Velocity
from haploop.protocol.scene.scene import Scene
from haploop.protocol.scene.table import Table

# The keys an estimator must have, and those it may have beside what all take.
_NEEDS = {"difference": (), "window": ("ticks",), "foaw": ("ticks",), "kalman": ("jerk_density",)}
_TAKES = {"foaw": ("bound", "fit"), "kalman": ("measurement_noise", "accelerometer", "accelerometer_noise")}
_ALL = {estimator: (*needs, *_TAKES.get(estimator, ())) for estimator, needs in _NEEDS.items()}


def check_estimators(layers: Layers) -> None:
    """Add keys an estimator lacks or does not take to the mistakes; values wrong in themselves are passed over."""
    velocity, acceleration = _table(layers, "velocity"), _table(layers, "acceleration")
    _keys(layers, "velocity", Velocity, velocity)
    _keys(layers, "acceleration", Acceleration, acceleration)
    _velocity(layers, velocity)
    _acceleration(layers, acceleration, velocity)


def check_filter(layers: Layers, scene: Scene) -> None:
    """Add a jerk density for which no filter can be computed to the mistakes of a scene that is else in order."""
    if scene.velocity is None or scene.velocity.jerk_density is None:
        return
    from haploop.controller.estimators.kalman import jerk_density_limits, position_noise_m

    noise_m, rate = position_noise_m(scene.as_dict()), scene.clock.control_rate
    least, most = jerk_density_limits(noise_m, 1.0 / rate)
    if noise_m and not least <= scene.velocity.jerk_density <= most:
        expected = (
            f"With a measurement noise of {noise_m:.3g} m at {rate} Hz it must be from {least:.2g} to {most:.2g}."
        )
        layers.complain(("velocity", "jerk_density"), expected)


def _keys(layers: Layers, name: str, model: type[Table], table: dict[str, Any]) -> None:
    estimator = table.get("estimator", "difference")
    if not isinstance(estimator, str) or estimator not in _ALL:
        return
    for key in _NEEDS[estimator]:
        if key in keys_of(model) and key not in table:
            _missing(layers, name, model, key, f"The {estimator} estimator needs")
    for key in table:
        takers = [other for other, keys in _ALL.items() if key in keys and key in keys_of(model)]
        if takers and estimator not in takers:
            layers.complain((name, key), f"It goes with the estimator {' or '.join(takers)} alone.")


def _velocity(layers: Layers, velocity: dict[str, Any]) -> None:
    """What the defaults of bound and noise are taken from has to be there."""
    encoder = "encoder" in layers.data
    match velocity.get("estimator"):
        case "foaw" if "bound" not in velocity and not encoder:
            why = "Without an [encoder] to take it from it must be"
            _missing(layers, "velocity", Velocity, "bound", why)
        case "kalman" if "measurement_noise" not in velocity and not encoder and not _is_noisy(layers):
            why = "Without an [encoder] or [noise] to take it from it must be"
            _missing(layers, "velocity", Velocity, "measurement_noise", why)
    if "accelerometer_noise" in velocity and velocity.get("accelerometer") is not True:
        layers.complain(("velocity", "accelerometer_noise"), "It goes with accelerometer = true alone.")


def _is_noisy(layers: Layers) -> bool:
    """Whether there is noise on the position; a deviation that is wrong is a mistake reported elsewhere."""
    try:
        return number_of(Noise, "deviation").read(_table(layers, "noise").get("deviation", 0.0)) > 0.0
    except PydanticCustomError:
        return True


def _acceleration(layers: Layers, acceleration: dict[str, Any], velocity: dict[str, Any]) -> None:
    source, estimator = acceleration.get("source", "encoder"), acceleration.get("estimator")
    if source != "encoder" and estimator is not None:
        layers.complain(("acceleration", "estimator"), 'It goes with source = "encoder" alone.')
    if source == "kalman" and velocity.get("estimator") != "kalman":
        expected = 'The filter that gives it is the velocity\'s, so velocity.estimator must be "kalman" too.'
        layers.complain(("acceleration", "source"), expected)
    if estimator == "foaw" and "bound" not in acceleration:
        _missing(layers, "acceleration", Acceleration, "bound", "The foaw estimator needs")


def _missing(layers: Layers, name: str, model: type[Table], key: str, why: str) -> None:
    layers.complain((name, key), f"{why} {number_of(model, key).form}.", "is missing")


def _table(layers: Layers, name: str) -> dict[str, Any]:
    table = layers.data.get(name)
    return table if isinstance(table, dict) else {}
