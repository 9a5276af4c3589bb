"""What the controller gets to see of the plant at a tick."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from haploop.protocol.arrays import floor, rint
from haploop.protocol.ticks import Timebase

if TYPE_CHECKING:
    from haploop.plant.sensing.accelerometer import Accelerometer

ROUNDINGS = {"nearest": rint, "floor": floor}


def position_sensor(scene: dict[str, Any], time: Timebase) -> Callable[[Any], Any]:
    """From true to measured position, to be called once a tick: what the encoder makes of x, noise added before."""
    quantise = encoder(scene.get("encoder"))
    if "noise" not in scene:
        return quantise
    from haploop.plant.sensing.noise import position_noise

    noise = position_noise(scene["noise"], scene["seed"], time.period_s)
    return lambda x: quantise(x + noise())


def accelerometer(scene: dict[str, Any], time: Timebase) -> Accelerometer | None:
    """What reads the true acceleration; None where it is read as it is, or not at all."""
    if "accelerometer" not in scene or not accelerometer_is_used(scene):
        return None
    if "loops" in scene:
        from haploop.plant.sensing.accelerometer_batch import AccelerometerArray

        return AccelerometerArray(scene["accelerometer"], scene["seed"], time)
    from haploop.plant.sensing.accelerometer import Accelerometer

    return Accelerometer(scene["accelerometer"], scene["seed"], time)


def encoder(table: dict[str, Any] | None) -> Callable[[Any], Any]:
    """From true to measured position: q rint(x / q) or q floor(x / q); x itself in a scene without ``[encoder]``."""
    if table is None:
        return lambda x: x
    resolution, whole = table["resolution"], ROUNDINGS[table["rounding"]]
    return lambda x: resolution * whole(x / resolution)


def accelerometer_is_used(scene: dict[str, Any]) -> bool:
    """Whether samples carry the plant's acceleration beside the position."""
    by_itself = scene.get("acceleration", {}).get("source") == "accelerometer"
    return by_itself or scene.get("velocity", {}).get("accelerometer", False)
