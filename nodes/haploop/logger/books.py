"""The energy books of a run: plant, wall and every element, sampled and true, and the residual they leave."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from haploop.logger.plant_books import plant_books
from haploop.logger.sums import RunningSums, sum_in_order, sum_rows
from haploop.logger.tapes import ControllerTape
from haploop.logger.wall_books import CAUSES, held_J, ideal_and_undelayed
from haploop.protocol.ticks import Timebase


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
        self._sums = RunningSums()
        self._rows: dict[str, int] = {}
        self._open([*self._plant.names, *(CAUSES if self._has_wall else ()), "moved"])
        self._accounts = 0
        self._open_account("wall")
        self._stored_at_start_J = 0.0
        self._wall: tuple[float, float] | None = None
        self.wall_changes_J = 0.0

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
            tick: first interval.
            plant: telemetry columns of the plant with ticks * n + 1 rows.
            tape: controller rows of these ticks and of all commands in effect in them.
            into_wall: direction into the wall, +1 or -1.

        Returns:
            The books as they stand at each of these ticks, shape (rows, ticks), rows as ``names``: true and plant
            books up to the tick's step, sampled books with the tick's sample.
        """
        n = self._time.steps_per_tick
        ticks = (len(plant["x"]) - 1) // n
        forces = {"wall": tape.columns["wall"]}
        for book, force in tape.forces_opened_before(tick + ticks).items():
            forces[str(book)] = force
            if f"{book}.true" not in self._rows:
                self._open_account(str(book))

        by_step = self._flows_by_step(tick, plant, tape, forces, into_wall)
        added = np.zeros((len(self._rows), ticks))
        rows = [self._rows[name] for name in by_step]
        added[rows] = sum_in_order(np.stack(list(by_step.values())).reshape(len(rows), ticks, n))
        sampled_rows = [self._rows[f"{account}.sampled"] for account in forces]
        added[sampled_rows] = self._sampled(tick, ticks, tape, np.stack(list(forces.values())))

        totals = self._sums.add(added)
        at_ticks = totals[:, :-1]
        at_ticks[sampled_rows] = totals[sampled_rows, 1:]
        return at_ticks

    def _flows_by_step(
        self,
        tick: int,
        plant: dict[str, np.ndarray],
        tape: ControllerTape,
        forces: dict[str, np.ndarray],
        into_wall: float,
    ) -> dict[str, np.ndarray]:
        """What every plant step adds to each book, by name; arrays of shape (steps,)."""
        n = self._time.steps_per_tick
        x = plant["x"]
        dx = np.diff(x) + np.diff(plant["x_low"])
        commanded = self._in_effect(plant["command"][:-1].astype(np.intp), tape, forces)
        plant_flows = self._plant.increments(tick * n, plant, dx, commanded.values())
        by_step = dict(zip(self._plant.names, plant_flows, strict=True))
        by_step |= {f"{account}.true": -force * dx for account, force in commanded.items()}
        by_step["moved"] = sum_rows(np.abs(flow) for flow in by_step.values()) / 2.0
        if self._has_wall:
            at = tick - tape.first
            rows = {
                name: tape.columns[name][at : at + len(dx) // n] for name in ("wall", "wall_position", "wall_stiffness")
            }
            self._note_wall(float(x[0]), (float(rows["wall_position"][0]), float(rows["wall_stiffness"][0])), into_wall)
            by_step |= zip(CAUSES, ideal_and_undelayed(x, dx, rows, into_wall, n), strict=True)
        return by_step

    @staticmethod
    def _in_effect(command: np.ndarray, tape: ControllerTape, forces: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """The force of every account that was commanded over each step, N; 0 before the first command."""
        index = np.maximum(command - tape.first, 0)
        before_first = command < 0
        found = {account: force[index] for account, force in forces.items()}
        for force in found.values():
            force[before_first] = 0.0
        return found

    def _note_wall(self, x: float, wall: tuple[float, float], into_wall: float) -> None:
        if self._wall and wall != self._wall:
            self.wall_changes_J += held_J(x, wall, into_wall) - held_J(x, self._wall, into_wall)
        self._wall = wall

    @staticmethod
    def _sampled(tick: int, ticks: int, tape: ControllerTape, forces: np.ndarray) -> np.ndarray:
        """-f[k-1] (x_m[k] - x_m[k-1]) for every tick; nothing at the first tick there is."""
        at = tick - tape.first
        if at == 0:
            known = tape.columns["x"][:ticks]
            return np.concatenate([np.zeros((len(forces), 1)), forces[:, : ticks - 1] * -np.diff(known)], axis=1)
        return forces[:, at - 1 : at + ticks - 1] * -np.diff(tape.columns["x"][at - 1 : at + ticks])

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
