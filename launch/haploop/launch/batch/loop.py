"""The loop of a batch, sensor to motion, tick by tick; it knows nothing of books and ends."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.controller.active_elements import Unchanged
from haploop.controller.controller import Controller
from haploop.controller.recorder import BatchRecorder
from haploop.plant.choose import make_motion, make_position_sensor
from haploop.plant.line.delay import make_line
from haploop.plant.sensing.accelerometer import make_accelerometer
from haploop.protocol.scene.scene import Scene, accelerometer_is_used
from haploop.protocol.ticks import Timebase


class BatchLoop:
    """Sensor, line, motion and controller of the members of a batch, each a place in arrays.

    Args:
        scene: the stacked scene of all members.
        controller: controller of all members, with ``rows`` as its recorder.
        members: number of members.
    """

    def __init__(self, scene: Scene, time: Timebase, controller: Controller, rows: BatchRecorder, members: int) -> None:
        self._time, self._controller, self._rows = time, controller, rows
        self._motion, self._line = make_motion(scene, time, members), make_line(scene, time, members)
        self._position, self._sensor = make_position_sensor(scene, time), make_accelerometer(scene, time, members)
        self._feels = accelerometer_is_used(scene)
        self._elements = Unchanged(controller.params.elements)

    def _work(self, tick: int) -> list[Any]:
        """Works through a tick; returns the command that answers it, N, in a list."""
        x_m = self._position.reading(self._motion.x)
        sample = (x_m, self._felt(tick)) if self._feels else (x_m,)
        forces = self._controller.answer([sample])
        self._line.receive(forces)
        self._motion.advance(tick, self._line.holds(tick))
        return forces

    def _felt(self, tick: int) -> Any:
        acceleration = self._motion.acceleration(tick)
        return self._sensor.reading(acceleration) if self._sensor else acceleration

    def _select(self, kept: np.ndarray) -> None:
        for part in (self._motion, self._line, self._position, self._sensor, self._controller):
            if part:
                part.select(kept)
        self._elements = Unchanged(self._controller.params.elements)
