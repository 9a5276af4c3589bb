"""The actuator: resolution and saturation of the force of every command that takes effect."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from haploop.plant.counters import SATURATED, make_counter
from haploop.plant.line import Hold, Line
from haploop.protocol.arrays import clipped, nearest_multiple, where
from haploop.protocol.scene import effects
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_select


class Actuator(NamedTuple):
    """Force = q rint(command / q), clipped to +-saturation.

    A command that is not a finite number passes unchanged; it ends the run. Either parameter (N) may be None; in a
    batch it is a number for all members or an array of shape (members,).
    """

    resolution: Any
    saturation: Any

    def drive(self, command: Any) -> tuple[Any, Any]:
        """Returns (force of a command in N, whether it was clipped)."""
        force = command if self.resolution is None else nearest_multiple(command, self.resolution)
        if self.saturation is None:
            return force, False
        limited = clipped(force, self.saturation)
        if limited is force:  # a float within the limits
            return force, False
        is_finite = force - force == 0.0
        return where(is_finite, limited, force), is_finite & (limited != force)


class ActuatedLine:
    """A line with an actuator at its end, which receives the commands that another line delivers.

    Attributes:
        actuator: its parameters; the motion applies the bandwidth.
        state: (state of the line, tick of the command in effect last, its force in N, saturated commands).
        counters: those of the line and, where there is a saturation, the commands it clipped, each at its first step.
    """

    def __init__(self, line: Line, table: effects.Actuator, time: Timebase, members: int | None = None) -> None:
        self._steps = time.steps_per_tick
        self.actuator = Actuator(table.resolution, table.saturation)
        self._command, self._force = -1, 0.0
        self._saturated = make_counter(members)
        self._take(line)

    def _take(self, line: Line) -> None:
        self.line, self.receive = line, line.receive
        is_counted = self.actuator.saturation is not None
        self.counters = line.counters | ({SATURATED: self._saturated} if is_counted else {})

    @property
    def state(self) -> tuple[Any, int, Any, Any]:
        return self.line.state, self._command, self._force, self._saturated.state

    def restore(self, state: tuple[Any, int, Any, Any]) -> None:
        line, self._command, self._force, saturated = state
        self.line.restore(line)
        self._saturated.restore(saturated)

    def retimed(self, delay_steps: int, tick: int) -> ActuatedLine:
        self._take(self.line.retimed(delay_steps, tick))
        return self

    def holds(self, tick: int) -> list[Hold]:
        step = tick * self._steps
        holds: list[Hold] = []
        for count, force, command in self.line.holds(tick):
            if command > self._command:
                self._command = command
                self._force, is_saturated = self.actuator.drive(force)
                self._saturated.note(step, is_saturated)
            holds.append((count, self._force, command))
            step += count
        return holds

    def select(self, kept: np.ndarray) -> None:
        self.line.select(kept)
        self.actuator, self._force = tree_select((self.actuator, self._force), kept)
        self._saturated.select(kept)
