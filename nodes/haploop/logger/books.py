"""The energy books of a run: plant, wall and every element, sampled and true, and the residual they leave."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.logger.plant_books import plant_books
from haploop.logger.sums import RunningSums, sum_by_tick, sum_in_order
from haploop.logger.tapes import ControllerTape
from haploop.logger.wall_books import CAUSES, held_J, ideal_and_undelayed
from haploop.protocol.arrays import first_row, of_loop
from haploop.protocol.ticks import Timebase

if TYPE_CHECKING:
    from haploop.logger.tape_array import ControllerTapeArray


def sampled_flow(x_m: np.ndarray, force: np.ndarray) -> np.ndarray:
    """-f[k-1] (x_m[k] - x_m[k-1]), J (Choi et al. 2022, eq. 4).

    Args:
        x_m: positions as measured at consecutive ticks, m, shape (ticks + 1,).
        force: commanded at all of them but the last, N, shape (ticks,) or (forces, ticks).
    """
    return force * -np.diff(x_m, axis=0)


class Books:
    """Running energies in joules; positive for the wall and the elements means taken out of the device.

    sampled  E += -f[k-1] (x_m[k] - x_m[k-1]) at tick k, all the controller can know (Choi et al. 2022, eq. 4)
    true     E += -f_applied (x[s+1] - x[s]) at every plant step: exact, since the applied force is held
    The residual is hand work - heats - change of stored energy - all true books. ``moved`` is the energy that changed
    its place: half of the sum of all changes in magnitude (each joule leaves one book and enters another), and the
    energy stored at the start.

    Attributes:
        names: all books, in the order of the rows of ``book``: the plant's, the causes of the wall's leak where there
            is a wall, ``moved``, then ``<b>.sampled`` and ``<b>.true`` for the wall and for every element's book b.
        wall_changes_J: what changes of the wall in contact would have put into an ideal spring.
    """

    def __init__(self, scene: dict[str, Any], time: Timebase) -> None:
        self._time = time
        self._plant = plant_books(scene, time)
        self._has_wall = "wall" in scene
        self._sums = RunningSums(*([scene["loops"]] if "loops" in scene else []))
        self._rows: dict[str, int] = {}
        self._open([*self._plant.names, *(CAUSES if self._has_wall else ()), "moved"])
        self._accounts = 0
        self._open_account("wall")
        self._stored_at_start_J = 0.0
        self._wall: tuple[Any, Any] | None = None
        self.wall_changes_J: Any = 0.0

    @property
    def names(self) -> list[str]:
        return list(self._rows)

    def _open(self, names: list[str]) -> None:
        for name in names:
            self._rows[name] = len(self._rows)
        self._sums.grow(len(self._rows))

    def _open_account(self, name: str) -> None:
        self._open([f"{name}.sampled", f"{name}.true"])

    def start(self, plant: dict[str, np.ndarray]) -> None:
        """Begin with the plant in the first state of its first columns."""
        self._stored_at_start_J = self._plant.stored_J(plant)

    def book(self, tick: int, plant: dict[str, np.ndarray], tape: ControllerTape, into_wall: float) -> np.ndarray:
        """Book the intervals from ``tick`` on that ``plant`` covers.

        Args:
            tick: first interval; in all of them the wall is the same.
            plant: telemetry columns of the plant with ticks * n + 1 rows.
            tape: controller rows of these ticks and of all commands in effect in them.
            into_wall: direction into the wall, +1 or -1.

        Returns:
            The books as they stand at each of these ticks, shape (rows, ticks), rows as ``names``: true and plant
            books up to the tick's step, sampled books with the tick's sample.
        """
        added, sampled_rows = self._added(tick, plant, tape, into_wall)
        totals = self._sums.add(added)
        at_ticks = totals[:, :-1]
        at_ticks[sampled_rows] = totals[sampled_rows, 1:]
        return at_ticks

    def book_loops(self, tick: int, plant: dict[str, np.ndarray], tape: ControllerTapeArray, into_wall: float) -> None:
        """The same for many loops at once; all columns have a last axis for them."""
        self._sums.add_of_loops(self._added(tick, plant, tape, into_wall)[0])

    def _added(
        self, tick: int, plant: dict[str, np.ndarray], tape: ControllerTape | ControllerTapeArray, into_wall: float
    ) -> tuple[np.ndarray, list[int]]:
        """What each tick adds to each book, shape (rows, ticks), and which rows are of sampled books."""
        ticks = (len(plant["x"]) - 1) // self._time.steps_per_tick
        forces = {"wall": tape.wall_forces()}
        for book, force in tape.forces_opened_before(tick + ticks).items():
            forces[str(book)] = force
            if f"{book}.true" not in self._rows:
                self._open_account(str(book))

        added = np.zeros((len(self._rows), ticks, *self._sums.sums.shape[1:]))
        by_step = self._flows_by_step(tick, plant, tape, forces, into_wall)
        sum_by_tick(((self._rows[name], flow) for name, flow in by_step), added)
        for name in ("moved", "ideal"):
            if name in self._rows:
                added[self._rows[name]] *= 0.5
        sampled_rows = [self._rows[f"{account}.sampled"] for account in forces]
        added[sampled_rows] = self._sampled(tick, ticks, tape, list(forces.values()))
        return added, sampled_rows

    def _flows_by_step(
        self,
        tick: int,
        plant: dict[str, np.ndarray],
        tape: ControllerTape | ControllerTapeArray,
        forces: dict[str, np.ndarray],
        into_wall: float,
    ) -> Iterator[tuple[str, np.ndarray]]:
        """What every plant step adds to each book, by name; twice that for ``moved`` and ``ideal``. Shape (steps,)."""
        n = self._time.steps_per_tick
        x = plant["x"]
        dx = np.diff(x, axis=0) + np.diff(plant["x_low"], axis=0)
        commanded = self._in_effect(plant["command"][:-1].astype(np.intp), tape, forces)
        way_back, moved = -dx, np.zeros_like(dx)
        magnitude = np.empty_like(dx)
        of_plant = zip(self._plant.names, self._plant.increments(tick * n, plant, dx, commanded.values()), strict=True)
        true = ((f"{account}.true", force * way_back) for account, force in commanded.items())
        for name, flow in chain(of_plant, true):
            moved += np.abs(flow, out=magnitude)
            yield name, flow
        yield "moved", moved
        if self._has_wall:
            position, stiffness = (
                first_row(tape.rows(f"wall_{of}", tick, tick + 1)) for of in ("position", "stiffness")
            )
            self._note_wall(first_row(x), (position, stiffness), into_wall)
            force = tape.rows("wall", tick, tick + len(dx) // n)
            springs = ideal_and_undelayed(x, dx, force, (position, stiffness), into_wall, n)
            yield from zip(CAUSES, springs, strict=True)

    @staticmethod
    def _in_effect(
        command: np.ndarray, tape: ControllerTape | ControllerTapeArray, forces: dict[str, np.ndarray]
    ) -> dict[str, np.ndarray]:
        """The force of every account that was commanded over each step, N; 0 before the first command."""
        index = np.maximum(command - tape.first, 0)
        before_first = command < 0
        found = {account: force.take(index, axis=0) for account, force in forces.items()}
        for force in found.values():
            force[before_first] = 0.0
        return found

    def _note_wall(self, x: Any, wall: tuple[Any, Any], into_wall: float) -> None:
        if self._wall and not np.array_equal(wall, self._wall):
            change_J = held_J(x, wall, into_wall) - held_J(x, self._wall, into_wall)
            self.wall_changes_J = self.wall_changes_J + change_J
        self._wall = wall

    @staticmethod
    def _sampled(
        tick: int, ticks: int, tape: ControllerTape | ControllerTapeArray, forces: list[np.ndarray]
    ) -> np.ndarray:
        """-f[k-1] (x_m[k] - x_m[k-1]) for every tick; nothing at the first tick there is."""
        first, end = max(tick - 1, tape.first), tick + ticks
        x_m = tape.rows("x", first, end)
        known = slice(first - tape.first, end - 1 - tape.first)
        added = np.zeros((len(forces), ticks, *x_m.shape[1:]))
        for row, force in zip(added, forces, strict=True):
            row[ticks + 1 - len(x_m) :] = sampled_flow(x_m, force[known])
        return added

    def of_loop(self, loop: int) -> Books:
        """The books of one loop out of those of many."""
        one = copy.copy(self)
        one._sums = self._sums.of_loop(loop)
        one._stored_at_start_J = of_loop(self._stored_at_start_J, loop)
        one.wall_changes_J = of_loop(self.wall_changes_J, loop)
        return one

    def total(self, name: str) -> float:
        """One book as it stands, J."""
        row = self._rows[name]
        return float(self._sums.sums[row] + self._sums.errors[row])

    @property
    def stored_J(self) -> float:
        """Kinetic and spring energy now."""
        return self._stored_at_start_J + self.total("kinetic") + self.total("spring")

    @property
    def moved_J(self) -> float:
        """Energy that changed its place so far."""
        return abs(self._stored_at_start_J) + self.total("moved")

    @property
    def residual_J(self) -> float:
        """What the books leave unexplained, in magnitude."""
        parts = []
        for sign, row in self._balance():
            parts += sign * float(self._sums.sums[row]), sign * float(self._sums.errors[row])
        return abs(math.fsum(parts)) if all(map(math.isfinite, parts)) else math.inf

    def residuals(self, at_ticks: np.ndarray) -> np.ndarray:
        """The signed residual at each tick from the rows that ``book`` returned, shape (ticks,)."""
        signs, rows = zip(*self._balance(), strict=True)
        return sum_in_order((at_ticks[list(rows)] * np.array(signs)[:, None]).T)

    def _balance(self) -> list[tuple[float, int]]:
        """Sign and row of every book that is part of the balance; what a plugin only asked for is not."""
        signs = [(self._sign(name), row) for name, row in self._rows.items()]
        return [(sign, row) for sign, row in signs if sign]

    def _sign(self, name: str) -> float:
        if name == "hand_work":
            return 1.0
        return -1.0 if name in self._plant.names or name.endswith(".true") else 0.0
