"""Controller rows of many loops at once, laid out as the books read them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from haploop.protocol.arrays import rows_of


class Row(Protocol):
    """One tick of many loops; numbers, or arrays of shape (loops,)."""

    @property
    def columns(self) -> dict[str, Any]:
        """x, v, a, wall, total, in_contact, wall_position, wall_stiffness."""
        ...

    @property
    def forces(self) -> dict[int, Any]:
        """Force of every book at work."""
        ...


class ControllerTapeArray:
    """As ``ControllerTape``, of many loops; arrays have a last axis for them.

    Attributes:
        first: tick of the first row kept.
        end: tick after the last row.
    """

    def __init__(self) -> None:
        self.first = self.end = self._loops = 0
        self._kept: list[Row] = []

    def add(self, rows: Sequence[Row], loops: int) -> None:
        """Append the rows of the next ticks."""
        self._kept += rows
        self.end += len(rows)
        self._loops = loops

    def rows(self, name: str, first: int, end: int) -> np.ndarray:
        """A column at the ticks first ... end - 1, shape (end - first, loops)."""
        return rows_of([row.columns[name] for row in self._kept[first - self.first : end - self.first]], self._loops)

    def wall_forces(self) -> np.ndarray:
        """Force of the wall at all ticks kept."""
        return self.rows("wall", self.first, self.end)

    def forces_opened_before(self, _tick: int) -> dict[int, np.ndarray]:
        """Force of every book at work in these ticks; rows come no earlier than they are booked."""
        books = sorted({book for row in self._kept for book in row.forces})
        return {book: rows_of([row.forces.get(book, 0.0) for row in self._kept], self._loops) for book in books}

    def forget_before(self, tick: int, command: int) -> None:
        """Drop the rows before the last tick and before ``command``, in effect then."""
        drop = max(0, min(tick - 1, command) - self.first)
        del self._kept[:drop]
        self.first += drop
