"""Rows of what the controller saw and did at every tick, kept in blocks of equal columns until they are taken."""

from __future__ import annotations

import math
from array import array
from typing import TYPE_CHECKING, Any, NamedTuple

from haploop.controller.active_elements import Description
from haploop.controller.tick import MOTION_COLUMNS, ControllerParams
from haploop.protocol.changes import Change, Event
from haploop.protocol.transport.telemetry import Block

if TYPE_CHECKING:
    import numpy as np


class Recorder:
    """Rows of a controller, tick by tick.

    A block has ``from_tick``, ``ticks``, ``columns`` (name -> little-endian float64 bytes), ``elements`` (one
    description per dissipation column) and ``wall`` (its numbers, into_wall, and its kind unless it is a spring) as
    they were at its ticks.

    Attributes:
        refused, restored: changes that were not made; events that report swaps taken back.
        own: index of each element that shows more than its force, and the names of what it shows; those end a row.
        history: the newest blocks taken, covering every command that may still be in flight.
        trouble: a sentence about the element that first gave a force that is not a finite number, or None.
    """

    def __init__(self, history_ticks: int) -> None:
        self._history_ticks = history_ticks
        self._cut: list[Block] = []
        self.refused: list[Change] = []
        self.restored: list[Event] = []
        self.history: list[Block] = []
        self.trouble: str | None = None
        self._next_tick = 0
        self.own: tuple[tuple[int, tuple[str, ...]], ...] = ()

    def open(self, params: ControllerParams) -> None:
        """Starts a block with the columns of these elements, and with wall and elements as they are now."""
        wall = params.wall
        self._begin()
        self.elements = [active.describe() for active in params.elements]
        named = {} if wall.kind == "spring" else {"kind": wall.kind}
        self._wall = {**wall.values(), "into_wall": wall.inward, **named}
        forces = [f"dissipation.{index}" for index in range(len(self.elements))]
        shows = [(*active.element.columns,) for active in params.elements]
        self.own = tuple((index, names) for index, names in enumerate(shows) if names)
        own = [f"dissipation.{index}.{name}" for index, names in self.own for name in names]
        self._names = [*MOTION_COLUMNS, *forces, "total", "in_contact", *own]

    def _begin(self) -> None:
        self._rows: list[float] = []
        self.add = self._rows.extend

    def cover(self, ticks: int) -> None:
        """Keeps a history of at least ``ticks`` ticks from now on."""
        self._history_ticks = max(self._history_ticks, ticks)

    def cut(self) -> None:
        width = len(self._names)
        ticks = len(self._rows) // width
        if not ticks:
            return
        rows = array("d", self._rows)
        columns = {name: rows[i::width] for i, name in enumerate(self._names)}
        if self.trouble is None and not math.isfinite(sum(rows)):
            self._find_trouble(columns)
        block: Block = {"from_tick": self._next_tick, "ticks": ticks, "elements": self.elements, "wall": self._wall}
        self._cut.append(block | {"columns": {name: column.tobytes() for name, column in columns.items()}})
        self._next_tick += ticks

    def take(self) -> list[Block]:
        """Returns all blocks since the last call, in order."""
        self.cut()
        blocks, self._cut = self._cut, []
        self.history += blocks
        while len(self.history) > 1 and self._next_tick - self.history[1]["from_tick"] >= self._history_ticks:
            del self.history[0]
        self._begin()
        return blocks

    def take_told(self) -> tuple[list[Change], list[Event]]:
        """Returns the changes refused, and the events of swaps taken back, since the last call."""
        told = self.refused, self.restored
        self.refused, self.restored = [], []
        return told

    def _find_trouble(self, columns: dict[str, array[float]]) -> None:
        found = [
            (tick, index, force)
            for index in range(len(self.elements))
            for tick, force in enumerate(columns[f"dissipation.{index}"], self._next_tick)
            if not math.isfinite(force)
        ]
        if found:
            tick, index, force = min(found)
            self.trouble = f"element {index} ({self.elements[index]['kind']}) gave {force} at tick {tick}"


class Row(NamedTuple):
    """One tick of a batch.

    Attributes:
        columns: x, v, a, wall, total, in_contact, wall_position, wall_stiffness; floats, or arrays of shape (members,).
        forces: force of every active element, by its book.
    """

    columns: dict[str, float | np.ndarray]
    forces: dict[int, Any]
    elements: list[Description]


class BatchRecorder(Recorder):
    """Rows of the controller of a batch, kept one by one until they are taken."""

    def __init__(self) -> None:
        super().__init__(history_ticks=0)
        self._taken: list[Row] = []

    def open(self, params: ControllerParams) -> None:
        """Gives the coming rows the columns of these elements and this wall."""
        super().open(params)
        self.own = ()
        self._shared = {"wall_position": params.wall.position, "wall_stiffness": params.wall.stiffness}
        self._books = [active.book for active in params.elements]
        self.add = self._add

    def cut(self) -> None:
        """Does nothing: every row knows its columns."""

    def _add(self, row: list[Any]) -> None:
        motion, forces = row[: len(MOTION_COLUMNS)], row[len(MOTION_COLUMNS) : -2]
        columns = dict(zip(MOTION_COLUMNS, motion, strict=True)) | {"total": row[-2], "in_contact": row[-1]}
        self._taken.append(Row(columns | self._shared, dict(zip(self._books, forces, strict=True)), self.elements))

    def take_rows(self) -> list[Row]:
        """Returns all rows since the last call."""
        rows, self._taken = self._taken, []
        return rows
