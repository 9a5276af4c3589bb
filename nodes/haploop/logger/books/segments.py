"""The motion of a chain between recorded states: whole plant steps, and the pieces that friction cut steps into."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from haploop.logger.books.buffers import PIECES
from haploop.plant.chain.chain import Chain

Columns = dict[str, np.ndarray]
# Those of a batch; with friction ``pieces``, a list of (place of a member, columns of its pieces), stands beside them.
BatchColumns = dict[str, Any]
# A part of a step is counted in 2^-62 of it: whole numbers, whose sums over many steps may overflow unharmed.
_FINEST = 62


@dataclass(frozen=True)
class Segments:
    """Stretches of motion in their order; every plant step is one of them or several.

    Attributes:
        step: plant step of each, counted from the first, shape (segments,).
        level: it lasts h / 2^level.
        is_stuck: whether body 0 is held in it.
        elapsed: part of its plant step that is over when it begins.
        states: all states of the chain when it begins, shape (states, segments).
        lows: what rounding left of the lengths among the states, shape (lengths, segments), m.
        displacements: change of every length, shape (lengths, segments), m.
        changes: change of every rate, up to where the next begins, shape (lengths, segments), m/s.
        friction: on body 0, N.
        stop_loss: kinetic energy friction took from body 0 in stopping it at the end, J.

    All but ``step`` may have a last axis for a batch, whose steps are all whole; of length 1 where they are alike.
    """

    step: np.ndarray
    level: np.ndarray
    is_stuck: np.ndarray
    elapsed: np.ndarray
    states: np.ndarray
    lows: np.ndarray
    displacements: np.ndarray
    changes: np.ndarray
    friction: np.ndarray
    stop_loss: np.ndarray

    @classmethod
    def from_columns(cls, chain: Chain, first_step: int, columns: Columns) -> Segments:
        """Reads the columns of some intervals, their end state included; see PLANT_BLOCK in the protocol."""
        n, steps = chain.count, len(columns["x"]) - 1
        zero = np.zeros((steps + 1, *[1] * (columns["x"].ndim - 1)))

        def table(name: str) -> np.ndarray:
            """Returns a column at every step, at the end, and where every piece begins; 0 in a row that has none."""
            column, of_pieces = columns.get(name, zero), columns.get(PIECES + name, zero[:0])
            return np.concatenate([column, of_pieces]) if len(of_pieces) else column

        step, begins = _in_order(steps, columns.get(f"{PIECES}step", zero[:0]).ravel().astype(np.int64) - first_step)
        path = np.append(begins, steps) if len(begins) > steps else slice(None)
        states = np.stack([table(name)[path] for name in chain.states])
        lows = np.stack([table(f"{name}_low")[path] for name in chain.positions])
        level = table("level")[begins].astype(np.int64)
        return cls(
            step=step,
            level=level,
            is_stuck=table("stuck")[begins] > 0.0,
            elapsed=_elapsed(step, level.ravel()).reshape(level.shape),
            states=states[:, :-1],
            lows=lows[:, :-1],
            displacements=np.diff(states[:n], axis=1) + np.diff(lows, axis=1),
            changes=np.diff(states[n : 2 * n], axis=1),
            friction=table("friction")[begins],
            stop_loss=table("snap_J")[begins],
        )

    def groups(self) -> list[tuple[int, bool, np.ndarray | slice]]:
        """Returns (level, is_stuck, which segments) of all that last equally long with body 0 free, or held.

        ``which`` selects from arrays of shape (segments,), or (segments, batch): all, or those where a mask is true.
        """
        kinds = self.level * 2 + self.is_stuck
        found = np.unique(kinds).tolist()
        if len(found) == 1:
            return [(found[0] // 2, bool(found[0] % 2), slice(None))]
        kinds = np.broadcast_to(kinds, self.states.shape[1:])
        return [(kind // 2, bool(kind % 2), kinds == kind) for kind in found]


def end_to_end(first_step: int, columns: Columns, pieces: list[tuple[int, Columns]]) -> Columns:
    """Returns the telemetry of several members as if it were that of one run, member after member.

    Args:
        first_step: of the intervals.
        columns: shape (steps + 1, members).
        pieces: the columns of pieces of every member by its place, in order of the places.

    Returns:
        Columns whose first step is 0. Every (steps + 1)-th step leads from the end of a member to the start of the next
        and has no meaning.
    """
    rows = len(columns["x"])
    joined = {name: column.T.ravel() for name, column in columns.items()}
    of_steps = [of[f"{PIECES}step"] - first_step + place * rows for place, of in pieces]
    for name in pieces[0][1]:
        joined[name] = np.concatenate([of[name] for _, of in pieces])
    return joined | {f"{PIECES}step": np.concatenate(of_steps)}


def _in_order(steps: int, step_of_piece: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns (plant step, row of the table of states) of every segment: whole steps, and the pieces of the others."""
    whole = np.setdiff1d(np.arange(steps), step_of_piece)
    step = np.concatenate([whole, step_of_piece])
    rows = np.concatenate([whole, steps + 1 + np.arange(len(step_of_piece))])
    order = np.argsort(step, kind="stable")
    return step[order], rows[order]


def _elapsed(step: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Returns the part of its step that is over when each segment begins: exact, the same wherever a block begins."""
    lasts = np.uint64(1) << (_FINEST - level).astype(np.uint64)
    over = np.cumsum(lasts) - lasts
    first = np.searchsorted(step, step)
    return (over - over[first]).astype(float) / 2.0**_FINEST
