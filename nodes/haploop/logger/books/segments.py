"""The motion of a chain between recorded states: whole plant steps, and the pieces that friction cut steps into."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from haploop.plant.chain.chain import Chain

Columns = dict[str, np.ndarray]
# A part of a step is counted in 2^-62 of it: whole numbers, whose sums over many steps may overflow unharmed.
_FINEST = 62


@dataclass(frozen=True)
class Moves:
    """Stretches of motion in their order; every plant step is one of them or several.

    Attributes:
        step: plant step of each, counted from the first, shape (moves,).
        level: it lasts h / 2^level.
        is_stuck: whether body 0 is held in it.
        elapsed: part of its plant step that is over when it begins.
        states: all states of the chain when it begins, shape (states, moves).
        lows: what rounding left of the lengths among the states, shape (lengths, moves).
        ways: change of every length, shape (lengths, moves), m.
        changes: change of every rate, up to where the next begins, shape (lengths, moves), m/s.
        friction: on body 0, N.
        snap: kinetic energy friction took from body 0 in stopping it at the end, J.

    All but ``step`` may have a last axis for many loops, whose steps are all whole; of length 1 where they are alike.
    """

    step: np.ndarray
    level: np.ndarray
    is_stuck: np.ndarray
    elapsed: np.ndarray
    states: np.ndarray
    lows: np.ndarray
    ways: np.ndarray
    changes: np.ndarray
    friction: np.ndarray
    snap: np.ndarray

    @classmethod
    def of(cls, chain: Chain, first_step: int, columns: Columns) -> Moves:
        """Read the columns of some intervals, their end state included; see PLANT_BLOCK in the protocol."""
        n, steps = chain.count, len(columns["x"]) - 1
        zero = np.zeros((steps + 1, *[1] * (columns["x"].ndim - 1)))

        def table(name: str) -> np.ndarray:
            """A column at every step, at the end, and where every piece begins; 0 in a row that has none."""
            column, of_pieces = columns.get(name, zero), columns.get(f"pieces.{name}", zero[:0])
            return np.concatenate([column, of_pieces]) if len(of_pieces) else column

        step, begins = _in_order(steps, columns.get("pieces.step", zero[:0]).ravel().astype(np.int64) - first_step)
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
            ways=np.diff(states[:n], axis=1) + np.diff(lows, axis=1),
            changes=np.diff(states[n : 2 * n], axis=1),
            friction=table("friction")[begins],
            snap=table("snap_J")[begins],
        )

    def within(self, which: np.ndarray) -> Moves:
        """Some of the moves of one loop."""
        return Moves(*(getattr(self, field.name)[..., which] for field in fields(self)))

    def groups(self) -> list[tuple[int, bool, np.ndarray | slice]]:
        """(level, is_stuck, which moves) of all moves that last equally long under the same flow."""
        kinds = (self.level * 2 + self.is_stuck).ravel()
        found = np.unique(kinds).tolist()
        if len(found) == 1:
            return [(found[0] // 2, bool(found[0] % 2), slice(None))]
        return [(kind // 2, bool(kind % 2), kinds == kind) for kind in found]


def _in_order(steps: int, step_of_piece: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(plant step, row of the table of states) of every move: the steps that are whole and the pieces of the others."""
    whole = np.setdiff1d(np.arange(steps), step_of_piece)
    step = np.concatenate([whole, step_of_piece])
    rows = np.concatenate([whole, steps + 1 + np.arange(len(step_of_piece))])
    order = np.argsort(step, kind="stable")
    return step[order], rows[order]


def _elapsed(step: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Part of its plant step that is over when each move begins: exact, and the same wherever a block begins."""
    lasts = np.uint64(1) << (_FINEST - level).astype(np.uint64)
    over = np.cumsum(lasts) - lasts
    first = np.searchsorted(step, step)
    return (over - over[first]).astype(float) / 2.0**_FINEST
