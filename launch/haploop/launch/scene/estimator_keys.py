"""The keys of ``[velocity]`` and ``[acceleration]``, compared with those that their estimators declare."""

from __future__ import annotations

from pydantic_core import PydanticCustomError

from haploop.controller.estimators.choose import estimators_for
from haploop.launch.scene.models import number_of
from haploop.launch.scene.reading.layers import Layers
from haploop.protocol.scene.effects import Noise
from haploop.protocol.scene.estimators import Acceleration, Velocity
from haploop.protocol.scene.scene import Scene
from haploop.protocol.scene.table import Table, Tables

_TABLES: dict[str, type[Table]] = {"velocity": Velocity, "acceleration": Acceleration}


def check_estimators(layers: Layers) -> None:
    """Adds to the mistakes the keys that an estimator lacks or does not take; skips values wrong in themselves."""
    velocity, acceleration = _table(layers, "velocity"), _table(layers, "acceleration")
    _keys(layers, "velocity", velocity)
    _keys(layers, "acceleration", acceleration)
    if "accelerometer_noise" in velocity and velocity.get("accelerometer") is not True:
        layers.complain(("velocity", "accelerometer_noise"), "It is used only with accelerometer = true.")
    _acceleration(layers, acceleration, velocity)


def check_filter(layers: Layers, scene: Scene) -> None:
    """Adds to the mistakes of an otherwise valid scene a jerk density for which no filter can be computed."""
    if scene.velocity is None or scene.velocity.jerk_density is None:
        return
    from haploop.controller.estimators.kalman import jerk_density_limits, position_noise_m

    noise_m, rate = position_noise_m(scene), scene.clock.control_rate
    least, most = jerk_density_limits(noise_m, 1.0 / rate)
    if noise_m and not least <= scene.velocity.jerk_density <= most:
        expected = (
            f"With a measurement noise of {noise_m:.3g} m at {rate} Hz it must be from {least:.2g} to {most:.2g}."
        )
        layers.complain(("velocity", "jerk_density"), expected)


def _keys(layers: Layers, name: str, table: Tables) -> None:
    """Compares the keys of a table with those that its possible estimators declare."""
    kinds, estimator = estimators_for(name), table.get("estimator", "difference")
    if not isinstance(estimator, str) or (kind := kinds.get(estimator)) is None:
        return
    for key in kind.needs:
        if key not in table:
            _missing(layers, name, key, f"The {estimator} estimator needs")
    for key in table:
        takers = [other for other, one in kinds.items() if key in (*one.needs, *one.takes)]
        if takers and estimator not in takers:
            layers.complain((name, key), f"It is used only with the estimator {' or '.join(takers)}.")
    for key, sources in kind.needs_without.items():
        if key in table:
            continue
        if name == "acceleration":
            _missing(layers, name, key, f"The {estimator} estimator needs")
        elif not any(_gives(layers, source) for source in sources):
            tables = " or ".join(f"[{source}]" for source in sources)
            _missing(layers, name, key, f"Without an {tables} to take it from, it must be")


def _gives(layers: Layers, source: str) -> bool:
    """Tells whether a default can be taken from a table; from that of noise only if there is some noise.

    A wrong deviation is a mistake that is reported elsewhere.
    """
    if source != "noise":
        return source in layers.data
    try:
        return number_of(Noise, "deviation").read(_table(layers, "noise").get("deviation", 0.0)) > 0.0
    except PydanticCustomError:
        return True


def _acceleration(layers: Layers, acceleration: Tables, velocity: Tables) -> None:
    source, estimator = acceleration.get("source", "encoder"), acceleration.get("estimator")
    if source != "encoder" and estimator is not None:
        layers.complain(("acceleration", "estimator"), 'It is used only with source = "encoder".')
    if source == "kalman" and velocity.get("estimator") != "kalman":
        expected = 'It comes from the filter of the velocity, so velocity.estimator must be "kalman" too.'
        layers.complain(("acceleration", "source"), expected)


def _missing(layers: Layers, name: str, key: str, why: str) -> None:
    layers.complain((name, key), f"{why} {number_of(_TABLES[name], key).form}.", "is missing")


def _table(layers: Layers, name: str) -> Tables:
    table = layers.data.get(name)
    return table if isinstance(table, dict) else {}
