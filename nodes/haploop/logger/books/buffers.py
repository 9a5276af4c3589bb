"""Telemetry of plant and controller, aligned so that whole intervals can be booked."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from haploop.protocol.transport.telemetry import Block
from haploop.protocol.walls.registry import parameters_of
from haploop.protocol.walls.wall import Spring, Wall

# Columns of pieces of steps have a row for each piece, in order; ``pieces.step`` says to which step it belongs.
PIECES = "pieces."


def as_float64(data: bytes) -> np.ndarray:
    return np.frombuffer(data, "<f8")


class TelemetryGap(RuntimeError):
    """A block that does not follow the one before it."""


def _check(block: Block, role: str, end: int) -> None:
    if block["from_tick"] != end:
        raise TelemetryGap(f"A {role} block from tick {end} was expected, but one from {block['from_tick']} came.")


class PlantBuffer:
    """Plant states at every step from ``tick`` on; the last state is the start of the next interval."""

    def __init__(self, steps_per_tick: int, tick: int) -> None:
        self._steps = steps_per_tick
        self.tick = self.end = tick
        self._columns: dict[str, np.ndarray] = {}

    def add(self, block: Block) -> None:
        """Appends a block; TelemetryGap where it does not start at the end of the last one."""
        _check(block, "plant", self.end)
        keep = max(0, (self.end - self.tick) * self._steps)
        for name, data in block["columns"].items():
            new = as_float64(data)
            rows = None if name.startswith(PIECES) else keep
            kept = self._columns.get(name, np.zeros(rows or 0))  # a count that starts now was 0 before
            self._columns[name] = np.concatenate([kept[:rows], new])
        self.end += block["ticks"]

    def first_tick_from(self, command: int) -> int:
        """Returns the first tick from which on the command in effect, if any, is ``command`` or a later one."""
        in_effect = self._columns["command"][:-1]
        older = np.flatnonzero((in_effect >= 0) & (in_effect < command))
        return self.tick + (int(older[-1]) // self._steps + 1 if len(older) else 0)

    def take(self, tick: int) -> dict[str, np.ndarray]:
        """Returns the states of the intervals before ``tick``, end state included; keeps those from ``tick`` on."""
        rows = (tick - self.tick) * self._steps
        pieces = int(np.searchsorted(self._columns.get(f"{PIECES}step", ()), tick * self._steps))
        cuts = {name: (pieces, pieces) if name.startswith(PIECES) else (rows + 1, rows) for name in self._columns}
        taken = {name: column[: cuts[name][0]] for name, column in self._columns.items()}
        self._columns = {name: column[cuts[name][1] :] for name, column in self._columns.items()}
        self.tick = tick
        return taken


class Commanded(NamedTuple):
    """Controller rows of some ticks and of all commands in effect in them; columns may have a last axis for a batch.

    Attributes:
        x_m: positions as measured, shape (rows,), m.
        forces: of the wall, by the name "wall", and of every element's book, shape (rows,) each, N.
        wall: as it is in all intervals booked.
    """

    first: int
    x_m: np.ndarray
    forces: dict[str, np.ndarray]
    wall: Wall


class ControllerBuffer:
    """Controller rows of one run by tick, with every book's force and the wall of the time.

    Args:
        wall: class of the scene's wall.

    Attributes:
        columns: x, v, a, wall, total, in_contact, the wall's numbers (wall_position, ...); shape (end - first,) each.
        forces: force of every book that has acted within these ticks, 0 where it was not at work.
    """

    def __init__(self, tick: int, wall: type[Wall] = Spring) -> None:
        self._wall, self._of_wall, self._inward = wall, parameters_of(wall), 0.0
        self.first = self.end = tick
        self.columns: dict[str, np.ndarray] = {}
        self.forces: dict[int, np.ndarray] = {}
        self._opened: dict[int, int] = {}
        self._part_ends: list[int] = []

    def add(self, block: Block) -> None:
        """Appends a block; TelemetryGap where it does not start at the end of the last one."""
        _check(block, "controller", self.end)
        columns = {name: as_float64(data) for name, data in block["columns"].items()}
        books = {e["book"]: columns[f"dissipation.{i}"] for i, e in enumerate(block["elements"])}
        new = {name: column for name, column in columns.items() if not name.startswith("dissipation.")}
        ticks, kept = block["ticks"], self.end - self.first
        new |= {f"wall_{name}": np.full(ticks, block["wall"][name]) for name in self._of_wall}
        self._inward = block["wall"]["into_wall"]
        self.columns = {name: np.concatenate([self.columns.get(name, new[name][:0]), new[name]]) for name in new}
        self.forces = {
            book: np.concatenate([self.forces.get(book, np.zeros(kept)), books.get(book, np.zeros(ticks))])
            for book in sorted(self.forces.keys() | books.keys())
        }
        for element in block["elements"]:
            self._opened[element["book"]] = element["from_tick"]
        self.end += ticks
        self._part_ends.append(self.end)

    def part_end(self, tick: int) -> int:
        """Returns the end of the block that holds ``tick``; up to there the elements are the same."""
        return next((end for end in self._part_ends if end > tick), self.end)

    def rows(self, name: str, first: int, end: int) -> np.ndarray:
        """Returns a column at the ticks first ... end - 1."""
        return self.columns[name][first - self.first : end - self.first]

    def commanded(self, tick: int, end: int) -> Commanded:
        """Returns what the books need for the intervals ``tick`` ... ``end - 1``, without elements that start later."""
        forces = {str(book): force for book, force in self.forces.items() if self._opened[book] < end}
        stood = {name: float(self.rows(f"wall_{name}", tick, end)[0]) for name in self._of_wall}
        wall = self._wall(inward=self._inward, **stood)
        return Commanded(self.first, self.columns["x"], {"wall": self.columns["wall"]} | forces, wall)

    def forget_before(self, tick: int, command: int) -> None:
        """Drops rows older than both ``tick - 1`` and ``command``, in effect then, and books with no force left.

        A book that opens at ``tick`` or later stays even without a force, so that it opens at its own tick.
        """
        drop = max(0, min(tick - 1, command) - self.first)
        if drop:
            self.columns = {name: column[drop:] for name, column in self.columns.items()}
            kept = [book for book, force in self.forces.items() if force[drop:].any() or self._opened[book] >= tick]
            self.forces = {book: self.forces[book][drop:] for book in kept}
            self.first += drop
        self._part_ends = [end for end in self._part_ends if end > tick]
