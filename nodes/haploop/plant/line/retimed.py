"""What a motion with holds of fixed lengths needs once the delay changes while the loop runs."""

from __future__ import annotations

from typing import Any, Protocol

from haploop.plant.line.delay import Hold, Line


class Cut(Protocol):
    """A motion that fills in what it recorded by the lengths of the holds, alike in all intervals of a part."""

    def cut_as(self, counts: tuple[int, ...], /) -> None:
        """From the next interval on the holds have these numbers of steps."""


class RetimedLine:
    """A line whose holds may have other lengths in one interval than in the one before; the motion is told when.

    Attributes:
        receive, tallies: those of the line.
    """

    def __init__(self, line: Line, motion: Cut) -> None:
        self._motion = motion
        self._counts: tuple[int, ...] = ()
        self._take(line)

    def _take(self, line: Line) -> None:
        self._line = line
        self.receive, self.tallies = line.receive, line.tallies

    def holds(self, tick: int) -> list[Hold]:
        """The forces held in interval ``tick``, in order."""
        holds = self._line.holds(tick)
        counts = tuple(count for count, _, _ in holds)
        if counts != self._counts:
            self._counts = counts
            self._motion.cut_as(counts)
        return holds

    def retimed(self, delay_steps: int, tick: int) -> Any:
        """The same line with another delay of the commands from ``tick`` on."""
        self._take(self._line.retimed(delay_steps, tick))
        return self
