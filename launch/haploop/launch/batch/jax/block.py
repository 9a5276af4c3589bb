"""A block of ticks of a batch as one compiled program, kept for all groups of members of the same structure."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from haploop.launch.batch.jax.rows import Rows
from haploop.launch.batch.jax.tick import (
    BatchParams,
    BatchState,
    Forces,
    NotCompilable,
    TickInputs,
    TickOutputs,
    added_in_tick,
    batch_tick,
)
from haploop.logger.books.work import lost
from haploop.protocol.trees import tree_leaves, tree_map, tree_unflatten

# Rings of the window that are written at every tick, beside that of x.
RINGS = ("x", "total", "in_contact")


class Carry(NamedTuple):
    """State carried from tick to tick; arrays of shape (members,) where nothing else is said.

    Attributes:
        state: leaves of the state.
        extremes: least and greatest x in m, greatest force in N.
        books: sum and error of every book, by name.
        x_m: measured position at the last tick.
        past: commands (by the name "command"), forces of the wall and of every element's book, of all ticks from the
            oldest command that acts in the next interval on, and of one before, tick k in row k modulo L + 2; shape
            (L + 2, members) each.
    """

    state: list[Any]
    running: Any
    ticks: Any
    extremes: tuple[Any, Any, Any]
    books: dict[str, tuple[Any, Any]]
    x_m: Any
    past: Forces


class Rings(NamedTuple):
    """Rings that a window is read from: the last ticks, tick k in row k modulo the length.

    Attributes:
        x: at the plant steps after each tick, up to the next, shape (ticks, n, members).
        rows: columns of the controller, shape (ticks, members) each.
    """

    x: Any
    rows: dict[str, Any]


class BlockInputs(NamedTuple):
    """Inputs of a block.

    Attributes:
        limit_m: beyond which a member has diverged.
        ticks_in: inputs of every tick, a row each.
        keep_from: ticks from this one on go into the rings; those before into two rows that stay in the cache, as
            writing all of them to memory would take as long as computing them.
    """

    params: list[Any]
    limit_m: Any
    ticks_in: TickInputs
    first_tick: Any
    ticks: Any
    keep_from: Any


def numbers_of(params: Any) -> list[Any]:
    """Returns the leaves that a program is given anew for every group: floats and arrays."""
    return [leaf for leaf in tree_leaves(params) if _is_number(leaf)]


def constants_of(params: Any) -> Hashable:
    """Returns the other leaves as far as they can be compared: whole numbers, truth values and text."""
    return tuple(leaf for leaf in tree_leaves(params) if isinstance(leaf, int | str))


def _is_number(leaf: Any) -> bool:
    return isinstance(leaf, float | np.ndarray)


class Block:
    """The program of a block.

    Args:
        params, state: of a batch; another one with as many numbers of the same shapes is served as well.
    """

    def __init__(self, params: BatchParams, state: BatchState, book_names: tuple[str, ...], has_wall: bool) -> None:
        self._params, self._state = params, state
        self._book_names, self._has_wall = book_names, has_wall

    def run(self, carry: Carry, rings: Rings, inputs: BlockInputs) -> tuple[Carry, Rings]:
        """Goes through the ticks of a block; NotCompilable where the state after one is none to begin a tick with."""
        numbers = iter(inputs.params)
        params = tree_map(lambda leaf: next(numbers) if _is_number(leaf) else leaf, self._params)

        def body(i: Any, now: tuple[Carry, Rings]) -> tuple[Carry, Rings]:
            return self._step(*now, params, inputs, i)

        return jax.lax.fori_loop(0, inputs.ticks, body, (carry, rings))

    def _step(
        self, carry: Carry, rings: Rings, params: BatchParams, inputs: BlockInputs, i: Any
    ) -> tuple[Carry, Rings]:
        now = inputs.first_tick + i
        size, length = len(carry.past["command"]), rings.x.shape[0]
        before = [
            {name: ring[(now - ago) % size] for name, ring in carry.past.items()} for ago in (size - 1, size - 2, 1)
        ]
        at_tick = inputs.ticks_in.at(i, rings.x.shape[1])._replace(command=before[1]["command"])
        after, told = batch_tick(params, tree_unflatten(self._state, carry.state), at_tick)
        added, forces = self._booked(params, told, carry.x_m, before, inputs.ticks > 0)
        # The last row may hold where the members began.
        place = jnp.where(now >= inputs.keep_from, now % length, length - 2 - now % 2)
        rings = Rings(
            rings.x.at[place].set(jnp.stack(told.x.rows[1:])),
            {name: ring.at[place].set(told.row[name]) for name, ring in rings.rows.items()},
        )
        past = {name: ring.at[now % size].set(forces[name]) for name, ring in carry.past.items()}
        least, most, strongest = carry.extremes
        held = Rows([force for _, force in told.held])
        extremes = (
            jnp.minimum(least, told.x.over(jnp.minimum)),
            jnp.maximum(most, told.x.over(jnp.maximum)),
            jnp.maximum(strongest, abs(held).over(jnp.maximum)),
        )
        # Nothing is added to the books of a member that has ended; of all else it keeps what was.
        books = {
            name: _add(book, jnp.where(carry.running, added[name], 0.0)) if name in added else book
            for name, book in carry.books.items()
        }
        changed = Carry(_as_before(carry.state, after), carry.running, carry.ticks + 1, extremes, {}, told.row["x"], {})
        stays = jax.tree.map(
            lambda new, old: jnp.where(carry.running, new, old), changed, carry._replace(books={}, past={})
        )
        running = carry.running & (abs(told.x[-1]) <= inputs.limit_m)
        return stays._replace(running=running, books=books, past=past), rings

    def _booked(
        self, params: BatchParams, told: TickOutputs, x_m_before: Any, before: list[Forces], go: Any
    ) -> tuple[Forces, Forces]:
        """Returns a tick's additions to the books, and its forces; ``before``: of commands that act, and the last."""
        command = {"command": told.row["total"]}
        if not self._book_names:
            return {}, command
        apart, now = partial(_apart, go), told.forces
        wall = params.controller.wall if self._has_wall else None
        step_s = params.controller.motion.period_s / (len(told.x) - 1)
        acting = [before[0], before[1] if params.lookahead else now]

        def added() -> Forces:
            return added_in_tick(
                params.books, self._book_names, told, acting, before[2], x_m_before, wall, step_s, apart
            )

        return apart(added), now | command


