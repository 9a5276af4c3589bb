"""The line from the controller's commands to the force on the device: delay and zero-order hold."""

from __future__ import annotations

from typing import Any

from haploop.protocol.ticks import Timebase

# (number of steps, force in N, tick of the command); a force holds over its steps.
Hold = tuple[int, Any, int]


class CommandLine:
    """Round-trip delay of d = L n + r steps: command k acts from step k n + d on.

    In interval k command k - L - 1 still holds for the first r steps and command k - L for the rest; before the first
    command the force is 0. Commands are kept no longer than they are in flight.

    Attributes:
        receive: takes the next commands, a list in order of their ticks.
    """

    def __init__(self, time: Timebase) -> None:
        self._lookahead, self._late_steps = divmod(time.delay_steps, time.steps_per_tick)
        self._prompt_steps = time.steps_per_tick - self._late_steps
        self._forces: list[Any] = [0.0] * (self._lookahead + 1)
        self._first = -self._lookahead - 1
        self.receive = self._forces.extend

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
