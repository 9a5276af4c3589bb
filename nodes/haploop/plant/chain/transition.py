"""Exact transition of a chain of bodies over plant steps, and over a plant step halved repeatedly."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TypeVar

import numpy as np

from haploop.plant.chain.chain import Chain, Matrix
from haploop.plant.motion.transition import gramian, transition_minus_identity
from haploop.protocol.arrays import each
from haploop.protocol.trees import tree_leaves, tree_select, tree_unflatten

# Returns the load in N at the steps first ... last - 1.
Loads = Callable[[int, int], np.ndarray]
Made = TypeVar("Made")
_wide = np.longdouble
# Responses to the load are made for this many intervals at a time, on a fixed grid; in a batch for fewer.
PIECE_TICKS, _PIECE_TICKS_OF_A_BATCH = 256, 8
# Devices for which a process keeps what takes long to make: with friction, twice half a megabyte each.
DEVICES = 64


def of_device(make: Callable[..., Made]) -> Callable[..., Made]:
    """Returns ``make``, a function of a chain of floats and further arguments, with a cache of its last results.

    It must not use the start and the rest position: chains that differ in these alone share a result.
    """
    kept = lru_cache(maxsize=2 * DEVICES)(make)  # of each device with its first body free, and held
    return lambda chain, *of: kept(_of_any_start(chain), *of)


class ChainTransition:
    """e^{A t} - I of z' = A z + B (command, friction, load), command and friction held, load linear in a plant step.

    The augmented state is (z, command, friction, load, rise), load' = rise / h: one exponential gives the response to
    all inputs. All tables are transposed, (what acts, what is moved), so that sums over the first axis run in order.

    Attributes:
        step: over one plant step; shape (states + 4, states).
        held: over 1 ... steps plant steps, from (z, command, friction) alone; shape (states + 2, steps, states).
    """

    def __init__(self, chain: Chain, step_s: float, steps: int, stuck: bool) -> None:
        self._size = len(chain.states)
        self._scales = np.append(chain.scales(step_s), chain.scales(step_s)[-1])
        self._rates = scaled_rates(chain, step_s, stuck)
        self._step_s = _wide(step_s)
        one = transition_minus_identity(self._rates, self._step_s)
        self.step = self._unscaled(one)
        increments = [one]
        for _ in range(steps - 1):
            increments.append(increments[-1] + one + one @ increments[-1])
        self.held = np.ascontiguousarray(self._unscaled(np.stack(increments))[:, : self._size + 2].swapaxes(0, 1))

    def halves(self, levels: int) -> Matrix:
        """Returns the transitions over h, h/2, ... h/2^levels; rise is that over a whole step.

        Shape (levels + 1, states + 4, states).
        """
        increments = [transition_minus_identity(self._rates, self._step_s / _wide(2) ** levels)]
        for _ in range(levels):
            increments.append(2.0 * increments[-1] + increments[-1] @ increments[-1])
        return self._unscaled(np.stack(increments[::-1]))

    def _unscaled(self, increment: Matrix) -> Matrix:
        """Returns what (z, command, friction, load, rise) add to the states, transposed."""
        rows = increment[..., : self._size, :] * self._scales / self._scales[: self._size, None]
        return np.ascontiguousarray(rows.swapaxes(-1, -2)).astype(float)


def scaled_rates(chain: Chain, step_s: float, stuck: bool) -> Matrix:
    """Returns A of the augmented state in the coordinates of ``Chain.scales``, shape (states + 4, states + 4), 1/s."""
    size = len(chain.states)
    scales = np.append(chain.scales(step_s), chain.scales(step_s)[-1])
    rates = np.zeros((size + 4, size + 4), _wide)
    rates[:size, : size + 3] = chain.rates(stuck)
    rates[size + 2, size + 3] = 1.0 / _wide(step_s)
    return scales[:, None] * rates / scales


@of_device
def moves_of(chain: Chain, step_s: float, steps: int, stuck: bool) -> tuple[Matrix, Matrix]:
    """Returns ``step`` and ``held`` of the transition."""
    transition = ChainTransition(chain, step_s, steps, stuck)
    return transition.step, transition.held


@of_device
def halves_of(chain: Chain, step_s: float, levels: int, stuck: bool) -> Matrix:
    return ChainTransition(chain, step_s, 1, stuck).halves(levels)


class ChainResponse:
    """Cache of the transitions of intervals, and of their forced (zero-state) response to the load alone.

    An interval has ``steps`` steps. ``of_piece`` returns the responses of a piece of several intervals, each as
    ``of_interval`` does.
    """

    def __init__(
        self, chain: Chain, step_s: float, steps: int, loads: Loads, *, stuck: bool, has_members: bool
    ) -> None:
        self.step, self.held = make_tables(
            lambda one: moves_of(one, step_s, steps, stuck), chain, has_members=has_members
        )
        self._loads, self._n = loads, steps
        self._piece_ticks = _PIECE_TICKS_OF_A_BATCH if has_members else PIECE_TICKS
        self.of_piece = lru_cache(maxsize=1)(self._made)

    def of_interval(self, tick: int) -> np.ndarray:
        """Returns the response at the steps of interval ``tick`` and at its end, shape (n + 1, states)."""
        piece, at = divmod(tick, self._piece_ticks)
        return self.of_piece(piece)[at]

    def _made(self, piece: int) -> np.ndarray:
        n, table = self._n, self.step
        size = table.shape[1]
        ticks, loads = self._piece_ticks, self._loads
        first = piece * ticks * n
        load = loads(first, first + ticks * n + 1)
        start, rise = (rows.reshape(ticks, n, *load.shape[1:]) for rows in (load[:-1], np.diff(load, axis=0)))
        shape = np.broadcast_shapes((size, ticks, *load.shape[1:]), table[0, :, None].shape)
        response = np.zeros((n + 1, *shape))
        acting = np.zeros((size + 4, *shape[1:]))
        for i in range(n):
            acting[:size], acting[-2], acting[-1] = response[i], start[:, i], rise[:, i]
            response[i + 1] = response[i] + np.add.reduce(table[:, :, None] * acting[:, None])
        return np.ascontiguousarray(np.moveaxis(response, 2, 0))

    def select(self, kept: np.ndarray) -> None:
        self.step, self.held = tree_select((self.step, self.held), kept)
        self.of_piece.cache_clear()


class ChainIntegrals:
    """Exact integrals over h/2^level from the rates w = (z', rise) at the start, for the energy books.

    Differentiating z' = A z + B u once gives a linear system for w itself, w' = R w: command and friction are constant
    and load' = rise / h. In terms of rates nothing cancels when large forces hold the bodies at rest. For a velocity
    r . w
        integral (r.w)^2 dt = w' square w            integral (t - t_mid)/t_end r.w dt = lag . w
    """

    def __init__(self, chain: Chain, step_s: float, stuck: bool) -> None:
        self._size, self._step_s = len(chain.states), _wide(step_s)
        scales = np.append(chain.scales(step_s)[: self._size], chain.scales(step_s)[-1])
        full = scaled_rates(chain, step_s, stuck)
        keep = [*range(self._size), self._size + 3]
        self._rates = full[np.ix_(keep, keep)]
        self._rates[: self._size, -1] = full[: self._size, self._size + 2] / self._step_s
        self._scales = scales

    def products(self, pairs: Sequence[tuple[np.ndarray, np.ndarray]], levels: np.ndarray) -> Matrix:
        """Returns symmetric Q, unscaled, with integral (left.w)(right.w) dt = w' Q w over h/2^level, one for each pair.

        Shape (levels, pairs, states + 1, states + 1).
        """
        weights = []
        for left, right in pairs:
            a, b = (np.append(row, 0.0) / self._scales for row in (left, right))
            weights.append((np.outer(a, b) + np.outer(b, a)) / 2.0)
        forms = gramian(self._rates, np.stack(weights), self._step_s, levels)
        return forms * np.outer(self._scales, self._scales)

    def lag(self, velocity: np.ndarray, levels: np.ndarray) -> np.ndarray:
        """Returns l with integral (t - t_end/2)/t_end velocity.w dt = l . w over h/2^level.

        Shape (levels, states + 1).
        """
        n = len(self._rates)
        extended = np.zeros((n + 2, n + 2), _wide)
        extended[:n, :n] = self._rates
        extended[n, :n] = np.append(velocity, 0.0) / self._scales
        extended[n + 1, n] = 1.0 / self._step_s
        half = transition_minus_identity(extended, self._step_s, levels + 1)
        increment = 2.0 * half + half @ half
        later = increment[:, n + 1, :n] * _wide(2) ** levels[:, None]
        return (increment[:, n, :n] / 2.0 - later) * self._scales


def devices_of(chain: Chain, members: int) -> tuple[list[int], np.ndarray]:
    """Returns one member for each device of a batch, and which of these devices every member has, shape (members,).

    Chains that differ in the start and the rest position alone belong to one device.
    """
    numbers = [leaf for leaf in tree_leaves(_of_any_start(chain)) if getattr(leaf, "shape", ())]
    rows = list(zip(*(np.broadcast_to(number, members).tolist() for number in numbers), strict=True))
    first = {row: place for place, row in reversed([*enumerate(rows)])} if rows else {(): 0}
    device = {row: which for which, row in enumerate(first)}
    return [*first.values()], np.array([device[row] for row in rows or [()] * members])


def _of_any_start(chain: Chain) -> Chain:
    return replace(chain, spring=(chain.spring[0], 0.0), start=(0.0, 0.0))


def make_tables(
    make: Callable[[Chain], tuple[np.ndarray, ...]], chain: Chain, *, has_members: bool = True
) -> tuple[np.ndarray, ...]:
    """Makes the tables of a chain; for a batch, the tables of each of its chains, side by side.

    Args:
        make: function from a chain of floats to tables; it must not use the start and the rest position.
        has_members: whether the chain is that of a batch; the last axis is then for the members, of length 1 if
            all share it.
    """

    # The tables do not depend on the start and the rest position: chains that differ in these alone share them.
    chain = _of_any_start(chain)
    leaves = tree_leaves(chain)
    tables = each(lambda *numbers: make(tree_unflatten(chain, numbers)), *leaves)
    is_shared = not any(getattr(leaf, "shape", ()) for leaf in leaves)
    return tuple(table[..., None] for table in tables) if has_members and is_shared else tables
