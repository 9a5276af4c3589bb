"""Many loops side by side, watched as they run: positions and commands at ticks, no books and no logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from haploop.controller.controller import Controller
from haploop.controller.dissipation import Element
from haploop.controller.recorder import BatchRecorder
from haploop.launch.batch.stacking import is_batchable, stacked, structures
from haploop.plant.choose import make_motion, make_position_sensor
from haploop.plant.friction.projected import ProjectedFrictionMotion
from haploop.plant.line.delay import make_line
from haploop.plant.plant import Plant
from haploop.plant.sensing.accelerometer import make_accelerometer
from haploop.protocol.scene.scene import Scene, accelerometer_is_used
from haploop.protocol.ticks import Timebase

Kinds = Mapping[str, type[Element]]


class Seen(NamedTuple):
    """What loops did over some ticks, shape (ticks, members).

    Attributes:
        x: position of the body with the encoder, m.
        measured: the same as the controller reads it, m.
        command: N.
        gone: whether a member is beyond the scene's limit, or no number, shape (members,).
    """

    x: np.ndarray
    measured: np.ndarray
    command: np.ndarray
    gone: np.ndarray


class Loops:
    """Scenes of one structure, moved together; friction is projected, see ``ProjectedFrictionMotion``."""

    def __init__(self, scenes: Sequence[Scene], kinds: Kinds) -> None:
        scene = stacked([replace(one, friction=None) for one in scenes])
        self._time = time = Timebase.from_scene(scene)
        rubs = scenes[0].friction is not None
        make = ProjectedFrictionMotion.of(scenes, scene, time) if rubs else make_motion(scene, time, len(scenes))
        self._motion, self._line = make, make_line(scene, time, len(scenes))
        self._position, self._sensor = make_position_sensor(scene, time), make_accelerometer(scene, time, len(scenes))
        self._feels, self._rows = accelerometer_is_used(scene), BatchRecorder()
        self._controller = Controller(scene, time, dict(kinds), self._rows)
        self._limit_m, self._tick = scene.diverged_beyond, 0

    def go_on(self, ticks: int) -> Seen:
        """Runs so many ticks more."""
        motion, members = self._motion, len(np.atleast_1d(self._motion.x))
        x, measured, command = np.empty((3, ticks, members))
        with np.errstate(all="ignore"):
            for row in range(ticks):
                x[row], measured[row] = motion.x, self._position.reading(motion.x)
                forces = self._controller.answer([self._sample(measured[row])])
                command[row] = forces[0]
                self._line.receive(forces)
                motion.advance(self._tick, self._line.holds(self._tick))
                self._tick += 1
            gone = np.asarray(~(np.abs(x) <= self._limit_m).all(axis=0) | ~np.isfinite(command).all(axis=0))
        self._rows.take_rows()
        motion.take_record(self._tick - ticks, positions_only=True)
        return Seen(x, measured, command, gone)

    def _sample(self, measured: np.ndarray) -> tuple[Any, ...]:
        if not self._feels:
            return (measured.copy(),)
        acceleration = self._motion.acceleration(self._tick)
        return measured.copy(), self._sensor.reading(acceleration) if self._sensor else acceleration

    def select(self, kept: np.ndarray) -> None:
        """Goes on with these members alone, a truth value of each."""
        for part in (self._motion, self._line, self._position, self._sensor, self._controller):
            if part:
                part.select(kept)


class LoneLoop:
    """One loop that arrays cannot move, by the plant and the controller of a run; used as ``Loops`` is."""

    def __init__(self, scene: Scene, kinds: Kinds) -> None:
        self._time = Timebase.from_scene(scene)
        self._plant, self._controller = Plant(scene, self._time), Controller(scene, self._time, dict(kinds))

    def go_on(self, ticks: int) -> Seen:
        """Runs so many ticks more."""
        measured: list[float] = []
        command: list[float] = []

        def exchange(_: int, samples: list[tuple[float, ...]]) -> list[float]:
            forces = [float(force) for force in self._controller.answer(samples)]
            measured.extend(sample[0] for sample in samples)
            command.extend(forces)
            return forces

        self._plant.run_until(self._plant.tick + ticks, exchange)
        _, done, columns = self._plant.take_block()
        self._controller.recorder.take()
        x = np.frombuffer(columns["x"])[: done * self._time.steps_per_tick : self._time.steps_per_tick]
        shown, read, commanded = (np.resize(np.array(values, float), (ticks, 1)) for values in (x, measured, command))
        return Seen(shown, read, commanded, np.array([self._plant.stop_reason is not None]))

    def select(self, kept: np.ndarray) -> None:
        """Has no others to leave out."""


def make_loops(scenes: Sequence[Scene], kinds: Kinds) -> list[tuple[list[int], Loops | LoneLoop]]:
    """Returns the indices of the scenes that move together, with their loops."""
    groups: dict[Any, list[int]] = {}
    for index, shape in enumerate(structures([replace(scene, friction=None) for scene in scenes])):
        smooth = is_batchable(replace(scenes[index], friction=None))
        groups.setdefault((shape, scenes[index].friction is None) if smooth else index, []).append(index)
    return [
        (group, LoneLoop(scenes[key], kinds) if isinstance(key, int) else Loops([scenes[i] for i in group], kinds))
        for key, group in groups.items()
    ]
