"""The line from the controller's commands to the force on the device: delay and zero-order hold."""

from __future__ import annotations

from itertools import repeat
from typing import TYPE_CHECKING, Any, Protocol

from haploop.protocol.ticks import Timebase

if TYPE_CHECKING:
    from haploop.plant.counters import Tally

# (number of steps, force in N, tick of the command); a force holds over its steps.
Hold = tuple[int, Any, int]


class Line(Protocol):
    """What brings the commands to the device."""

    @property
    def tallies(self) -> dict[str, Tally]:
        """What may befall a command, counted, by the name of its column."""
        ...

    def receive(self, forces: list[Any], /) -> None:
        """Take the next commands, in order of their ticks."""

    def holds(self, tick: int) -> list[Hold]:
        """The forces held in interval ``tick``, in order: all its steps, no hold of none."""
        ...

    def retimed(self, delay_steps: int, tick: int, /) -> Line:
        """A line on which the commands from ``tick`` on have another delay, in plant steps; the others are on it."""
        ...


def line_of(scene: dict[str, Any], time: Timebase) -> Line:
    """The line of a scene, or of many in a stacked one, and the actuator at its end."""
    line: Line = CommandLine(time)
    if "jitter" in scene or "loss" in scene:
        from haploop.plant.line.lossy import uncertain_line

        line = uncertain_line(scene, time)
    actuator = scene.get("actuator", {})
    if "saturation" in actuator or "resolution" in actuator:
        if "loops" in scene:
            from haploop.plant.line.actuator_batch import ActuatorArray as Actuator
        else:
            from haploop.plant.line.actuator import Actuator

        line = Actuator(line, actuator, time)
    return line


class CommandLine:
    """Round-trip delay of d = L n + r steps: command k acts from step k n + d on.

    In interval k command k - L - 1 still holds for the first r steps and command k - L for the rest; before the first
    command the force is 0. Commands are kept no longer than they are in flight.

    Attributes:
        receive: takes the next commands, a list in order of their ticks.
        tallies: none; nothing befalls a command.
    """

    def __init__(self, time: Timebase) -> None:
        self._time = time
        self._lookahead, self._late_steps = divmod(time.delay_steps, time.steps_per_tick)
        self._prompt_steps = time.steps_per_tick - self._late_steps
        self._forces: list[Any] = [0.0] * (self._lookahead + 1)
        self._first = -self._lookahead - 1
        self.receive = self._forces.extend
        self.tallies: dict[str, Tally] = {}

    def holds(self, tick: int) -> list[Hold]:
        """The forces held in interval ``tick``, in order; forgets all older commands.

        Raises:
            IndexError: command tick - L has not been received.
        """
        newest = tick - self._lookahead
        at = newest - self._first
        force = self._forces[at]
        hold: Hold = (self._prompt_steps, force, max(newest, -1))
        if not self._late_steps:
            holds = [hold]
        else:
            holds = [(self._late_steps, self._forces[at - 1], max(newest - 1, -1)), hold]
        if at > 64:
            del self._forces[: at - 1]
            self._first += at - 1
        return holds

    def forget_before(self, tick: int) -> None:
        """Keep no command but those in flight at interval ``tick`` and the last one in effect before it."""
        newest_gone = tick - self._lookahead - 1 - self._first
        del self._forces[:newest_gone]
        self._first += newest_gone

    def retimed(self, delay_steps: int, tick: int) -> Line:
        """A line that lets commands overtake; those before ``tick``, all received, are on it or in effect."""
        from haploop.plant.line.lossy import UncertainLine

        n, d = self._time.steps_per_tick, self._time.delay_steps
        acting = max((tick * n - 1 - d) // n, -1)
        on_their_way = [(k * n + d, self._forces[k - self._first], k) for k in range(acting + 1, tick)]
        line = UncertainLine(self._time, repeat(0).__next__, repeat(False).__next__)
        line.take_over(self._forces[acting - self._first], acting, on_their_way, tick)
        return line.retimed(delay_steps, tick)
