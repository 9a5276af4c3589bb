"""Many loops of one structure, taken by compiled programs through all ticks at which nothing else changes."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from haploop.controller.recorder import Row
from haploop.launch.batch.batch import LoopArray
from haploop.launch.batch.jax.block import RINGS, Block, Carry, Given, Rings
from haploop.launch.batch.jax.books import Forces
from haploop.launch.batch.jax.programs import Program, Programs
from haploop.launch.batch.jax.stand_ins import Outside
from haploop.launch.batch.jax.tick import NoTick, Tick
from haploop.launch.batch.jax.window import CompiledWindow
from haploop.launch.batch.stacking import structure
from haploop.logger.books.chain import ChainBooks
from haploop.logger.books.sums import Sums
from haploop.plant.motion.one_mass import OneMassMotion
from haploop.plant.plant import beyond
from haploop.plant.random.streams import Draw, NormalRows
from haploop.protocol.arrays import rows_of

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

# Ticks that a program goes through at a time.
BLOCK_TICKS = 128
# After so many ticks in which the structure of its objects kept changing a loop is not compiled.
_SETTLED_TICKS = 512


class CompiledLoops(LoopArray):
    """``LoopArray`` that goes by itself only where a change, or the start, alters what the loop's objects are.

    Args:
        scenes, kinds, energy: as there.
        size: of the arrays; places beyond the scenes are computed, unheeded.
        programs: where compiled blocks are kept.
    """

    def __init__(
        self, scenes: Sequence[dict[str, Any]], kinds: dict[str, type[Element]], *, energy: bool, size: int,
        programs: Programs,
    ) -> None:  # fmt: skip
        super().__init__([*scenes, *[scenes[-1]] * (size - len(scenes))], kinds, energy=energy)
        self._ended[len(scenes) :] = True
        self._programs = programs
        self._key = structure(scenes[0]), frozenset(kinds.items()), energy
        self._has_wall = "wall" in scenes[0]
        resolution = self._logger.window.swing_m
        self._window = self._logger.window = CompiledWindow(self._time, resolution, size, spare_ticks=BLOCK_TICKS)
        # A loop of which only the program changes anything needs the window at its end, unless it diverges.
        self._keep_from = 0 if self._changes else max(0, self._end - self._window.kept_ticks)

    def _drop_ended(self) -> None:
        """The size stays."""

    def run(self) -> None:
        """Run all loops to their ends.

        Raises:
            NoTick: the loops cannot be compiled; their results are void.
        """
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

    def _by_itself(self, tick: int, until: int) -> int:
        """Go on until a tick leaves the structure as it was and all forces still in effect are of elements at work."""
        settled, before = tick + self._time.lookahead_ticks + 2, None
        for _ in range(_SETTLED_TICKS):
            if tick in self._changes:
                self._book()
            self._work(tick)
            self._look_for_ends(tick)
            tick += 1
            if tick < min(settled - 1, until):
                continue
            self._book()
            now = self._shapes(tick)
            if tick == until or (tick >= settled and now == before):
                return tick
            before = now
        raise NoTick("what the loop remembers keeps growing")

    def _shapes(self, tick: int) -> Any:
        at = self._tick(tick)
        at.release(at.leaves.data, at.leaves.whole, at.commands, 0)
        return at.leaves.shapes(), len(at.leaves.whole)

    def _tick(self, tick: int) -> Tick:
        motion, books = self._motion, self._logger.books.plant if self._logger.books else None
        if not isinstance(motion, OneMassMotion) or isinstance(books, ChainBooks):
            raise NoTick("there are several bodies")
        return Tick(tick, motion, self._line, self._position, self._feels, self._controller, self._rows, books)

    def _by_program(self, first: int, until: int) -> None:
        tick = self._tick(first)
        given, carry = self._given(tick, first, first), self._carry(tick)
        key = (
            *self._key,
            tuple(tick.leaves.whole),
            *((np.shape(a), np.result_type(a)) for a in jax.tree.leaves((tick.leaves.data, given, carry))),
        )
        program = self._programs.known(key)
        block = program.block if program else Block(tick, self._logger.books is not None, self._has_wall)
        if not program:
            block.learn(given.outside._replace(commands=tuple(tick.commands[:2])))
        changing, constant = block.split(tick.leaves.data)
        carry = carry._replace(changing=changing)
        given = given._replace(constant=constant)
        rings = self._rings()
        program = program or self._programs.compiled(key, block, (carry, rings, given))
        rings = self._programs.begun(rings, first)
        done, data = first, tick.leaves.data
        before = deque[tuple[Carry, Given]](maxlen=-(-self._window.kept_ticks // BLOCK_TICKS) + 1)
        while done < until and not self._ended.all():
            end = min(done + BLOCK_TICKS, until)
            if done - first < len(self._window.state.rows["wall_position"]):  # beyond, what would be written is there
                self._note_wall_position(done, end)
            given = self._given(tick, done, end)._replace(constant=constant)
            before.append((carry, given))
            carry, rings = program.call(carry, rings, given)
            done = end
            new = np.logical_not(carry.running) & ~self._ended
            if new.any() and self._keep_from:
                carry, rings = self._again(program, before, rings)
            if new.any() or done == until:
                data = block.join([np.array(leaf) for leaf in carry.changing], constant)
                tick.put(data, [row["command"] for row in self._last(carry, done)], done - first)
                self._in_flight.extend(row["command"] for row in self._last(carry, done))
                self._fetch(carry, rings, writable=done == until < self._end)
                self._report_ends(new, first + np.asarray(carry.ticks))
        whole = [value + count * (done - first) for value, count in zip(tick.leaves.whole, block.counts, strict=True)]
        commands = [row["command"] for row in self._last(carry, done)]
        tick.release(data, whole, commands, done - first)
        self._resume(carry, done)

    def _again(self, program: Program, before: Iterable[tuple[Carry, Given]], rings: Rings) -> tuple[Carry, Rings]:
        """Go through the last blocks once more, for the windows of loops that ended; from now on all is kept."""
        self._keep_from = 0
        carry = None
        for start, given in before:
            carry, rings = program.call(carry or start, rings, given._replace(keep_from=np.int64(0)))
        assert carry
        return carry, rings

    def _given(self, tick: Tick, first: int, end: int) -> Given:
        """What the program is given for the ticks first ... end - 1."""
        n, ticks = self._time.steps_per_tick, BLOCK_TICKS
        tau = tick.tau.at_steps(first * n, (first + ticks) * n + 1)
        response = None
        if tick.is_shared:
            response = tick.responses(first, ticks)
        noise = tuple(self._rows_of(draw, end - first) for draw in tick.draws)
        limit_m = np.asarray(self._limit_m)
        outside = Outside(tau, response, noise, np.int64(0))
        return Given([], limit_m, outside, np.int64(first), np.int64(end - first), np.int64(self._keep_from))

    def _rows_of(self, draw: Draw, ticks: int) -> np.ndarray:
        """The next random numbers, shape (BLOCK_TICKS,) or (BLOCK_TICKS, loops)."""
        one_for_all = not isinstance(draw, NormalRows)
        rows = np.zeros((BLOCK_TICKS, *([] if one_for_all else [len(self._ended)])))
        for row in range(ticks):
            rows[row] = draw()
        return rows

    def _carry(self, tick: Tick) -> Carry:
        """Where a program begins, but for the leaves."""
        loops, books, window = len(self._ended), self._logger.books, self._window
        sums = {}
        if books:
            sums = dict(zip(books.names, zip(*books.state.sums, strict=True), strict=True))
        extremes = window.state.x_min_m, window.state.x_max_m, window.state.force_max_N
        x_m = np.broadcast_to(self._logger.rows[-1].columns["x"], loops) if books else np.zeros(loops)
        return Carry([], ~self._ended, np.zeros(loops, np.int64), extremes, sums, x_m, self._past(tick))

    def _past(self, tick: Tick) -> Forces:
        """Commands on their way, and the forces that go with them."""
        loops = len(self._ended)
        columns: dict[str, list[Any]] = {"command": tick.commands}
        if self._logger.books:
            rows = self._logger.rows
            columns["wall"] = [row.columns["wall"] for row in rows]
            columns |= {str(book): [row.forces[book] for row in rows] for book in rows[-1].forces}
        past = {}
        for name, column in columns.items():
            past[name] = np.zeros((len(column) + 1, loops))
            past[name][np.arange(tick.at - len(column), tick.at) % (len(column) + 1)] = rows_of(column, loops)
        return past

    def _rings(self) -> Rings:
        """Where a program begins with what windows are read from."""
        x = self._window.state.x.reshape(-1, self._time.steps_per_tick, len(self._ended))
        return Rings(x, {name: self._window.state.rows[name] for name in RINGS})

    def _last(self, carry: Carry, tick: int) -> list[dict[str, np.ndarray]]:
        """The forces of the ticks before ``tick`` of which a command has yet to act, or is the last to have acted."""
        past = {name: np.asarray(ring) for name, ring in carry.past.items()}
        size = len(past["command"])
        return [{name: ring[k % size].copy() for name, ring in past.items()} for k in range(tick - size + 1, tick)]

    def _note_wall_position(self, first: int, end: int) -> None:
        ring = self._window.state.rows["wall_position"]
        ring[np.arange(first, end) % len(ring)] = self._controller.params.wall.position

    def _fetch(self, carry: Carry, rings: Rings, *, writable: bool) -> None:
        """Let the logger have what the program has kept."""
        window, books = self._window, self._logger.books
        window.take(rings, writable=writable)
        least, most, strongest = map(np.array, carry.extremes)
        window.state = window.state._replace(x_min_m=least, x_max_m=most, force_max_N=strongest)
        if books:
            sums = Sums(*(np.stack(part) for part in zip(*(carry.books[name] for name in books.names), strict=True)))
            books.state = books.state._replace(sums=sums)

    def _report_ends(self, new: np.ndarray, ticks: np.ndarray) -> None:
        """Take the results of the loops that diverged after these numbers of ticks."""
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
        self._logger.note_accounts(self._controller.recorder._elements)

    def _resume(self, carry: Carry, tick: int) -> None:
        """Have the logger go on from here by itself."""
        self._log_stands_at(tick)
        if self._logger.books:
            elements, self._logger.rows = self._controller.recorder._elements, []
            for forces in self._last(carry, tick):
                columns = {"x": np.array(carry.x_m), "wall": forces.pop("wall")}
                del forces["command"]
                of_books = {int(book): force for book, force in forces.items()}
                self._logger.rows.append(Row(columns, of_books, elements))
