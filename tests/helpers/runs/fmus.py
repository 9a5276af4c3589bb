"""Exported controllers stepped through FMPy, and the recordings of a loop to compare them with."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from haploop.controller.controller import Controller
from haploop.launch.scene.events import scene_events
from haploop.plant.plant import Plant
from haploop.protocol.changes import is_change
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.tools.fmu.package import make_fmu
from helpers.scenes.least import KINDS


def compiler() -> str:
    """Returns the available C compiler; skips the test where there is none."""
    return next(filter(shutil.which, ("cc", "gcc", "clang")), None) or pytest.skip("there is no C compiler")


def needs_fmus() -> None:
    """Skips a test where FMUs cannot be made or loaded."""
    pytest.importorskip("fmpy", reason="FMPy is not installed")
    compiler()


@dataclass(frozen=True)
class Recorded:
    """A loop as its plant saw it: samples and true positions at ticks, the force held at every plant step."""

    samples: list[tuple[float, ...]]
    true_m: np.ndarray
    force_N: np.ndarray


def recorded(scene: Scene) -> Recorded:
    """Runs plant and controller of a scene, with its changes at their ticks, and keeps what they exchange."""
    time = Timebase.from_scene(scene)
    plant, controller = Plant(scene, time), Controller(scene, time, KINDS)
    samples: list[tuple[float, ...]] = []

    def exchange(_tick: int, new: list[tuple[float, ...]]) -> list[float]:
        samples.extend(new)
        return controller.answer(new)

    for tick, event in scene_events(scene, time):
        if is_change(event):
            controller.schedule(tick, event)
            plant.schedule(tick, event)
    plant.run_until(time.ticks, exchange)
    _, ticks, columns = plant.take_block()
    x, force = (np.frombuffer(columns[name], "<f8") for name in ("x", "force"))
    steps = ticks * time.steps_per_tick
    return Recorded(samples, x[: steps : time.steps_per_tick], force[:steps])


@dataclass
class Stepped:
    """An initialised FMU, accessed by the names of its variables; ``said`` holds its log messages."""

    slave: Any
    references: dict[str, int]
    said: list[str] = field(default_factory=list)

    def set(self, **values: float) -> None:
        self.set_named(values)

    def set_named(self, values: dict[str, float]) -> None:
        self.slave.setFloat64([self.references[name] for name in values], list(values.values()))

    def force(self) -> float:
        return self.slave.getFloat64([self.references["force"]])[0]


_MADE: dict[tuple[str, str], bytes] = {}


def made(scene: Scene, folder: Path, stem: str = "controller") -> Path:
    """Returns the file of a scene's FMU, which is compiled once."""
    path, key = folder / f"{stem}.fmu", (repr(scene), stem)
    if key not in _MADE:
        _MADE[key] = make_fmu(scene, stem)
    path.write_bytes(_MADE[key])
    return path


@contextmanager
def stepped(path: Path, start_s: float = 0.0) -> Iterator[Stepped]:
    """Loads an FMU for the duration of the block."""
    from fmpy import extract, read_model_description
    from fmpy.fmi3 import FMU3Slave

    description, folder = read_model_description(str(path)), extract(str(path))
    assert description.coSimulation
    identifier = description.coSimulation.modelIdentifier
    token = description.instantiationToken or description.guid
    slave = FMU3Slave(guid=token, unzipDirectory=folder, modelIdentifier=identifier, instanceName="one")
    one = Stepped(slave, {v.name: v.valueReference for v in description.modelVariables})
    slave.instantiate(logMessage=lambda _environment, _status, _category, text: one.said.append(text.decode()))
    slave.enterInitializationMode(startTime=start_s)
    slave.exitInitializationMode()
    try:
        yield one
    finally:
        slave.freeInstance()
        shutil.rmtree(folder)


def forces_of(
    one: Stepped, scene: Scene, positions: Any, readings: Any = None, steps: int = 1, first: int = 0
) -> np.ndarray:
    """Steps an FMU along positions at ticks; returns the force at every communication point, before its step.

    Args:
        steps: plant steps per communication step.
        first: the tick of the first position.
    """
    time = Timebase.from_scene(scene)
    n, forces = time.steps_per_tick, []
    for tick, position in enumerate(positions, first):
        one.set(position=position, **({} if readings is None else {"acceleration": readings[tick - first]}))
        for step in range(tick * n, (tick + 1) * n, steps):
            forces.append(one.force())
            one.slave.doStep(step / time.plant_rate, steps / time.plant_rate)
    return np.array(forces)
