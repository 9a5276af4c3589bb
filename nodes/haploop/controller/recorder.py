"""What the controller saw and did at every tick, kept in blocks of like columns until it is taken."""

from __future__ import annotations

import math
from array import array
from typing import Any

from haploop.controller.active_elements import Slots
from haploop.controller.wall import Wall
from haploop.protocol.changes import Change

Block = dict[str, Any]
MOTION_COLUMNS = ("x", "v", "a", "wall")


class Recorder:
    """Rows of a controller, tick by tick.

    A block is a dict of ``from_tick``, ``ticks``, ``columns`` (name -> little-endian float64 bytes), ``elements`` (one
    description per dissipation column) and ``wall`` (position, stiffness, into_wall) as they stood in its ticks.

    Attributes:
        add: takes the row of one tick.
        refused: changes that could not be carried out.
        history: the newest blocks taken, covering every command that may still be in flight.
        trouble: the element that first gave a force which is no finite number, as a sentence, or None.
    """

    def __init__(self, wall: Wall, slots: Slots, history_ticks: int) -> None:
        self._wall, self._slots = wall, slots
        self._history_ticks = history_ticks
        self._cut: list[Block] = []
        self.refused: list[Change] = []
        self.history: list[Block] = []
        self.trouble: str | None = None
        self._next_tick = 0
        self.open()

    def open(self) -> None:
        """Start a block with the columns that wall and slots have now."""
        self._rows: list[float] = []
        self.add = self._rows.extend
        self._elements = [slot.describe() for slot in self._slots.slots]
        self._place = {
            "position": self._wall.position,
            "stiffness": self._wall.stiffness,
            "into_wall": self._wall.into_wall,
        }
        names = [f"dissipation.{index}" for index in range(len(self._elements))]
        self._names = [*MOTION_COLUMNS, *names, "total", "in_contact"]

    @property
    def is_empty(self) -> bool:
        """Whether every tick so far has been taken."""
        return not self._rows and not self._cut

    def cover(self, ticks: int) -> None:
        """Keep a history of at least so many ticks from now on."""
        self._history_ticks = max(self._history_ticks, ticks)

    def cut(self) -> None:
        """End the present block."""
        width = len(self._names)
        ticks = len(self._rows) // width
        if not ticks:
            return
        rows = array("d", self._rows)
        columns = {name: rows[i::width] for i, name in enumerate(self._names)}
        if self.trouble is None and not math.isfinite(sum(rows)):
            self._find_trouble(columns)
        self._cut.append(
            {
                "from_tick": self._next_tick,
                "ticks": ticks,
                "columns": {name: column.tobytes() for name, column in columns.items()},
                "elements": self._elements,
                "wall": self._place,
            }
        )
        self._next_tick += ticks

    def take(self) -> list[Block]:
        """All blocks since the last call, in order."""
        self.cut()
        blocks, self._cut = self._cut, []
        self.history += blocks
        while len(self.history) > 1 and self._next_tick - self.history[1]["from_tick"] >= self._history_ticks:
            del self.history[0]
        self.open()
        return blocks

    def _find_trouble(self, columns: dict[str, array[float]]) -> None:
        found = [
            (tick, index, force)
            for index in range(len(self._elements))
            for tick, force in enumerate(columns[f"dissipation.{index}"], self._next_tick)
            if not math.isfinite(force)
        ]
        if found:
            tick, index, force = min(found)
            self.trouble = f"element {index} ({self._elements[index]['kind']}) gave {force} at tick {tick}"
