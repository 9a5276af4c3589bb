"""The energy books of a run or a batch: plant, wall, every element, sampled and true, and the residual."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.logger.books.balance import BooksState, balance, balance_sign
from haploop.logger.books.ideal_wall import CAUSES, DISSIPATED, dissipated, ideal_walls, inside, leak_books
from haploop.logger.books.one_mass import OneMassBooks
from haploop.logger.books.work import (
    CLOSING,
    BatchSums,
    Displacement,
    add_columns,
    add_ticks_of_batch,
    by_interval,
    displacement,
    in_effect,
    no_sums,
    sampled_work,
    sum_rows,
    sum_steps,
    with_rows,
)
from haploop.protocol.arrays import first_row
from haploop.protocol.scene.scene import Scene, hand_is_unmodelled
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_leaves, tree_select
from haploop.protocol.walls.registry import class_of

if TYPE_CHECKING:
    from haploop.logger.books.buffers import Commanded
    from haploop.logger.books.by_device import BooksByDevice
    from haploop.logger.books.chain import ChainBooks
    from haploop.logger.books.closing import ClosingBooks
    from haploop.protocol.walls.wall import Wall

    PlantBooks = OneMassBooks | ChainBooks | BooksByDevice | ClosingBooks


class Books:
    """Running energies in joules; positive for the wall and the elements means taken out of the device.

    sampled  E += -f[k-1] (x_m[k] - x_m[k-1]) at tick k, all the controller can know (Choi et al. 2022, eq. 4)
    true     E += -f_applied (x[s+1] - x[s]) at every plant step: exact, since the applied force is held
    The residual is hand work - heats - change of stored energy - all true books. ``moved`` is the energy that changed
    its place: half of the sum of the magnitudes of all changes (each joule leaves one book and enters another), plus
    the energy stored at the start.

    Args:
        members: number of members of the batch; None for one run, whose arrays have no axis for members.
    """

    def __init__(self, scene: Scene, time: Timebase, members: int | None = None) -> None:
        self._time = time
        self.plant = plant_books(scene, time, members)
        self._displacement, self._add_ticks = displacement, add_ticks_of_batch
        self._leak = leak_books(class_of(scene.wall)) if scene.wall else ()
        names = [*self.plant.names, *self._leak, "moved"]
        self.state = BooksState((), no_sums(0, members), 0.0, None, 0.0)
        self._open([*names, *_of_account("wall")])

    @property
    def names(self) -> tuple[str, ...]:
        """All books, in the order of the rows of the sums."""
        return self.state.names

    def sum_by(self, loops: BatchSums) -> None:
        """Lets ``loops`` sum the books of a batch, with bit-identical results; call before anything is booked."""
        self._displacement, self._add_ticks = loops.displacement, loops.add_ticks
        if isinstance(self.plant, OneMassBooks):
            self.plant.energies = loops.energies

    def _open(self, names: Sequence[str]) -> None:
        all_names = (*self.state.names, *names)
        self.state = self.state._replace(names=all_names, sums=with_rows(self.state.sums, len(all_names)))

    def start(self, plant: dict[str, np.ndarray]) -> None:
        """Starts the books with the plant in the first state of its first columns."""
        self.state = self.state._replace(stored_at_start_J=self.plant.stored_J(plant))

    def book(self, tick: int, plant: dict[str, np.ndarray], commanded: Commanded) -> np.ndarray:
        """Books the intervals of one run from ``tick`` on that ``plant`` covers.

        Args:
            plant: telemetry columns of the plant, shape (ticks * n + 1,) each.

        Returns:
            The totals of the books at each of these ticks, shape (rows, ticks), rows as ``names``: true and plant books
            up to the tick's step, sampled books including the tick's sample.
        """
        flows = self._flows(tick, plant, commanded)
        sums, totals = add_columns(self.state.sums, np.stack(flows))
        self.state = self.state._replace(sums=sums)
        at_ticks = totals[:, :-1]
        sampled = [row for row, name in enumerate(self.state.names) if name.endswith(".sampled")]
        at_ticks[sampled] = totals[sampled, 1:]
        return at_ticks

    def book_batch(self, tick: int, plant: dict[str, np.ndarray], commanded: Commanded) -> None:
        """Books the intervals of a batch from ``tick`` on; columns have a last axis for the members."""
        flows = self._flows(tick, plant, commanded)
        self.state = self.state._replace(sums=self._add_ticks(self.state.sums, np.stack(flows, axis=1)))

    def _flows(self, tick: int, plant: dict[str, np.ndarray], commanded: Commanded) -> list[np.ndarray]:
        """Returns the energy each tick adds to each book, shape (ticks,), or (ticks, batch), ordered as ``names``."""
        n, forces, before = self._time.steps_per_tick, commanded.forces, tick - commanded.first
        for account in forces:
            if f"{account}.true" not in self.state.names:
                self._open(_of_account(account))
        way = self._displacement(plant["x"], plant["x_low"], n, sum_steps)
        ticks = len(way.by_tick)
        flows: dict[str, np.ndarray] = dict(self._exchanged(tick, plant, way, commanded.first, forces))
        if CLOSING in flows:
            flows[CLOSING] = sum_rows(-sign * flow for name, flow in flows.items() if (sign := balance_sign(name)))
        flows["moved"] = _half_of_magnitudes(flows.values())
        if self._leak:
            at_ticks, wall = plant["x"][::n], commanded.wall
            self._note_wall(first_row(at_ticks), wall)
            computed = forces["wall"][before : before + ticks]
            ideal = ideal_walls(wall, at_ticks, plant["v"][::n], way.by_tick, computed)
            flows |= zip(CAUSES, ideal, strict=True)
            if DISSIPATED in self._leak:
                by_step = dissipated(wall, plant["x"], plant["v"], self._time.step_s)
                flows[DISSIPATED] = sum_steps(by_interval(by_step, n))
        known = slice(max(before - 1, 0), before + ticks)
        none: np.ndarray = np.zeros_like(way.by_tick)
        for account, force in forces.items():
            work = sampled_work(commanded.x_m[known], force[known][:-1])
            # The very first tick has no sampled work.
            flows[f"{account}.sampled"] = work if len(work) == ticks else np.concatenate([none[:1], work])
        return [flows.get(name, none) for name in self.state.names]

    def _exchanged(
        self,
        tick: int,
        plant: dict[str, np.ndarray],
        moved: Displacement,
        first_command: int,
        forces: dict[str, np.ndarray],
    ) -> Iterator[tuple[str, np.ndarray]]:
        """Yields every book of the balance by name, with the energy each interval adds to it, shape (ticks,)."""
        n = self._time.steps_per_tick
        command = plant["command"][:-1].astype(np.intp)
        asked = (in_effect(force, command, first_command) for force in forces.values())
        yield from zip(self.plant.names, self.plant.increments(tick * n, plant, moved, asked), strict=True)
        ways, late = [(0, moved.by_tick)], self._time.delay_steps % n
        if late:
            ways = [(first, sum_steps(moved.by_step, first, end)) for first, end in ((0, late), (late, n))]
        by_tick = command.reshape(-1, n)
        changes = by_tick[:, 1:] != by_tick[:, :-1]
        if late:
            changes[:, late - 1] = False
        uneven = changes.any(axis=1)
        for account, force in forces.items():
            flow = sum_rows(-in_effect(force, command[first::n], first_command) * way for first, way in ways)
            if uneven.any():
                by_step = -by_interval(in_effect(force, command, first_command), n) * moved.by_step
                flow[uneven] = sum_steps(by_step)[uneven]
            yield f"{account}.true", flow

    def _note_wall(self, x: Any, wall: Wall) -> None:
        before = self.state.wall
        if before and not all(map(np.array_equal, tree_leaves(wall), tree_leaves(before))):
            change_J = wall.stored(inside(wall, x)) - before.stored(inside(before, x))
            self.state = self.state._replace(wall_changes_J=self.state.wall_changes_J + change_J)
        self.state = self.state._replace(wall=wall)

    def select(self, kept: np.ndarray) -> None:
        """Drops the members of a batch for which ``kept``, shape (members,), is false."""
        self.state = tree_select(self.state, kept)
        self.plant.select(kept)

    def residuals(self, at_ticks: np.ndarray) -> dict[str, np.ndarray]:
        """Returns the signed ``residual`` at each tick from the rows that ``book`` returned, shape (ticks,), J.

        Where one book closes the balance, the result is empty.
        """
        if CLOSING in self.state.names:
            return {}
        return {"residual": sum_rows(sign * at_ticks[row] for sign, row in balance(self.state.names))}


def plant_books(scene: Scene, time: Timebase, members: int | None = None) -> PlantBooks:
    """Returns the books of a scene's plant: one mass under held forces, a chain, or a device in an unmodelled hand.

    Their integrals are those of the exact motion from each recorded state on. With another ``clock.integrator``, the
    energy by which its next state differs is in no book: the residual is then the energy error of the method.
    """
    if hand_is_unmodelled(scene):
        from haploop.logger.books.closing import ClosingBooks

        return ClosingBooks(scene, time)
    lags = scene.actuator is not None and scene.actuator.bandwidth is not None
    grips = scene.hand is not None and scene.hand.grip is not None
    if lags or grips or scene.friction or scene.transmission:
        if members is not None and scene.friction:
            from haploop.logger.books.by_device import books_of_batch

            return books_of_batch(scene, time, members)
        from haploop.logger.books.chain import ChainBooks

        return ChainBooks(scene, time, members)
    return OneMassBooks(scene, time, members)


def _half_of_magnitudes(flows: Iterable[np.ndarray]) -> np.ndarray:
    first, *others = flows
    total, magnitude = np.abs(first), np.empty_like(first)
    for flow in others:
        total += np.abs(flow, out=magnitude)
    total *= 0.5
    return total


def _of_account(name: str) -> tuple[str, str]:
    return f"{name}.sampled", f"{name}.true"
