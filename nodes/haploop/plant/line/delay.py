"""The line from the controller's commands to the force on the device: delay and zero-order hold."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.plant.line import Hold, Line
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_select

if TYPE_CHECKING:
    from haploop.plant.counters import Counter


class DelayLine:
    """Line with a round-trip delay of d = L n + r steps: command k acts from step k n + d on.

    In interval k command k - L - 1 still holds for the first r steps and command k - L for the rest; before the first
    command the force is 0. Commands that are no longer in flight are dropped, some 64 at a time.

    Attributes:
        lookahead: L.
        state: (tick of the oldest command kept, forces of the commands kept).
    """

    def __init__(self, time: Timebase) -> None:
        self._time = time
        self.lookahead, self._late_steps = divmod(time.delay_steps, time.steps_per_tick)
        self._prompt_steps = time.steps_per_tick - self._late_steps
        self._forces: list[Any] = [0.0] * (self.lookahead + 1)
        self._first = -self.lookahead - 1
        self.receive = self._forces.extend
        self.counters: dict[str, Counter] = {}

    @property
    def state(self) -> tuple[int, tuple[Any, ...]]:
        return self._first, tuple(self._forces)

    def restore(self, state: Any) -> None:
        self._first, self._forces[:] = state

    def holds(self, tick: int) -> list[Hold]:
        """Returns the forces as ``Line`` does; forgets all older commands.

        Raises:
            IndexError: command tick - L has not been received.
        """
        newest = tick - self.lookahead
        forces, at = self._forces, newest - self._first
        hold: Hold = (self._prompt_steps, forces[at], newest if newest > -1 else -1)
        if not self._late_steps:
            holds = [hold]
        else:
            holds = [(self._late_steps, forces[at - 1], newest - 1 if newest > 0 else -1), hold]
        if at > 64:
            del forces[: at - 1]
            self._first += at - 1
        return holds

    def in_flight(self, tick: int) -> list[Any]:
        """Returns the forces of commands tick - L - 1 ... tick - 1, the oldest of which may still act in ``tick``."""
        return self._forces[tick - self.lookahead - 1 - self._first :]

    def retimed(self, delay_steps: int, tick: int) -> Line:
        """Returns a line that lets commands overtake; those before ``tick``, all received, are on it or in effect."""
        from haploop.plant.line.lossy import LossyLine

        n, d = self._time.steps_per_tick, self._time.delay_steps
        acting = max((tick * n - 1 - d) // n, -1)
        coming = tuple((k * n + d, self._forces[k - self._first], k) for k in range(acting + 1, tick))
        line, none = LossyLine(self._time), (0, ())
        line.restore((tick, delay_steps, coming, self._forces[acting - self._first], acting, none, none))
        return line

    def select(self, kept: np.ndarray) -> None:
        self._forces[:] = tree_select(self._forces, kept)


def make_line(scene: Scene, time: Timebase, members: int | None = None) -> Line:
    """Makes the line of a scene, or of the stacked scene of a batch, with the actuator at its end."""
    line: Line = DelayLine(time)
    if scene.jitter or scene.loss:
        from haploop.plant.line.lossy import LossyLine

        line = LossyLine(time, scene.jitter, scene.loss, scene.seed)
    actuator = scene.actuator
    if actuator and (actuator.saturation is not None or actuator.resolution is not None):
        from haploop.plant.line.actuator import ActuatedLine

        line = ActuatedLine(line, actuator, time, members)
    return line
