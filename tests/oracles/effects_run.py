"""Runs of the reference of the effects: under given forces, and closed by the reference's controller."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from haploop.protocol.scene.scene import Scene
from oracles.effects_reference import Bodies
from oracles.reference import Controller, hand_force_N


class EffectsTruth:
    """The motion and the books of the reference.

    Attributes:
        force: force commanded over every step, N.
        energies: heats and works since the start by name, J.
        stored: energy stored at the steps and at the end, J.
        controller: the controller that closed the loop, if any.
    """

    def __init__(self, scene: Scene, steps: int) -> None:
        rate = scene.clock.plant_rate
        table = scene.hand.force if scene.hand else None
        self.tau = [hand_force_N(table, s / rate) for s in range(steps + 1)]
        self.step_s = 1.0 / rate
        self.bodies = Bodies(scene)
        self.states = [self.bodies.z.copy()]
        self.stored = [self.bodies.stored_J()]
        self.readings = [self.bodies.reading(0.0, self.tau[0])]
        self.force: list[float] = []
        self.controller: Controller | None = None

    def step(self, force: float) -> None:
        """Makes one plant step under a commanded force."""
        start, end = self.tau[len(self.force) : len(self.force) + 2]
        self.bodies.advance(force, start, (end - start) / self.step_s, self.step_s)
        self.force.append(force)
        self.states.append(self.bodies.z.copy())
        self.stored.append(self.bodies.stored_J())
        self.readings.append(self.bodies.reading(force, end))

    @property
    def x(self) -> np.ndarray:
        """Positions of all bodies at the steps and at the end, shape (steps + 1, bodies)."""
        return np.array(self.states)[:, : self.bodies.count]

    @property
    def v(self) -> np.ndarray:
        """Velocities of all bodies, of the same shape."""
        return np.array(self.states)[:, self.bodies.count : 2 * self.bodies.count]

    @property
    def energies(self) -> dict[str, float]:
        return self.bodies.energies()

    @property
    def unexplained_J(self) -> float:
        """The residual of the reference's own books, which shows how well it was integrated."""
        e = self.energies
        heats = [-value for name, value in e.items() if "heat" in name]
        return math.fsum([self.stored[0], e["hand_work"], e["actuator_work"], *heats, -self.stored[-1]])


def follow(scene: Scene, forces: Sequence[float]) -> EffectsTruth:
    """The plant under a given force over every step."""
    truth = EffectsTruth(scene, len(forces))
    for force in forces:
        truth.step(float(force))
    return truth


def simulate(scene: Scene) -> EffectsTruth:
    """The whole loop, provided that nothing in it is random and no actuator limits it."""
    clock = scene.clock
    n = clock.plant_rate // clock.control_rate
    delay = round(clock.round_trip_delay * clock.plant_rate)
    age = round((scene.accelerometer.delay if scene.accelerometer else 0.0) * clock.plant_rate)
    steps = round(scene.duration * clock.control_rate) * n
    truth = EffectsTruth(scene, steps)
    truth.controller = controller = Controller(scene)
    commands: list[float] = []
    for s in range(steps):
        if s % n == 0:
            reading = truth.readings[s - age] if s >= age else 0.0
            commands.append(controller.command(s // n, float(truth.states[s][0]), reading))
        command = (s - delay) // n
        truth.step(commands[command] if command >= 0 else 0.0)
    return truth
