"""The books of a device moved by an unmodelled hand: what the hand gave is the book that closes the balance."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from haploop.logger.books.one_mass import beyond_limits
from haploop.logger.books.work import CLOSING, Displacement, by_interval, sum_steps
from haploop.plant.motion.hand_force import constant_forces
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase


class ClosingBooks:
    """The books of the device alone; ``names`` are in the order in which ``increments`` yields them.

    Only the rows of telemetry are known, not what acts between them. Over a plant step h from v to v+, displaced by dx:
    heat of the damper   b h ((v^2 + v v+ + v+^2) / 3 + c (v + v+) / 6 + c^2 / 30),  c = 6 dx / h - 3 (v + v+),
    exact where the velocity is a parabola in time, as it nearly is over a step of any smooth motion.
    """

    def __init__(self, scene: Scene, time: Timebase) -> None:
        self._device, self._n, self._step_s = scene.device, time.steps_per_tick, time.step_s
        self._constant = constant_forces(scene)
        self._is_limited = scene.actuator is not None
        self.names = [CLOSING, "device_heat", "kinetic", "spring"]
        self.names += ["actuator"] * self._is_limited + [f"{name}_work" for name in self._constant]

    def increments(
        self, first_step: int, columns: dict[str, np.ndarray], moved: Displacement, commanded: Iterable[np.ndarray]
    ) -> Iterator[np.ndarray]:
        """Yields the energy each interval adds to each book, J; 0 for the book that closes the balance.

        Args:
            first_step: not used, since no force here depends on time.
            columns: plant telemetry of whole intervals, the end state included; shape (ticks * n + 1,) each.
            commanded: the force of the wall and of every element over each step, shape (ticks * n,).

        Yields:
            Shape (ticks,) each, ordered as ``names``.
        """
        n, device, v = self._n, self._device, columns["v"]
        yield np.zeros_like(moved.by_tick)
        start, end = by_interval(v[:-1], n), by_interval(v[1:], n)
        bend = 6.0 * moved.by_step / self._step_s - 3.0 * (start + end)
        square = (start * start + start * end + end * end) / 3.0 + bend * (start + end) / 6.0 + bend * bend / 30.0
        yield device.damping * self._step_s * sum_steps(square)
        at_ticks = v[::n]
        change = at_ticks[1:] - at_ticks[:-1]
        yield device.mass * change * (at_ticks[:-1] + change * 0.5)
        yield np.zeros_like(moved.by_tick)  # there is no spring of the hand
        if self._is_limited:
            held = by_interval(columns["force"][:-1], n)
            limited = (by_interval(force, n) for force in commanded)
            yield sum_steps(beyond_limits(limited, held) * moved.by_step)
        for force_N in self._constant.values():
            yield force_N * moved.by_tick

    def select(self, kept: np.ndarray) -> None:
        """Does nothing: there are no members."""

    def stored_J(self, columns: dict[str, np.ndarray]) -> float:
        """Returns the kinetic energy in the first state of some telemetry, J."""
        return 0.5 * self._device.mass * float(columns["v"][0]) ** 2
