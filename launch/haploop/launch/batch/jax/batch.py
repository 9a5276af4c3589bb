"""A batch that compiled programs advance through all ticks at which nothing else changes."""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable, Sequence
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from haploop.controller.recorder import Row
from haploop.controller.tick import NoForce
from haploop.launch.batch.batch import Batch
from haploop.launch.batch.jax.block import RINGS, Block, BlockInputs, Carry, Numbers, Rings, constants_of, numbers_of
from haploop.launch.batch.jax.programs import Call, Programs
from haploop.launch.batch.jax.tick import BatchParams, BatchState, Forces, NotCompilable, TickInputs
from haploop.launch.batch.jax.window import CompiledWindow
from haploop.launch.batch.stacking import structure
from haploop.logger.books.one_mass import OneMassBooks
from haploop.logger.books.work import Sums
from haploop.plant.line.actuator import ActuatedLine
from haploop.plant.motion.one_mass import OneMassMotion
from haploop.plant.plant import beyond
from haploop.plant.sensing.noise import NoisyPositionSensor
from haploop.plant.streams import Draw, NormalRows
from haploop.protocol.arrays import rows_of
from haploop.protocol.scene.scene import Scene
from haploop.protocol.trees import tree_leaves, tree_map, tree_unflatten

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

# The most ticks that a program goes through at a time: to begin takes as long as several ticks of some hundred members;
# with many members the hand's forces, if each has its own, would fill the memory.
_BLOCK_TICKS, _BLOCK_TICKS_OF_MANY, _MANY = 512, 128, 1024


