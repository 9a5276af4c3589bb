"""The energy books of many loops whose first bodies stick and slip."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from haploop.logger.books.chain import ChainBooks
from haploop.logger.books.segments import Columns, Moves
from haploop.protocol.arrays import Shared, of_one
from haploop.protocol.ticks import Timebase


class FrictionBooksArray(ChainBooks):
    """``ChainBooks`` of many loops with the same chain.

    All steps are booked as if they were whole; those that friction cut are then booked anew, one after the other as
    if they were those of one loop.
    """

    def __init__(self, scene: dict[str, Any], time: Timebase) -> None:
        super().__init__(scene, time)
        self._one = Shared(ChainBooks(of_one(scene), time))
        self.forms = FlatForms(self._one)

    def by_step(
        self, first_step: int, columns: dict[str, Any], dx: np.ndarray, commanded: Iterable[np.ndarray]
    ) -> Iterator[np.ndarray]:
        """What each step adds to each book, J, shape (steps, loops) each."""
        forces, cuts = list(commanded), columns["pieces"]
        whole = {name: column for name, column in columns.items() if np.shape(column) == columns["x"].shape}
        flows = super().by_step(first_step, whole, dx, forces)
        if not cuts:
            yield from flows
            return
        at, loop, moves = self._cut(first_step, whole, cuts)
        tau = self._tau.at_steps(first_step, first_step + len(dx) + 1)
        tau = np.broadcast_to(tau, columns["x"].shape)
        pairs = np.append(tau[at, loop][:, None], tau[at + 1, loop][:, None], axis=1)
        booked = self._one.held.of_moves(
            replace(moves, step=2 * moves.step),
            np.append(pairs.ravel(), 0.0),
            np.repeat(columns["force"][at, loop], 2),
            np.repeat(dx[at, loop], 2),
            [np.repeat(force[at, loop], 2) for force in forces],
        )
        for flow, of_cut in zip(flows, booked, strict=True):
            flow = np.array(flow)
            flow[at, loop] = of_cut[::2]
            yield flow

    def _cut(
        self, first_step: int, columns: Columns, cuts: list[tuple[int, Columns]]
    ) -> tuple[np.ndarray, np.ndarray, Moves]:
        """(step counted from the first, loop) of every step that was cut, and the moves it consists of.

        The moves are read from columns in which the start and the end of every such step follow one another; what
        seems to lie between the end of one and the start of the next is left out.
        """
        begun, loops, numbers = [], [], []
        for loop, pieces in cuts:
            steps, number = np.unique(pieces["pieces.step"], return_inverse=True)
            numbers.append(2 * (number + len(begun)))
            begun += (steps.astype(np.int64) - first_step).tolist()
            loops += [loop] * len(steps)
        at, loop = np.array(begun), np.array(loops)
        rows = np.append(np.stack([at, at + 1], axis=1).ravel(), at[-1] + 1)
        of_rows = np.append(np.repeat(loop, 2), loop[-1])
        ends = {name: column[rows, of_rows] for name, column in columns.items()}
        names = cuts[0][1].keys()
        ends |= {name: np.concatenate([pieces[name] for _, pieces in cuts]) for name in names}
        ends["pieces.step"] = np.concatenate(numbers).astype(float)
        moves = Moves.of(self._chain, 0, ends)
        moves = moves.within(moves.step % 2 == 0)
        return at, loop, replace(moves, step=moves.step // 2)


class FlatForms:
    """``ChainForms`` of one loop, given the moves of all, one after the other."""

    def __init__(self, one: Shared) -> None:
        self._one = one
        self.names = one.held.forms.names

    def integrals(self, moves: Moves, force: np.ndarray, tau: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """As ``ChainForms.integrals``, shape (integrals, moves, loops)."""

        def flat(values: np.ndarray) -> np.ndarray:
            above = values.shape[:-2]
            return np.broadcast_to(values, (*above, *force.shape)).reshape(*above, -1)

        moves = replace(
            moves,
            level=flat(moves.level),
            is_stuck=flat(moves.is_stuck),
            states=flat(moves.states),
            lows=flat(moves.lows),
            friction=flat(moves.friction),
        )
        found = self._one.held.forms.integrals(moves, flat(force), flat(tau), flat(rise))
        return found.reshape(len(found), *force.shape)