def _as_before(before: list[Any], after: BatchState) -> list[Any]:
    """The leaves of a state in the shapes and types that they had before the tick."""
    leaves = tree_leaves(after)
    if len(leaves) != len(before):
        raise NotCompilable("What is remembered grows from tick to tick.")
    kept = []
    for old, leaf in zip(before, leaves, strict=True):
        new = jnp.asarray(leaf)
        if new.dtype != old.dtype or jnp.broadcast_shapes(new.shape, old.shape) != old.shape:
            raise NotCompilable(f"A number of type {old.dtype} and shape {old.shape} becomes {new.dtype}, {new.shape}.")
        kept.append(jnp.broadcast_to(new, old.shape))
    return kept


def _apart(go: Any, make: Callable[[], Any]) -> Any:
    """Returns the result of ``make``, made from numbers in memory and put into memory: no part of it is made twice.

    A compiler that fuses by itself makes for each of many results anew what they have in common; one for a GPU may.
    ``go`` is true, which the compiler cannot know.
    """
    if jax.default_backend() != "cpu":
        return make()
    shapes = jax.eval_shape(make)
    return jax.lax.cond(go, make, lambda: jax.tree.map(lambda one: jnp.zeros(one.shape, one.dtype), shapes))


def _add(book: tuple[Any, Any], added: Any) -> tuple[Any, Any]:
    """Returns the sum, and the sum of what each addition loses."""
    before, errors = book
    after = before + added
    return after, errors + lost(before, added, after)
