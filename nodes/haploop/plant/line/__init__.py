"""The line from the controller to the device: delay, jitter, loss, and the actuator at its end.

``delay.make_line`` makes the line of a scene; this module has what all lines share.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

if TYPE_CHECKING:
    from haploop.plant.counters import Counter

# (number of steps, force in N, tick of the command); a force holds over its steps.
Hold = tuple[int, Any, int]


class Line(Protocol):
    """The path of the commands to the device.

    Attributes:
        counters: counters of what may happen to a command, by the name of their column.
        state: a tree of numbers and forces, enough to continue from.
    """

    @property
    def counters(self) -> dict[str, Counter]: ...

    @property
    def state(self) -> Any: ...

    def restore(self, state: Any, /) -> None:
        """Continues from a state."""

    def receive(self, forces: list[Any], /) -> None:
        """Takes the next commands, in order of their ticks."""

    def holds(self, tick: int, /) -> list[Hold]:
        """Returns the forces held in interval ``tick``, in order: they cover all its steps, and none has 0 steps.

        It must be called once for every interval, from 0 on; commands up to tick - L must have been received.
        """
        ...

    def retimed(self, delay_steps: int, tick: int, /) -> Line:
        """Returns a line with another delay, in plant steps, of commands from ``tick`` on; earlier ones stay on it."""
        ...

    def select(self, kept: np.ndarray, /) -> None:
        """Drops the members of a batch that are not kept; ``kept`` is their mask, shape (members,)."""
