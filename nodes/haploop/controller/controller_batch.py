"""The controllers of many loops at once: estimates, wall and elements on arrays, a number for every loop in each."""

from __future__ import annotations

from typing import Any, NamedTuple

from haploop.controller.active_elements import Slots
from haploop.controller.controller import Controller
from haploop.controller.dissipation import Element
from haploop.controller.recorder import MOTION_COLUMNS, Recorder
from haploop.controller.wall import Wall
from haploop.protocol.ticks import Timebase


class Row(NamedTuple):
    """One tick of many loops.

    Attributes:
        columns: x, v, a, wall, total, in_contact, wall_position, wall_stiffness; numbers, or arrays of shape (loops,).
        forces: force of every book at work.
        elements: their descriptions; parameters may be arrays.
    """

    columns: dict[str, Any]
    forces: dict[int, Any]
    elements: list[dict[str, Any]]


class ControllerArray(Controller):
    """``Controller`` of a stacked scene, whose numbers may be arrays of shape (loops,): every tick is the same code.

    All loops have the same kinds in the same slots, and their changes at the same ticks.

    Attributes:
        recorder: the rows of the ticks, as ``Row``.
    """

    recorder: RecorderArray

    def __init__(self, scene: dict[str, Any], time: Timebase, kinds: dict[str, type[Element]]) -> None:
        super().__init__(scene, time, kinds)
        self.recorder = RecorderArray(self._wall, self._slots, history_ticks=0)

    @property
    def carried(self) -> list[Any]:
        """What remembers from tick to tick; a tick must have been answered."""
        return [self._velocity, self._acceleration, self._wall, self._slots, self._motion]

    @staticmethod
    def _number(force: Any) -> Any:
        """What is no number raises, as ``float`` does."""
        return 1.0 * force


class RecorderArray(Recorder):
    """Keeps the rows of all ticks until they are taken."""

    def __init__(self, wall: Wall, slots: Slots, history_ticks: int) -> None:
        self.taken: list[Row] = []
        super().__init__(wall, slots, history_ticks)

    def open(self) -> None:
        """From now on the rows have the columns that wall and slots have now."""
        super().open()
        self.add = self._add

    def cut(self) -> None:
        """Rows know their columns; there is nothing to end."""

    def _add(self, row: list[Any]) -> None:
        count = len(MOTION_COLUMNS)
        columns = dict(zip(MOTION_COLUMNS, row, strict=False))
        columns |= {"total": row[-2], "in_contact": row[-1]}
        columns |= {"wall_position": self._place["position"], "wall_stiffness": self._place["stiffness"]}
        books = [element["book"] for element in self._elements]
        self.taken.append(Row(columns, dict(zip(books, row[count:-2], strict=True)), self._elements))

    def take_rows(self) -> list[Row]:
        """All rows since the last call."""
        rows, self.taken = self.taken, []
        return rows
