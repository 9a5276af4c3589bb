"""The causes a contact may buzz for, each with the scene that is without it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from haploop.launch.plan.effects import all_effects
from haploop.plant.sensing.encoder import accelerometer_is_used
from haploop.protocol.scene.paths import without

Scene = dict[str, Any]
SAMPLING = "sampling and hold"


@dataclass(frozen=True)
class Cause:
    """A cause that may make a loop buzz.

    Attributes:
        name: as in "because of the delay".
        without: words for what takes its place.
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
    """Returns the causes that a resolved scene has."""
    tables = scene.get("dissipation", [])
    kinds = [table["kind"] for table in tables]
    elements = [
        Cause(_element(i, table["kind"], kinds.count(table["kind"])), "left out", _without_element(i), is_element=True)
        for i, table in enumerate(tables)
    ]
    return [cause for cause in (*_CAUSES, *elements) if cause.off(scene) is not None]


def _element(index: int, kind: str, count: int) -> str:
    """Returns the element's kind, with its number where there are several of it."""
    return kind.replace("-", " ") + (f" (element {index})" if count > 1 else "")


def without_causes(scene: Scene, some: Iterable[Cause]) -> Scene:
    """Returns the scene without some causes; elements go last, so that their numbers hold."""
    for cause in sorted(some, key=lambda cause: cause.is_element):
        scene = cause.off(scene) or scene
    return scene


def _sampling(scene: Scene) -> Scene | None:
    """Puts a tick at every plant step; windows of so many ticks keep their time."""
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


def _lag(scene: Scene) -> Scene | None:
    """Puts plain differences of one tick, and an ideal accelerometer where one is used.

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
    scene = without(scene, "velocity", "accelerometer.bandwidth", "accelerometer.delay")
    if "accelerometer" in scene:
        scene = {**scene, "accelerometer": {"delay": 0.0, **scene["accelerometer"]}}
    return {**scene, "acceleration": {"source": source if source == "accelerometer" else "encoder"}}


def _of_effects(cause: str) -> Callable[[Scene], Scene | None]:
    """Returns a function that takes every effect of a cause out of a scene."""

    def off(scene: Scene) -> Scene | None:
        after = scene
        for effect in all_effects():
            if cause in effect.frees and effect.is_in(after):
                after = effect.frees[cause](after)
        return None if after is scene else after

    return off


def _without_element(index: int) -> Callable[[Scene], Scene | None]:
    def off(scene: Scene) -> Scene | None:
        elements = scene.get("dissipation", [])
        if index >= len(elements):
            return None
        left = elements[:index] + elements[index + 1 :]
        return {**scene, "dissipation": left} if left else without(scene, "dissipation")

    return off


_CAUSES = (
    Cause(SAMPLING, "controlled at every plant step", _sampling, "sampling_and_hold_J"),
    Cause("quantisation", "positions that are not rounded", _of_effects("quantisation"), "quantisation_J"),
    Cause("delay", "no delay", _delay, "delay_J"),
    Cause("estimator lag", "plain differences, ideal accelerometer", _lag),
    Cause("structural mode", "a rigid transmission", _of_effects("structural mode")),
    Cause("noise", "no noise", _of_effects("noise")),
    Cause("actuator", "no limits of the actuator", _of_effects("actuator")),
    Cause("jitter and loss", "a line without jitter and loss", _of_effects("jitter and loss")),
    Cause("friction", "no dry friction", _of_effects("friction")),
)
