"""A block of ticks of many loops as one compiled program, kept for all groups of loops of the same structure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from haploop.launch.batch.jax.books import Forces, added_in_tick
from haploop.launch.batch.jax.rows import Rows
from haploop.launch.batch.jax.stand_ins import Outside
from haploop.launch.batch.jax.tick import NoTick, Tick, Ticked

# Rings of the window that are written at every tick, beside that of x.
RINGS = ("x", "total", "in_contact")


class Carry(NamedTuple):
    """What goes from tick to tick; arrays of shape (loops,) where nothing else is said.

    Attributes:
        changing: the data leaves that a tick changes.
        running: whether the loop has not ended.
        ticks: how many intervals it has gone through in this block.
        extremes: least and greatest x in m, greatest force in N.
        books: sum and error of every book, by name.
        x_m: measured position at the last tick.
        past: commands (by the name "command"), forces of the wall and of every element's book, of all ticks from the
            oldest command that acts in the next interval on, and of one before, tick k in row k modulo L + 2; shape
            (L + 2, loops) each.
    """

    changing: list[Any]
    running: Any
    ticks: Any
    extremes: tuple[Any, Any, Any]
    books: dict[str, tuple[Any, Any]]
    x_m: Any
    past: Forces


class Rings(NamedTuple):
    """What a window is read from: the last ticks, tick k in row k modulo the length.

    Attributes:
        x: at the plant steps after each tick, up to the next, shape (ticks, n, loops).
        rows: columns of the controller, shape (ticks, loops) each.
    """

    x: Any
    rows: dict[str, Any]


class Given(NamedTuple):
    """What a block is given.

    Attributes:
        constant: the data leaves that no tick changes.
        limit_m: beyond which a loop has diverged.
        outside: of every tick, a row each.
        first_tick, ticks: which ticks the block covers.
        keep_from: ticks from this one on go into the rings; those before into two rows that stay in the cache, as
            writing all of them to memory would take as long as computing them.
    """

    constant: list[Any]
    limit_m: Any
    outside: Outside
    first_tick: Any
    ticks: Any
    keep_from: Any


class Block:
    """The program of a block, for loops whose objects have the structure of ``tick``.

    Attributes:
        changes: which data leaves a tick changes.
        counts: by how much a tick raises every whole leaf.
    """

    def __init__(self, tick: Tick, energy: bool, has_wall: bool) -> None:
        self._tick, self._energy, self._has_wall = tick, energy, has_wall
        self.changes: list[bool] = []
        self.counts: list[int] = []

    def learn(self, outside: Outside) -> None:
        """Find what a tick changes, from one that is traced and forgotten; it is given the first of ``outside``.

        Raises:
            NoTick: what a tick leaves cannot be what a tick begins with.
        """
        tick = self._tick

        def once(data: list[Any], outside: Outside) -> list[Any]:
            after, whole, _ = tick.run(data, outside, lambda _: None)
            self.changes = [new is not old for new, old in zip(after, data, strict=True)]
            self.counts = [new - old for new, old in zip(whole, tick.leaves.whole, strict=True)]
            return after

        data = tick.leaves.data
        after = jax.eval_shape(lambda data, outside: once(data, outside.at(0, tick.steps)), data, outside)
        for old, new, changed in zip(data, after, self.changes, strict=True):
            if changed and (np.shape(old) != new.shape or np.result_type(old) != new.dtype):
                raise NoTick(f"a number of shape {np.shape(old)} is of shape {new.shape} after a tick")

    def split(self, data: Sequence[Any]) -> tuple[list[Any], list[Any]]:
        """The data leaves that a tick changes, and those that none does."""
        by_change: tuple[list[Any], list[Any]] = ([], [])
        for value, changed in zip(data, self.changes, strict=True):
            by_change[not changed].append(value)
        return by_change

    def join(self, changing: Sequence[Any], constant: Sequence[Any]) -> list[Any]:
        """All data leaves in their order."""
        parts = iter(changing), iter(constant)
        return [next(parts[not changed]) for changed in self.changes]

    def run(self, carry: Carry, rings: Rings, given: Given) -> tuple[Carry, Rings]:
        """Go through the ticks of a block."""

        def body(i: Any, state: tuple[Carry, Rings]) -> tuple[Carry, Rings]:
            return self._step(state, given, i)

        return jax.lax.fori_loop(0, given.ticks, body, (carry, rings))

    def _step(self, state: tuple[Carry, Rings], given: Given, i: Any) -> tuple[Carry, Rings]:
        carry, rings = state
        now = given.first_tick + i
        size, length = len(carry.past["command"]), rings.x.shape[0]
        before = [
            {name: ring[(now - ago) % size] for name, ring in carry.past.items()} for ago in (size - 1, size - 2, 1)
        ]
        commands = tuple(forces["command"] for forces in before[:2])
        at_tick = given.outside._replace(commands=commands).at(i, rings.x.shape[1])
        data = self.join(carry.changing, given.constant)

        def report(told: Ticked) -> tuple[Ticked, dict[str, Any], Forces]:
            return self._report(told, carry.x_m, before, given.ticks > 0)

        after, _, (told, added, forces) = self._tick.run(data, at_tick, report)
        # The last row may hold where the loops began.
        place = jnp.where(now >= given.keep_from, now % length, length - 2 - now % 2)
        rings = Rings(
            rings.x.at[place].set(jnp.stack(told.x.rows[1:])),
            {name: ring.at[place].set(told.row[name]) for name, ring in rings.rows.items()},
        )
        past = {name: ring.at[now % size].set(forces[name]) for name, ring in carry.past.items()}
        x, new = told.x, self.split(after)[0]
        least, most, strongest = carry.extremes
        held = Rows([force for _, force in told.held])
        extremes = (
            jnp.minimum(least, x.over(jnp.minimum)),
            jnp.maximum(most, x.over(jnp.maximum)),
            jnp.maximum(strongest, abs(held).over(jnp.maximum)),
        )
        # Nothing is added to the books of a loop that has ended; of all else it keeps what was.
        books = {
            name: _add(book, jnp.where(carry.running, added[name], 0.0)) if name in added else book
            for name, book in carry.books.items()
        }
        changed = Carry(new, carry.running, carry.ticks + 1, extremes, {}, told.row["x"], {})
        stays = jax.tree.map(
            lambda new, old: jnp.where(carry.running, new, old) if new.ndim else new,
            changed,
            carry._replace(books={}, past={}),
        )
        running = carry.running & (abs(x[-1]) <= given.limit_m)
        return stays._replace(running=running, books=books, past=past), rings

    def _report(
        self, told: Ticked, x_m_before: Any, before: list[Forces], go: Any
    ) -> tuple[Ticked, dict[str, Any], Forces]:
        """The tick, what it adds to the books, its forces; ``before`` are those of commands that act, and the last."""
        command = {"command": told.row["total"]}
        if self._tick.books is None:
            return told, {}, command
        books, apart = self._tick.books, partial(_apart, go)
        now = {"wall": told.row["wall"]} | {str(book): force for book, force in told.forces.items()}
        acting = [before[0], before[1] if len(self._tick.commands) > 1 else now]

        def added() -> dict[str, Any]:
            return added_in_tick(books, told, now, acting, before[2], x_m_before, self._has_wall, apart)

        return told, apart(added), now | command


def _apart(go: Any, make: Callable[[], Any]) -> Any:
    """What ``make`` gives, made from numbers in memory and put into memory, so that no part of it is made twice.

    A compiler that fuses by itself makes for each of many results anew what they have in common; one for a GPU may.

    Args:
        go: true, which the compiler cannot know.
    """
    if jax.default_backend() != "cpu":
        return make()
    shapes = jax.eval_shape(make)
    return jax.lax.cond(go, make, lambda: jax.tree.map(lambda one: jnp.zeros(one.shape, one.dtype), shapes))


def _add(book: tuple[Any, Any], added: Any) -> tuple[Any, Any]:
    """Returns the sum, and the sum of what each addition loses."""
    before, errors = book
    after = before + added
    part = after - before
    return after, errors + ((before - (after - part)) + (added - part))
