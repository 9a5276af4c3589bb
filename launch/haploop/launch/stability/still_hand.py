"""The loop as it goes on from the end of a run, its hand held still but for one push, without noise or events."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np

from haploop.controller.controller import Controller
from haploop.plant.motion.hand_force import make_hand_force
from haploop.plant.plant import Plant
from haploop.protocol.scene.hand_force import Trace
from haploop.protocol.scene.paths import value_at, with_value
from haploop.protocol.scene.scene import Hand, Scene
from haploop.protocol.ticks import Timebase

# A push lasts this long; its edges take one plant step.
PUSH_S = 0.05
_NOISES = ("noise.deviation", "accelerometer.noise_density")


@dataclass(frozen=True)
class End:
    """The end of a run.

    Attributes:
        scene, time: what was run, and its integers.
        plant, controller: as they stand there, their blocks taken.
        hold_N: the force at which the hand is held from there on.
    """

    scene: Scene
    time: Timebase
    plant: Plant
    controller: Controller
    hold_N: float


class StillHand:
    """A loop that goes on with a still hand; the run itself is not touched.

    Args:
        end: where it goes on from.
        push_N: force of the push, added to the hand's.

    Attributes:
        x: position at the ticks since the push, m.
        command: command at the ticks since the push, N.
        stop_reason: why the plant has ended by itself, or None.
    """

    def __init__(self, end: End, push_N: float) -> None:
        tick, rate = end.plant.reached, end.time.control_rate
        self._scene = _held(end.scene, end.hold_N, push_N, tick / rate, end.time.step_s)
        self._plant = Plant(self._scene, replace(end.time, ticks=2**53))
        self._plant.restore(deepcopy(end.plant.checkpoint()))
        self._controller = end.controller.fork()
        self._first, self._rate = tick + round((PUSH_S + end.time.step_s) * rate) + 1, rate
        self._steps = end.time.steps_per_tick
        self.x, self.command = np.zeros(0), np.zeros(0)

    @property
    def stop_reason(self) -> str | None:
        return self._plant.stop_reason

    def go_to(self, seconds: float) -> None:
        """Goes on until so many seconds have passed since the push.

        Raises:
            ElementError: an element raised.
        """
        commands: list[float] = []

        def exchange(_: int, samples: list[tuple[float, ...]]) -> list[float]:
            forces = [float(force) for force in self._controller.answer(samples)]
            commands.extend(forces)
            return forces

        began = self._plant.tick
        self._plant.run_until(self._first + round(seconds * self._rate), exchange)
        first, ticks, columns = self._plant.take_block()
        self._controller.recorder.take()
        x = np.frombuffer(columns["x"])[: ticks * self._steps : self._steps]
        self.x = np.append(self.x, x[max(0, self._first - first) :])
        self.command = np.append(self.command, commands[max(0, self._first - began) :])


def hold_of(scene: Scene, time: Timebase, first: int, inside: np.ndarray) -> float:
    """Returns the mean force of the hand in N over the ticks from ``first`` on that were in contact (``inside``)."""
    n = time.steps_per_tick
    force = make_hand_force(scene, time.plant_rate).at_steps(first * n, (first + len(inside)) * n)[::n]
    return float(force[inside].mean())


def _held(scene: Scene, hold_N: float, push_N: float, at_s: float, step_s: float) -> Scene:
    """Returns the scene with the hand held from a time on but for the push, without noise and events."""
    times = (at_s + step_s, at_s + 2 * step_s, at_s + PUSH_S, at_s + PUSH_S + step_s)
    pushed = hold_N + push_N
    force = Trace(time=times, force=(hold_N, pushed, pushed, hold_N))
    scene = replace(scene, hand=replace(scene.hand or Hand(), force=force), event=())
    for key in _NOISES:
        if value_at(scene, key):
            scene = with_value(scene, key, 0.0)
    return scene
