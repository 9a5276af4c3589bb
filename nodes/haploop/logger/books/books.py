"""The energy books of a run: plant, wall and every element, sampled and true, and the residual they leave."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.logger.books.buffers import ControllerTape
from haploop.logger.books.one_mass import plant_books
from haploop.logger.books.sums import RunningSums, by_tick, by_tick_of_loops, sum_in_order, sum_rows
from haploop.logger.books.wall_leak import CAUSES, held_J, ideal_and_undelayed
from haploop.logger.books.work import Displacement, in_effect, sampled_flows, wall_at
from haploop.protocol.arrays import first_row
from haploop.protocol.ticks import Timebase

if TYPE_CHECKING:
    from haploop.logger.books.buffers_batch import ControllerTapeArray


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
        self._by_tick = by_tick_of_loops if "loops" in scene else by_tick
        self._sums = RunningSums(*([scene["loops"]] if "loops" in scene else []))
        self._rows: dict[str, int] = {}
        self._balance: list[tuple[float, int]] = []
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
            if sign := self._sign(name):
                self._balance.append((sign, len(self._rows)))
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
        moved = added[self._rows["moved"]]
        displacement = Displacement.of(plant, self._time.steps_per_tick, self._by_tick)
        for name, flow in self._exchanged(tick, plant, displacement, tape.first, forces):
            added[self._rows[name]] = flow
            moved += np.abs(flow)
        moved *= 0.5
        if self._has_wall:
            at_ticks, computed = plant["x"][:: self._time.steps_per_tick], forces["wall"][tick - tape.first :][:ticks]
            self._note_wall(first_row(at_ticks), wall := wall_at(tick, tape), into_wall)
            springs = ideal_and_undelayed(at_ticks, displacement.by_tick, computed, wall, into_wall)
            for name, flow in zip(CAUSES, springs, strict=True):
                added[self._rows[name]] = flow
        sampled_rows = [self._rows[f"{account}.sampled"] for account in forces]
        added[sampled_rows] = sampled_flows(tick, ticks, tape, list(forces.values()))
        return added, sampled_rows

    def _exchanged(
        self,
        tick: int,
        plant: dict[str, np.ndarray],
        moved: Displacement,
        first_command: int,
        forces: dict[str, np.ndarray],
    ) -> Iterator[tuple[str, np.ndarray]]:
        """What every interval adds to each book of the balance, by name; shape (ticks,)."""
        n = self._time.steps_per_tick
        command = plant["command"][:-1].astype(np.intp)
        commanded = (in_effect(force, command, first_command) for force in forces.values())
        of_plant = self._plant.increments(tick * n, plant, moved, commanded, self._by_tick)
        yield from zip(self._plant.names, of_plant, strict=True)
        ways, late = [(0, moved.by_tick)], self._time.delay_steps % n
        if late:
            ways = [(first, self._by_tick(moved.by_step, n, first, end)) for first, end in ((0, late), (late, n))]
        by_interval = command.reshape(-1, n)
        changes = by_interval[:, 1:] != by_interval[:, :-1]
        if late:
            changes[:, late - 1] = False
        uneven = changes.any(axis=1)
        for account, force in forces.items():
            flow = sum_rows(-in_effect(force, command[first::n], first_command) * way for first, way in ways)
            if uneven.any():
                by_step = -in_effect(force, command, first_command) * moved.by_step
                flow[uneven] = self._by_tick(by_step, n)[uneven]
            yield f"{account}.true", flow

    def _note_wall(self, x: Any, wall: tuple[Any, Any], into_wall: float) -> None:
        if self._wall and not np.array_equal(wall, self._wall):
            change_J = held_J(x, wall, into_wall) - held_J(x, self._wall, into_wall)
            self.wall_changes_J = self.wall_changes_J + change_J
        self._wall = wall

    def of_loops(self, loops: np.ndarray) -> Books:
        """The books of some loops, whose places are ``loops``, out of those of many."""
        some = copy.copy(self)
        some._sums = self._sums.of_loops(loops)
        some._stored_at_start_J, some.wall_changes_J = (
            np.broadcast_to(value, self._sums.sums.shape[1:])[loops]
            for value in (self._stored_at_start_J, self.wall_changes_J)
        )
        return some

    def total(self, name: str) -> Any:
        """One book as it stands, J; shape (loops,) where there are many."""
        row = self._rows[name]
        total = self._sums.sums[row] + self._sums.errors[row]
        return total if total.shape else float(total)

    @property
    def stored_J(self) -> Any:
        """Kinetic and spring energy now."""
        return self._stored_at_start_J + self.total("kinetic") + self.total("spring")

    @property
    def moved_J(self) -> Any:
        """Energy that changed its place so far."""
        return abs(self._stored_at_start_J) + self.total("moved")

    @property
    def residual_J(self) -> Any:
        """What the books leave unexplained, in magnitude."""
        parts = [sign * of[row] for sign, row in self._balance for of in (self._sums.sums, self._sums.errors)]
        columns = np.array(parts)
        if columns.ndim == 1:
            return _magnitude(columns.tolist())
        return np.array([_magnitude(of_one) for of_one in columns.T.tolist()])

    def residuals(self, at_ticks: np.ndarray) -> np.ndarray:
        """The signed residual at each tick from the rows that ``book`` returned, shape (ticks,)."""
        signs, rows = zip(*self._balance, strict=True)
        return sum_in_order((at_ticks[list(rows)] * np.array(signs)[:, None]).T)

    def _sign(self, name: str) -> float:
        """How a book counts in the balance, 0 where it is no part of it."""
        if name == "hand_work":
            return 1.0
        return -1.0 if name in self._plant.names or name.endswith(".true") else 0.0


def _magnitude(parts: list[float]) -> float:
    return abs(math.fsum(parts)) if all(map(math.isfinite, parts)) else math.inf
