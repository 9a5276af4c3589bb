"""The sampled loop closed around a continuous plant, with the program's own controller, sensors and line."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from haploop.controller.controller import Controller
from haploop.controller.dissipation import registry
from haploop.logger.verdict.window import CONTROLLER_COLUMNS, Window
from haploop.plant.choose import make_position_sensor
from haploop.plant.line.delay import make_line
from haploop.plant.motion.hand_force import constant_forces
from haploop.plant.sensing.accelerometer import make_accelerometer
from haploop.plant.sensing.encoder import accelerometer_is_used
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase


class Continuous(Protocol):
    """A plant that knows nothing of steps; loads are tau + k_h rest in N, exact."""

    @property
    def x(self) -> float: ...
    @property
    def v(self) -> float: ...
    def sensed(self) -> float: ...
    def begin(self, load: Any, /) -> None: ...
    def advance(self, command: float, load: Any, next_load: Any, /) -> None: ...


@dataclass(frozen=True)
class Closed:
    """The outcome of a loop: x in m and v in m/s of body 0 at every tick and at the end, and the verdict."""

    x_m: list[float]
    v_m_s: list[float]
    verdict: str


def make_timebase(scene: dict[str, Any]) -> Timebase:
    """Makes the time base of a scene whose only steps are ticks.

    Raises:
        ValueError: something in it falls between ticks, depends on the plant rate, or is not linear.
    """
    wrong = [table for table in ("jitter", "event", *constant_forces(scene)) if table in scene]
    if "stribeck_velocity" in scene.get("friction", {}):
        wrong.append("friction.stribeck_velocity")
    if wrong:
        raise ValueError(f"A continuous plant cannot follow {', '.join(wrong)}; take it out of the scene.")
    rate = scene["clock"]["control_rate"]
    time = Timebase.from_clock({**scene["clock"], "plant_rate": rate}, scene["duration"])
    late = Fraction(repr(scene.get("accelerometer", {}).get("delay", 0.0))) * rate
    corners = [t * rate for t, _ in _points(scene)]
    if any(t.denominator > 1 for t in (late, *corners)):
        raise ValueError(f"Delays and corners of hand.force must fall on whole ticks at {rate} Hz.")
    return time


def _points(scene: dict[str, Any]) -> list[tuple[Fraction, Fraction]]:
    """Returns corners (s, N) of tau, straight between them, held outside; times are the scene's decimal numbers."""
    force = scene.get("hand", {}).get("force", {"kind": "constant", "value": 0.0})
    match force["kind"]:
        case "constant":
            times, forces = [0.0], [force["value"]]
        case "ramp":
            times, forces = [0.0, force["rise_time"]], [0.0, force["value"]]
        case "trace":
            times, forces = force["time"], force["force"]
        case kind:
            raise ValueError(f"hand.force must be constant, ramp or trace, whose lines are straight, but is {kind}.")
    return [(Fraction(repr(t)), Fraction(f)) for t, f in zip(times, forces, strict=True)]


def loads(scene: dict[str, Any], time: Timebase) -> Iterator[Fraction]:
    """Yields tau + k_h rest at every tick and at the end, N, as exact fractions."""
    hand, points = scene.get("hand", {}), _points(scene)
    rest = Fraction(hand.get("stiffness", 0.0)) * Fraction(hand.get("rest", 0.0))
    for tick in range(time.ticks + 1):
        yield rest + _straight(points, Fraction(tick, time.control_rate))


def _straight(points: list[tuple[Fraction, Fraction]], t: Fraction) -> Fraction:
    if t <= points[0][0]:
        return points[0][1]
    for (t0, f0), (t1, f1) in pairwise(points):
        if t <= t1:
            return f0 + (f1 - f0) * (t - t0) / (t1 - t0)
    return points[-1][1]


def close_loop(
    scene: dict[str, Any], plant: Continuous, exact: Callable[[Fraction], Any], tick_done: Callable[[], None]
) -> Closed:
    """Runs a scene with a continuous plant; ``exact`` turns a load into the plant's kind of number."""
    time = make_timebase(scene)
    position, meter, line = make_position_sensor(scene, time), make_accelerometer(scene, time), make_line(scene, time)
    controller = Controller(Scene.from_dict(scene), time, registry())
    late = round(scene.get("accelerometer", {}).get("delay", 0.0) * time.control_rate)
    sensed = deque([0.0] * (late + 1), maxlen=late + 1)
    load = [exact(f) for f in loads(scene, time)]
    plant.begin(load[0])
    x, v, forces = [plant.x], [plant.v], []
    for tick in range(time.ticks):
        sample: tuple[float, ...] = (position.reading(plant.x),)
        if accelerometer_is_used(scene):
            sensed.append(plant.sensed())
            sample += (meter.reading(sensed[0]) if meter else sensed[0],)
        line.receive(controller.answer([sample]))
        [(_, force, _)] = line.holds(tick)
        plant.advance(force, load[tick], load[tick + 1])
        x.append(plant.x)
        v.append(plant.v)
        forces.append(force)
        tick_done()
    return Closed(x, v, _verdict(scene, time, controller, x, forces))


def _verdict(scene: dict[str, Any], time: Timebase, controller: Controller, x: list[float], forces: list[float]) -> str:
    """Returns the verdict by the program's own rule."""
    [block] = controller.recorder.take()
    rows = {name: np.frombuffer(column) for name, column in block["columns"].items()}
    rows["wall_position"] = np.full(time.ticks, block["wall"]["position"])
    window = Window(time, scene.get("encoder", {}).get("resolution", 0.0))
    columns = {name: rows[name][:, None] for name in CONTROLLER_COLUMNS}
    window.add(np.array(x)[:, None], np.array(forces)[:, None], columns)
    (measures,) = window.measures()
    return measures.verdict(None).word
