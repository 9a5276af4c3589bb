"""A block of ticks of a batch as one compiled program, kept for all groups of members of the same structure."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import partial
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from haploop.launch.batch.jax.rows import Rows
from haploop.launch.batch.jax.tick import (
    BatchParams,
    BatchState,
    Decided,
    Forces,
    Moved,
    NotCompilable,
    TickInputs,
    added_in_tick,
    decided,
    moved,
)
from haploop.logger.books.work import lost
from haploop.protocol.trees import tree_leaves, tree_map, tree_unflatten

T = TypeVar("T")

# Rings of the window that are written at every tick, besides that of x.
RINGS = ("x", "total", "in_contact")


class Carry(NamedTuple):
    """State carried from tick to tick; arrays of shape (members,) unless stated otherwise.

    Attributes:
        state: leaves of the state.
        extremes: least and greatest x in m, greatest force in N.
        books: sum and error of every book, by name; within a block, the sum of what the block has added.
        x_m: measured position at the last tick.
        past: commands (by the name "command"), forces of the wall and of every element's book, at all ticks from that
            of the oldest command that acts in the next interval on, and at one tick before, tick k in row k modulo
            L + 2; shape (L + 2, members) each.
    """

    state: list[Any]
    running: Any
    ticks: Any
    extremes: tuple[Any, Any, Any]
    books: dict[str, Any]
    x_m: Any
    past: Forces


class Rings(NamedTuple):
    """Rings that a window is read from: the last ticks, tick k in row k modulo the length.

    Attributes:
        x: position at the plant steps after each tick, up to the next, shape (ticks, n, members).
        rows: columns of the controller, shape (ticks, members) each.
    """

    x: Any
    rows: dict[str, Any]


class Numbers(NamedTuple):
    """Leaves of parameters that a program is given again for every group: all floats as one array, and the arrays."""

    floats: Any
    arrays: list[Any]


class BlockInputs(NamedTuple):
    """Inputs of a block.

    Attributes:
        limit_m: limit beyond which a member has diverged.
        ticks_in: inputs of every tick, one row each.
        keep_from: ticks from this one on go into the rings; those before into two rows that stay in the cache, since
            writing all of them to memory would take as long as computing them.
    """

    params: Numbers
    limit_m: Any
    ticks_in: TickInputs
    first_tick: Any
    ticks: Any
    keep_from: Any


def numbers_of(params: Any) -> Numbers:
    """Returns the numbers of a tree."""
    leaves = tree_leaves(params)
    floats = [leaf for leaf in leaves if isinstance(leaf, float)]
    return Numbers(np.array(floats), [leaf for leaf in leaves if isinstance(leaf, np.ndarray)])


def with_numbers(params: T, numbers: Numbers) -> T:
    """Returns the tree with these numbers in place of its own."""
    floats, arrays = iter(numbers.floats), iter(numbers.arrays)

    def renewed(leaf: Any) -> Any:
        if isinstance(leaf, float):
            return next(floats)
        return next(arrays) if isinstance(leaf, np.ndarray) else leaf

    return tree_map(renewed, params)


def constants_of(params: Any) -> Hashable:
    """Returns the other leaves as far as they can be compared: whole numbers, truth values and text."""
    return tuple(leaf for leaf in tree_leaves(params) if isinstance(leaf, int | str))


class Block:
    """The program of a block.

    Args:
        params, state: those of a batch; the program also serves another with as many numbers of the same shapes.
    """

    def __init__(self, params: BatchParams, state: BatchState, book_names: tuple[str, ...], has_wall: bool) -> None:
        self._params, self._state = params, state
        self._book_names, self._has_wall = book_names, has_wall

    def run(self, carry: Carry, rings: Rings, inputs: BlockInputs) -> tuple[Carry, Rings]:
        """Goes through the ticks of a block; raises NotCompilable if no tick can begin with the state after a tick."""
        params = with_numbers(self._params, inputs.params)

        def body(i: Any, now: tuple[Carry, Rings]) -> tuple[Carry, Rings]:
            return self._step(*now, params, inputs, i)

        # A block's own sums are short, and so is their rounding: what is lost is kept only where they join the books.
        none = {name: jnp.zeros_like(sums) for name, (sums, _) in carry.books.items()}
        ended, rings = jax.lax.fori_loop(0, inputs.ticks, body, (carry._replace(books=none), rings))
        books = {name: _add(carry.books[name], of_block) for name, of_block in ended.books.items()}
        return ended._replace(books=books), rings

    def _step(
        self, carry: Carry, rings: Rings, params: BatchParams, inputs: BlockInputs, i: Any
    ) -> tuple[Carry, Rings]:
        now = inputs.first_tick + i
        size, length = len(carry.past["command"]), rings.x.shape[0]
        state, at_tick = tree_unflatten(self._state, carry.state), inputs.ticks_in.at(i, rings.x.shape[1])
        command = decided(params, state, at_tick)
        # The rings of forces need not be copied, as they are written before anything is read from them.
        past = {name: ring.at[now % size].set(command.forces[name]) for name, ring in carry.past.items()}
        before = [{name: ring[(now - ago) % size] for name, ring in past.items()} for ago in (size - 1, size - 2, 1)]
        after, told = moved(params, state, at_tick, command, before[1]["command"])
        added = self._added(params, told, command, before, carry.x_m, inputs.ticks > 0)
        # The last row may hold where the members began.
        place = jnp.where(now >= inputs.keep_from, now % length, length - 2 - now % 2)
        rings = Rings(
            rings.x.at[place].set(jnp.stack(told.x.rows[1:])),
            {name: ring.at[place].set(command.row[name]) for name, ring in rings.rows.items()},
        )
        least, most, strongest = carry.extremes
        held = Rows([force for _, force in told.held])
        extremes = (
            jnp.minimum(least, told.x.over(jnp.minimum)),
            jnp.maximum(most, told.x.over(jnp.maximum)),
            jnp.maximum(strongest, abs(held).over(jnp.maximum)),
        )
        # Nothing is added to the books of a member that has ended; everything else it keeps as it was.
        books = {
            name: book + jnp.where(carry.running, added[name], 0.0) if name in added else book
            for name, book in carry.books.items()
        }
        changed = Carry(
            _as_before(carry.state, after), carry.running, carry.ticks + 1, extremes, {}, command.row["x"], {}
        )
        stays = jax.tree.map(
            lambda new, old: jnp.where(carry.running, new, old), changed, carry._replace(books={}, past={})
        )
        running = carry.running & (abs(told.x[-1]) <= inputs.limit_m)
        return stays._replace(running=running, books=books, past=past), rings

    def _added(
        self, params: BatchParams, told: Moved, command: Decided, before: list[Forces], x_m_before: Any, go: Any
    ) -> dict[str, Any]:
        """Returns a tick's additions to the books; ``before``: forces of commands that act, and of the tick before."""
        if not self._book_names:
            return {}
        now = {name: force for name, force in command.forces.items() if name != "command"}
        wall = params.controller.wall if self._has_wall else None
        step_s = params.controller.motion.period_s / (len(told.x) - 1)
        x_m, apart = [x_m_before, command.row["x"]], partial(_apart, go)

        def added() -> dict[str, Any]:
            return added_in_tick(
                params.books, self._book_names, told, now, before[:2], before[2], x_m, wall, step_s, apart
            )

        return apart(added)


def _as_before(before: list[Any], after: BatchState) -> list[Any]:
    """Returns the leaves of a state in the shapes and types that they had before the tick."""
    leaves = tree_leaves(after)
    if len(leaves) != len(before):
        raise NotCompilable("The state grows from tick to tick.")
    kept = []
    for old, leaf in zip(before, leaves, strict=True):
        new = jnp.asarray(leaf)
        if new.dtype != old.dtype or jnp.broadcast_shapes(new.shape, old.shape) != old.shape:
            raise NotCompilable(f"A number of type {old.dtype} and shape {old.shape} becomes {new.dtype}, {new.shape}.")
        kept.append(jnp.broadcast_to(new, old.shape))
    return kept


def _apart(go: Any, make: Callable[[], Any]) -> Any:
    """Returns the result of ``make``, computed from numbers in memory and put into memory: no part is computed twice.

    A compiler that fuses on its own computes what many results have in common again for each; one for a GPU may do so.
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