class CompiledBatch(Batch):
    """``Batch`` that goes uncompiled only at its start and at a change, until all that is in effect is known.

    Args:
        size: size of the arrays; places beyond the scenes are computed, but ignored.
    """

    def __init__(
        self, scenes: Sequence[Scene], kinds: dict[str, type[Element]], *, energy: bool, size: int,
        programs: Programs,
    ) -> None:  # fmt: skip
        super().__init__([*scenes, *[scenes[-1]] * (size - len(scenes))], kinds, energy=energy)
        books = self._logger.books.plant if self._logger.books else None
        if not isinstance(self._motion, OneMassMotion) or not isinstance(books, OneMassBooks | None):
            raise NotCompilable("There are several bodies.")
        self._plant_books = books
        self._ended[len(scenes) :] = True
        self._programs = programs
        self._key: Hashable = structure(scenes[0]), frozenset(kinds.items()), energy
        self._has_wall = scenes[0].wall is not None
        self._noisy = self._position if isinstance(self._position, NoisyPositionSensor) else None
        self._actuated = self._line if isinstance(self._line, ActuatedLine) else None
        self._delay: Any = self._actuated.line if self._actuated else self._line
        resolution = self._logger.window.swing_m
        self._block = max(1, min(self._time.ticks, _BLOCK_TICKS if size <= _MANY else _BLOCK_TICKS_OF_MANY))
        self._window = self._logger.window = CompiledWindow(self._time, resolution, size, spare_ticks=self._block)
        # A batch in which only the program changes anything needs the window at its end, unless a member diverges.
        self._keep_from = 0 if self._changes else max(0, self._end - self._window.kept_ticks)

    def _drop_ended(self) -> None:
        """Drops nothing: the size stays."""

    def run(self) -> None:
        """Runs all members to their ends; on NotCompilable the results are void."""
        tick = 0
        with np.errstate(all="ignore"):
            while tick < self._end and not self._ended.all():
                until = min([self._end, *(change for change in self._changes if change > tick)])
                tick = self._by_itself(tick, until)
                if self._was_refused():
                    return
                if tick < until:
                    self._by_program(tick, until)
                    tick = until
            if self._end:
                whole = self._end == self._time.ticks
                self._finish(np.flatnonzero(~self._ended), "done" if whole else "stopped")
            self._programs.spare = self._window.rings

    def _by_itself(self, first: int, until: int) -> int:
        """Continues until all forces still in effect are from elements at work; returns the tick reached."""
        end = min(first + self._time.lookahead_ticks + 2, until)
        self._book()
        for tick in range(first, end):
            self._work(tick)
            self._look_for_ends(tick)
        self._book()
        return end

    def _by_program(self, first: int, until: int) -> None:
        params, state = self._params(), self._state()
        x = self._window.state.x.reshape(-1, self._time.steps_per_tick, len(self._ended))
        rings = Rings(x, {name: self._window.state.rows[name] for name in RINGS})
        # What no block changes is handed over once: otherwise this would take a millisecond of every block.
        fixed = jax.device_put((numbers_of(params), np.asarray(self._limit_m)))
        carry, inputs = self._carry(first, state), self._inputs(params, fixed, first, first)
        call = self._call(params, state, (carry, rings, inputs))
        rings, done = self._programs.begun(rings, first), first
        before = deque[tuple[Carry, BlockInputs]](maxlen=-(-self._window.kept_ticks // self._block) + 1)
        while done < until and not self._ended.all():
            end = min(done + self._block, until)
            if done - first < len(self._window.state.rows["wall_position"]):  # beyond, it is already written
                ring = self._window.state.rows["wall_position"]
                ring[np.arange(done, end) % len(ring)] = self._controller.params.wall.position
            inputs = self._inputs(params, fixed, done, end)
            before.append((carry, inputs))
            carry, rings = call(carry, rings, inputs)
            done = end
            new = np.logical_not(carry.running) & ~self._ended
            if new.any() and self._keep_from:
                carry, rings = self._again(call, before, rings)
            if new.any() or done == until:
                self._take_state(carry, state, done)
                self._fetch(carry, rings, writable=done == until < self._end)
                self._report_ends(new, first + np.asarray(carry.ticks))
        self._controller.tick += done - first
        self._resume(carry, done)

    def _again(self, call: Call, before: Sequence[tuple[Carry, BlockInputs]], rings: Rings) -> tuple[Carry, Rings]:
        """Goes through the last blocks again, for the windows of members that ended; from now on all is kept."""
        self._keep_from = 0
        carry, _ = next(iter(before))
        for _, inputs in before:
            carry, rings = call(carry, rings, inputs._replace(keep_from=np.int64(0)))
        return carry, rings

    def _call(self, params: BatchParams, state: BatchState, args: tuple[Carry, Rings, BlockInputs]) -> Call:
        carry, _, inputs = args
        elements = tuple(type(active.element) for active in params.controller.elements)
        shapes = tuple((np.shape(a), getattr(a, "dtype", type(a))) for a in jax.tree.leaves((carry, inputs)))
        key = self._key, elements, constants_of(params), shapes
        names = tuple(self._plant_books.names) if self._plant_books else ()
        block = Block(params, state, names, self._has_wall)
        try:
            call = self._programs.call(key, block.run, args)
        except NoForce as error:
            raise NotCompilable(error.sentence(params.controller, self._controller.tick)) from error
        self._elements.check()
        return call

    # The batch as numbers, and back

    def _params(self) -> BatchParams:
        motion, books = self._motion, self._plant_books
        return BatchParams(
            motion.held,
            motion.mechanics,
            motion.response.transition,
            motion.response.rest_N,
            self._actuated.actuator if self._actuated else None,
            self._position.encoder,
            self._noisy.noise if self._noisy else None,
            self._feels,
            *divmod(self._time.delay_steps, self._time.steps_per_tick),
            self._controller.params,
            books.params if books else None,
        )

    def _state(self) -> BatchState:
        """Returns everything remembered, with a number for every member in each leaf."""
        assert self._controller.state is not None
        state = BatchState(
            self._motion.state,
            self._motion.last[1],
            self._actuated.state[3] if self._actuated else 0,
            self._noisy.state[1] if self._noisy else 0.0,
            self._controller.state,
        )
        members = len(self._ended)

        def of_each(leaf: Any) -> np.ndarray:
            return np.broadcast_to(leaf, (*np.shape(leaf)[:-1], members)).copy()

        return tree_map(of_each, state)

    def _take_state(self, carry: Carry, template: BatchState, end: int) -> None:
        """Puts the objects of the batch into the state that the program has reached at tick ``end``."""
        motion, acting, saturated, noise, controller = tree_unflatten(template, map(np.array, carry.state))
        newest = end - 1 - self._time.delay_steps // self._time.steps_per_tick
        self._motion.state, self._motion.last = motion, (0, acting, newest)
        self._controller.state = controller
        commands = [row["command"] for row in self._last(carry, end)]
        line = newest, tuple(commands)
        if self._actuated:
            self._actuated.restore((line, newest, acting, saturated))
        else:
            self._line.restore(line)
        if self._noisy:
            self._noisy.go_on(end, noise)
        self._in_flight.extend(commands)

    def _inputs(self, params: BatchParams, fixed: tuple[Numbers, Any], first: int, end: int) -> BlockInputs:
        n, response = self._time.steps_per_tick, self._motion.response
        tau = response.tau.at_steps(first * n, (first + self._block) * n + 1)
        shared = None
        if response.is_shared and params.held.shape[-1] == 1:
            shared = response.between(first, self._block).transpose(2, 1, 0, 3)
        noise = self._rows_of(self._noisy.draw, end - first) if self._noisy else None
        ticks_in = TickInputs(tau, shared, noise, np.int64(0))
        return BlockInputs(*fixed, ticks_in, np.int64(first), np.int64(end - first), np.int64(self._keep_from))

    def _rows_of(self, draw: Draw, ticks: int) -> np.ndarray:
        """Returns the next random numbers, shape (block,) or (block, members)."""
        one_for_all = not isinstance(draw, NormalRows)
        rows = np.zeros((self._block, *([] if one_for_all else [len(self._ended)])))
        for row in range(ticks):
            rows[row] = draw()
        return rows

    def _carry(self, tick: int, state: BatchState) -> Carry:
        members, books, window = len(self._ended), self._logger.books, self._window
        sums = {}
        if books:
            sums = dict(zip(books.names, zip(*books.state.sums, strict=True), strict=True))
        extremes = window.state.x_min_m, window.state.x_max_m, window.state.force_max_N
        x_m = np.broadcast_to(self._logger.rows[-1].columns["x"], members) if books else np.zeros(members)
        none = np.zeros(members, np.int64)
        return Carry(tree_leaves(state), ~self._ended, none, extremes, sums, x_m, self._past(tick))

    def _past(self, tick: int) -> Forces:
        members = len(self._ended)
        columns: dict[str, list[Any]] = {"command": self._delay.in_flight(tick)}
        if self._logger.books:
            rows = self._logger.rows
            columns["wall"] = [row.columns["wall"] for row in rows]
            columns |= {str(book): [row.forces[book] for row in rows] for book in rows[-1].forces}
        past = {}
        for name, column in columns.items():
            past[name] = np.zeros((len(column) + 1, members))
            past[name][np.arange(tick - len(column), tick) % (len(column) + 1)] = rows_of(column, members)
        return past

    def _last(self, carry: Carry, tick: int) -> list[dict[str, np.ndarray]]:
        """Returns the forces of the ticks before ``tick`` whose command has yet to act, or was the last to act."""
        past = {name: np.asarray(ring) for name, ring in carry.past.items()}
        size = len(past["command"])
        return [{name: ring[k % size].copy() for name, ring in past.items()} for k in range(tick - size + 1, tick)]

    def _fetch(self, carry: Carry, rings: Rings, *, writable: bool) -> None:
        """Hands what the program has kept to the logger."""
        window, books = self._window, self._logger.books
        window.take(rings, writable=writable)
        least, most, strongest = map(np.array, carry.extremes)
        window.state = window.state._replace(x_min_m=least, x_max_m=most, force_max_N=strongest)
        if books:
            sums = Sums(*(np.stack(part) for part in zip(*(carry.books[name] for name in books.names), strict=True)))
            books.state = books.state._replace(sums=sums)

    def _report_ends(self, new: np.ndarray, ticks: np.ndarray) -> None:
        x, limit_m = self._motion.x, np.broadcast_to(self._limit_m, new.shape)
        for end in np.unique(ticks[new]).tolist():
            places = np.flatnonzero(new & (ticks == end))
            self._log_stands_at(end)
            where = zip(x[places].tolist(), limit_m[places].tolist(), strict=True)
            self._finish(places, "diverged", [f"{beyond(*at)}, at tick {end}" for at in where])
        self._ended = self._ended | new

    def _log_stands_at(self, tick: int) -> None:
        self._logger.tick = tick
        self._window.state = self._window.state._replace(steps=tick * self._time.steps_per_tick)
        self._logger.note_accounts(self._rows.elements)

    def _resume(self, carry: Carry, tick: int) -> None:
        self._log_stands_at(tick)
        if self._logger.books:
            elements, self._logger.rows = self._rows.elements, []
            for forces in self._last(carry, tick):
                columns: dict[str, float | np.ndarray] = {"x": np.array(carry.x_m), "wall": forces.pop("wall")}
                del forces["command"]
                of_books = {int(book): force for book, force in forces.items()}
                self._logger.rows.append(Row(columns, of_books, elements))
