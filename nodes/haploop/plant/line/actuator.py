"""What the actuator makes of a command at once: steps of force and saturation."""

from __future__ import annotations

from typing import Any

from haploop.plant.counters import SATURATED, Tally
from haploop.plant.line.delay import Hold, Line
from haploop.protocol.arrays import nearest_multiple
from haploop.protocol.ticks import Timebase


class Actuator:
    """Force = q rint(command / q), clipped to +-saturation, at the end of the line: of the commands that arrive.

    A command that is no finite number passes unchanged; it ends the run.

    Args:
        line: brings the commands.
        table: the resolved ``[actuator]`` table; its bandwidth is the motion's.
        time: the integers of the run.

    Attributes:
        receive: takes the next commands, a list in order of their ticks.
        tallies: those of the line and, where there is a saturation, the commands it clipped, each at its first step.
    """

    def __init__(self, line: Line, table: dict[str, Any], time: Timebase) -> None:
        self._steps = time.steps_per_tick
        self._resolution, self._most = table.get("resolution"), table.get("saturation")
        self._command, self._force = -1, 0.0
        self._saturated = Tally()
        self._take(line)

    def _take(self, line: Line) -> None:
        self._line, self.receive = line, line.receive
        self.tallies = line.tallies | ({SATURATED: self._saturated} if self._most is not None else {})

    def retimed(self, delay_steps: int, tick: int) -> Actuator:
        """The same with another delay of the commands from ``tick`` on."""
        self._take(self._line.retimed(delay_steps, tick))
        return self

    def forget_before(self, tick: int) -> None:
        """As a ``CommandLine`` does, if the line is one."""
        self._line.forget_before(tick)  # pyright: ignore[reportAttributeAccessIssue]

    def holds(self, tick: int) -> list[Hold]:
        """The forces the device feels in interval ``tick``, in order."""
        step = tick * self._steps
        holds: list[Hold] = []
        for count, force, command in self._line.holds(tick):
            if command > self._command:
                self._command, self._force = command, self._driven(force, step)
            holds.append((count, self._force, command))
            step += count
        return holds

    def _driven(self, force: float, step: int) -> float:
        if self._resolution is not None:
            force = nearest_multiple(force, self._resolution)
        if self._most is None or force - force != 0.0:
            return force
        clipped = max(-self._most, min(self._most, force))
        if clipped == force:
            return force
        self._saturated.note(step)
        return clipped
