"""Makes the stored references of the accuracy scenes again.

PYTHONPATH=tests python -m oracles.continuous.make [SCENE...]

The sampled loop with the program's own controller, sensors and line, closed around a continuous plant in 50 decimal
digits. Needs mpmath, which is in the dev extra.
"""

from __future__ import annotations

import json
import sys
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from mpmath import mp, mpf

from haploop.controller.controller import Controller
from haploop.controller.dissipation import registry
from haploop.launch.scene.file import load
from haploop.logger.verdict.window import CONTROLLER_COLUMNS, Window
from haploop.plant.choose import make_position_sensor
from haploop.plant.line.delay import make_line
from haploop.plant.motion.hand_force import constant_forces
from haploop.plant.sensing.accelerometer import make_accelerometer
from haploop.protocol.scene.hand_force import Constant, Ramp, Trace
from haploop.protocol.scene.scene import Hand, Scene, accelerometer_is_used
from haploop.protocol.ticks import Timebase
from haploop.tools.cost.reference import (
    REFERENCES,
    Reference,
    compares_pointwise,
    difference_m,
    exactly,
    growths,
    problem_hash,
    statistics,
)
from haploop.tools.render.progress import Stage, bars
from haploop.tools.trajectory import trajectory
from oracles.continuous.plant import ContinuousPlant, IntegratedPlant

SCENES = Path(__file__).parents[3] / "launch/scenes/accuracy"
DIGITS, FEWER_DIGITS = 50, 30
_CHECK_RATE = 100_000

Done = Callable[[], object]


class Continuous(Protocol):
    """A plant without steps; loads are tau + k_h rest in N, exact."""

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


def make_timebase(scene: Scene) -> Timebase:
    """Makes the time base of a scene whose only steps are ticks.

    Raises ValueError where something falls between ticks, depends on the plant rate, or is not linear.
    """
    wrong = ["jitter"] * (scene.jitter is not None) + ["event"] * bool(scene.event) + [*constant_forces(scene)]
    if scene.friction and scene.friction.stribeck_velocity is not None:
        wrong.append("friction.stribeck_velocity")
    if wrong:
        raise ValueError(f"A continuous plant cannot follow {', '.join(wrong)}; take it out of the scene.")
    rate = scene.clock.control_rate
    time = Timebase.from_clock(replace(scene.clock, plant_rate=rate), scene.duration)
    times = [Fraction(repr(_late_s(scene))), *(t for t, _ in _points(scene))]
    if any((t * rate).denominator > 1 for t in times):
        raise ValueError(f"Delays and corners of hand.force must fall on whole ticks at {rate} Hz.")
    return time


def _late_s(scene: Scene) -> float:
    return scene.accelerometer.delay if scene.accelerometer else 0.0


def _points(scene: Scene) -> list[tuple[Fraction, Fraction]]:
    """Returns the corners (s, N) of tau, linear between and constant outside; times are the scene's decimal numbers."""
    match (scene.hand or Hand()).force or Constant(value=0.0):
        case Constant(value=value):
            times, forces = (0.0,), (value,)
        case Ramp(value=value, rise_time=rise_time):
            times, forces = (0.0, rise_time), (0.0, value)
        case Trace(time=times, force=forces):
            pass
        case force:
            raise ValueError(
                f"hand.force must be constant, ramp or trace, whose lines are straight, but is {force.kind}."
            )
    return [(Fraction(repr(t)), Fraction(f)) for t, f in zip(times, forces, strict=True)]


def loads(scene: Scene, time: Timebase) -> Iterator[Fraction]:
    """Yields tau + k_h rest at every tick and at the end, N, as exact fractions."""
    hand, points = scene.hand or Hand(), _points(scene)
    rest = Fraction(hand.stiffness) * Fraction(hand.rest)
    for tick in range(time.ticks + 1):
        t = min(max(Fraction(tick, time.control_rate), points[0][0]), points[-1][0])
        here = ((t0, f0, t1, f1) for (t0, f0), (t1, f1) in pairwise(points) if t <= t1)
        t0, f0, t1, f1 = next(here, (t, points[-1][1], t, points[-1][1]))
        yield rest + (f0 + (f1 - f0) * (t - t0) / (t1 - t0) if t1 > t0 else f0)


