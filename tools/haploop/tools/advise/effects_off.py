"""What a loop can be freed of, each with how: the causes that a contact may buzz for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from haploop.plant.sensing.encoder import accelerometer_is_used

Scene = dict[str, Any]
SAMPLING = "sampling and hold"


@dataclass(frozen=True)
class Cause:
    """One thing that may make a loop buzz.

    Attributes:
        name: as in "because of the delay".
        without: what takes its place, in a few words.
        off: the resolved scene without it; None where the scene has none of it.
        leak: its part of the wall's leak, as the summary names it; None where the books cannot tell.
        is_element: whether it is a dissipation element, which is there to help.
    """

    name: str
    without: str
    off: Callable[[Scene], Scene | None]
    leak: str | None = None
    is_element: bool = False


def causes(scene: Scene) -> list[Cause]:
    """All that a resolved scene has of them."""
    tables = scene.get("dissipation", [])
    kinds = [table["kind"] for table in tables]
    elements = [
        Cause(_element(i, table["kind"], kinds.count(table["kind"])), "left out", _without_element(i), is_element=True)
        for i, table in enumerate(tables)
    ]
    return [cause for cause in (*_CAUSES, *elements) if cause.off(scene) is not None]


def _element(index: int, kind: str, count: int) -> str:
    """Its kind, with its number where there are several of it."""
    return kind.replace("-", " ") + (f" (element {index})" if count > 1 else "")


def freed(scene: Scene, some: Iterable[Cause]) -> Scene:
    """The scene without some causes; elements go last, so that their numbers hold."""
    for cause in sorted(some, key=lambda cause: cause.is_element):
        scene = cause.off(scene) or scene
    return scene


def _sampling(scene: Scene) -> Scene | None:
    """A tick at every plant step. Windows of so many ticks keep their time."""
    clock = scene["clock"]
    times = clock["plant_rate"] // clock["control_rate"]
    if times == 1:
        return None
    scene = {**scene, "clock": {**clock, "control_rate": clock["plant_rate"]}}
    for name in ("velocity", "acceleration"):
        if "ticks" in scene.get(name, {}):
            scene[name] = {**scene[name], "ticks": scene[name]["ticks"] * times}
    return scene


def _delay(scene: Scene) -> Scene | None:
    if not scene["clock"]["round_trip_delay"]:
        return None
    return {**scene, "clock": {**scene["clock"], "round_trip_delay": 0.0}}


def _quantisation(scene: Scene) -> Scene | None:
    """Without counts, of the encoder and of the accelerometer."""
    if "encoder" not in scene:
        return None
    # A Kalman filter has to be told what it may trust; it goes on trusting as before.
    velocity = scene.get("velocity", {})
    if velocity.get("estimator") == "kalman" and "measurement_noise" not in velocity:
        velocity = {**velocity, "measurement_noise": scene["encoder"]["resolution"] / 12**0.5}
    if velocity.get("estimator") == "foaw" and "bound" not in velocity:
        velocity = {**velocity, "bound": scene["encoder"]["resolution"]}
    kept = _without(_without(scene, "encoder"), "accelerometer", "resolution")
    return {**kept, "velocity": velocity} if velocity else kept


def _noise(scene: Scene) -> Scene | None:
    noisy = accelerometer_is_used(scene) and scene.get("accelerometer", {}).get("noise_density")
    if "noise" not in scene and not noisy:
        return None
    scene = _without(scene, "noise")
    return {**scene, "accelerometer": {**scene["accelerometer"], "noise_density": 0.0}} if noisy else scene


def _lag(scene: Scene) -> Scene | None:
    """Plain differences of one tick; an accelerometer that is used, ideal.

    Without meaning where no element reads an estimate.
    """
    velocity, acceleration = scene.get("velocity", {}), scene.get("acceleration", {})
    plain = velocity.get("estimator") in (None, "difference") and "cutoff" not in velocity
    plain &= acceleration.get("estimator") in (None, "difference") and "cutoff" not in acceleration
    real = {"bandwidth", "delay"} & {key for key, value in scene.get("accelerometer", {}).items() if value}
    late = accelerometer_is_used(scene) and bool(real)
    if (plain and not late) or not scene.get("dissipation"):
        return None
    source = acceleration.get("source", "encoder")
    scene = _without(_without(_without(scene, "velocity"), "accelerometer", "bandwidth"), "accelerometer", "delay")
    if "accelerometer" in scene:
        scene = {**scene, "accelerometer": {"delay": 0.0, **scene["accelerometer"]}}
    return {**scene, "acceleration": {"source": source if source == "accelerometer" else "encoder"}}


def _mode(scene: Scene) -> Scene | None:
    """Motor and tip as one body."""
    if "transmission" not in scene:
        return None
    cable, device = scene["transmission"], scene["device"]
    rigid = {
        **device,
        "mass": device["mass"] + cable["motor_mass"],
        "damping": device["damping"] + cable["motor_damping"],
    }
    return {**_without(scene, "transmission"), "device": rigid}


def _actuator(scene: Scene) -> Scene | None:
    return _without(scene, "actuator") if "actuator" in scene else None


def _line(scene: Scene) -> Scene | None:
    return _without(_without(scene, "jitter"), "loss") if scene.get("jitter") or scene.get("loss") else None


def _friction(scene: Scene) -> Scene | None:
    return _without(scene, "friction") if scene.get("friction") else None


def _without_element(index: int) -> Callable[[Scene], Scene | None]:
    def off(scene: Scene) -> Scene | None:
        elements = scene.get("dissipation", [])
        if index >= len(elements):
            return None
        left = elements[:index] + elements[index + 1 :]
        return {**scene, "dissipation": left} if left else _without(scene, "dissipation")

    return off


def _without(scene: Scene, name: str, key: str | None = None) -> Scene:
    """The scene without a table, or without a key of it."""
    if name not in scene:
        return scene
    if key is None:
        return {other: table for other, table in scene.items() if other != name}
    return {**scene, name: {other: value for other, value in scene[name].items() if other != key}}


_CAUSES = (
    Cause(SAMPLING, "controlled at every plant step", _sampling, "sampling_and_hold_J"),
    Cause("quantisation", "positions that are not rounded", _quantisation, "quantisation_J"),
    Cause("delay", "no delay", _delay, "delay_J"),
    Cause("estimator lag", "plain differences, ideal accelerometer", _lag),
    Cause("structural mode", "a rigid transmission", _mode),
    Cause("noise", "no noise", _noise),
    Cause("actuator", "no limits of the actuator", _actuator),
    Cause("jitter and loss", "a line without jitter and loss", _line),
    Cause("friction", "no dry friction", _friction),
)
