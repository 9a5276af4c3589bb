"""The response of one mass to the hand's force alone, computed beforehand for every plant step."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np

from haploop.plant.motion.hand_force import HandForce
from haploop.plant.motion.transition import FohTransition
from haploop.protocol.trees import tree_select

# Responses are made for this many intervals at a time, on a fixed grid.
_PIECE_TICKS = 256
# If every member of a batch has its own response, it is made for fewer intervals at a time.
_PIECE_TICKS_OF_EACH = 8


def forced_response(transition: FohTransition, start: Any, rise: Any) -> Iterator[tuple[Any, Any]]:
    """Yields the forced (zero-state) response of x (m) and v (m/s) at every step of intervals except their start.

    ``start`` and ``rise``: load at the start of each step and its rise over it, N, shape (n, intervals). What is
    yielded has shape (intervals,) each; all may have a last axis for the members of a batch.
    """
    s = transition
    push_x, push_v = s.x_force * start + s.x_slope * rise, s.v_force * start + s.v_slope * rise
    x = v = push_x[0] - push_x[0]
    for of_x, of_v in zip(push_x, push_v, strict=True):
        x, v = x + (s.x_x * x + s.x_v * v + of_x), v + (s.v_x * x + s.v_v * v + of_v)
        yield x, v


class ForcedResponse:
    """Response to tau and the spring's rest position, from zero at the start of every interval of n steps: a cache.

    It has no state, does not depend on the controller, and is computed for one piece of the run after another.

    Attributes:
        rest_N: force of the spring with the device at the origin, k x_rest.
        is_shared: whether all members of a batch have the same response.
    """

    def __init__(self, transition: FohTransition, tau: HandForce, rest_N: Any, steps: int) -> None:
        self.transition, self.tau, self.rest_N, self._steps = transition, tau, rest_N, steps
        load = tau.at_steps(0, 1)[0] + rest_N
        self.is_shared = not np.shape(transition.x_x) and (np.shape(load) or (1,))[-1] == 1
        self._piece_ticks = _PIECE_TICKS if self.is_shared else _PIECE_TICKS_OF_EACH
        self._piece = lru_cache(maxsize=9)(self._made)

    def loads(self, first: int, last: int) -> np.ndarray:
        """Returns tau + k x_rest at the steps first ... last - 1, N."""
        return self.tau.at_steps(first, last) + self.rest_N

    def ends(self, tick: int) -> tuple[int, list[Any]]:
        """Returns (first interval of the piece with ``tick``, what it adds to (x, v) over each of its intervals)."""
        piece = tick // self._piece_ticks
        at_ends = self._piece(piece)[:, -1].swapaxes(0, 1)
        return piece * self._piece_ticks, at_ends.tolist() if at_ends.ndim == 2 else list(at_ends)

    def between(self, tick: int, ticks: int) -> np.ndarray:
        """Returns the response of x and v in some intervals, shape (2, n + 1, ticks, ...), their end as last step."""
        size = self._piece_ticks
        first, last = tick // size, max(tick, tick + ticks - 1) // size
        pieces = [self._piece(piece) for piece in range(first, last + 1)]
        joined = pieces[0] if len(pieces) == 1 else np.concatenate(pieces, axis=2)
        start = tick - first * size
        return joined[:, :, start : start + ticks]

    def _made(self, piece: int) -> np.ndarray:
        n, ticks = self._steps, self._piece_ticks
        first = piece * ticks * n
        force = self.loads(first, first + ticks * n + 1)
        start, rise = (rows.reshape(ticks, n, *force.shape[1:]) for rows in (force[:-1], np.diff(force, axis=0)))
        states = list(forced_response(self.transition, start.swapaxes(0, 1), rise.swapaxes(0, 1)))
        response = np.zeros((2, n + 1, *states[0][0].shape))
        for i, (x, v) in enumerate(states, 1):
            response[0, i], response[1, i] = x, v
        return response

    def select(self, kept: np.ndarray) -> None:
        self.transition, self.rest_N = tree_select((self.transition, self.rest_N), kept)
        self.tau.select(kept)
        if not self.is_shared:
            self._piece.cache_clear()