def close_loop(scene: Scene, plant: Continuous, exact: Callable[[Fraction], Any], tick_done: Done) -> Closed:
    """Runs a scene with a continuous plant; ``exact`` turns a load into the plant's kind of number."""
    time = make_timebase(scene)
    position, meter, line = make_position_sensor(scene, time), make_accelerometer(scene, time), make_line(scene, time)
    controller = Controller(scene, time, registry())
    late = round(_late_s(scene) * time.control_rate)
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


def _verdict(scene: Scene, time: Timebase, controller: Controller, x: list[float], forces: list[float]) -> str:
    [block] = controller.recorder.take()
    rows = {name: np.frombuffer(column) for name, column in block["columns"].items()}
    rows["wall_position"] = np.full(time.ticks, block["wall"]["position"])
    window = Window(time, scene.encoder.resolution if scene.encoder else 0.0)
    columns = {name: rows[name][:, None] for name in CONTROLLER_COLUMNS}
    window.add(np.array(x)[:, None], np.array(forces)[:, None], columns)
    (measures,) = window.measures()
    return measures.verdict(None).word


def in_digits(scene: Scene, digits: int, tick_done: Done = lambda: None) -> Closed:
    """Runs the loop around the continuous plant in ``digits`` decimal digits."""
    with mp.workdps(digits):
        plant = ContinuousPlant(scene, mpf(1) / scene.clock.control_rate)
        return close_loop(scene, plant, lambda load: mpf(load.numerator) / load.denominator, tick_done)


def integrated(scene: Scene, tick_done: Done = lambda: None) -> Closed:
    """Runs the loop around the plant integrated by DOP853, in floats."""
    with mp.workdps(FEWER_DIGITS):
        plant = IntegratedPlant(scene, 1.0 / scene.clock.control_rate)
    return close_loop(scene, plant, float, tick_done)


def reference(name: str, scene: Scene, stage: Stage) -> tuple[Reference, dict[str, dict[str, float]]]:
    """Makes the reference of a resolved scene, showing progress by ticks; returns it and its checks."""
    ticks = make_timebase(scene).ticks
    truth = in_digits(scene, DIGITS, stage(f"{name}: {DIGITS} digits", ticks))
    fewer = in_digits(scene, FEWER_DIGITS, stage(f"{name}: {FEWER_DIGITS} digits", ticks))
    numerical = integrated(scene, stage(f"{name}: DOP853", ticks))
    exact = trajectory(exactly(scene, _CHECK_RATE))
    checks = {
        f"{FEWER_DIGITS}_digits": difference_m(truth.x_m, fewer.x_m),
        "dop853": difference_m(truth.x_m, numerical.x_m),
        f"exact_{_CHECK_RATE // 1000}_kHz": difference_m(truth.x_m, exact.x_m),
    }
    fewer_m, numerical_m, exact_m = checks.values()
    growth = growths(scene, scene.clock.plant_rate)
    x_m, v_m_s = np.array(truth.x_m), np.array(truth.v_m_s)
    made = Reference(
        scene=name,
        how=f"The continuous plant in {DIGITS} digits under the program's own controller; in {FEWER_DIGITS} digits it "
        f"is at most {fewer_m:.1e} m, by DOP853 at 1e-13 {numerical_m:.1e} m away, and the exact method at "
        f"{_CHECK_RATE // 1000} kHz {exact_m:.1e} m. A start moved by up to 0.1 um gets at most "
        f"{max(growth.values()):.3g} times as far away.",
        verdict=truth.verdict,
        pointwise=compares_pointwise(growth),
        # Not from the exact method, which this reference is to judge.
        error_m=max(fewer_m, numerical_m),
        statistics=statistics(scene, x_m, v_m_s),
        x_m=x_m,
        v_m_s=v_m_s,
    )
    return made, {"checks_m": checks, "growth": growth}


def main(names: list[str]) -> None:
    """Makes some references, or all, with progress."""
    REFERENCES.mkdir(exist_ok=True)
    with bars() as stage:
        for path in [SCENES / f"{name}.toml" for name in names] or sorted(SCENES.glob("*.toml")):
            scene = load(path)
            made, checked = reference(path.stem, scene, stage)
            arrays = {"x_m": made.x_m.tolist(), "v_m_s": made.v_m_s.tolist()}
            kept = {"problem": problem_hash(scene)} | checked | asdict(made) | arrays
            target = REFERENCES / f"{path.stem}.json"
            target.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
            print(f"{target}\n  {made.how}")


if __name__ == "__main__":
    main(sys.argv[1:])
