"""Chains of bodies of many loops at once, moved by the exact flow of each."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.chain.motion import ChainMotion
from haploop.plant.chain.tables import tables_of
from haploop.plant.chain.transition import ChainFlow, Responses
from haploop.plant.line.delay import Hold
from haploop.protocol.arrays import rows_of
from haploop.protocol.ticks import Timebase

# Responses are made for so few intervals at a time: where loops have loads or chains of their own, each has its own.
_PIECE_TICKS = 8


class ChainFlowArray(ChainFlow):
    """``step`` and ``held`` of ``ChainFlow`` with a last axis for the loops, of length 1 where all share them."""

    def __init__(self, chain: Chain, step_s: float, steps: int, stuck: bool) -> None:
        def made(chain: Chain) -> tuple[np.ndarray, ...]:
            flow = ChainFlow(chain, step_s, steps, stuck)
            return flow.step, flow.held

        self.step, self.held = tables_of(made, chain)


class ChainMotionArray(ChainMotion):
    """``ChainMotion`` with an array over many loops in place of every number; ``advance`` is the same code.

    All loops have their holds cut alike: one delay, which does not change.

    Attributes:
        x, v: position in m and velocity in m/s of body 0 at the end of the last interval, shape (loops,).
        z, low: all states and what rounding left of them, shape (states, loops).
    """

    def _responses(self, time: Timebase, stuck: bool) -> Responses:
        flow = ChainFlowArray(self._chain, time.step_s, self._n, stuck)
        return Responses(flow, self.loads, self._n, _PIECE_TICKS)

    def _held_before(self) -> np.ndarray:
        self._forces: list[Any] = []
        return np.multiply.outer(super()._held_before(), np.ones(self.z.shape[1:]))

    def _publish(self) -> None:
        self.x, self.v = self.z[0], self.z[self._v]
        self.force, self.command = self.last_held[0], int(self.last_held[1, 0])

    def advance(self, tick: int, holds: list[Hold]) -> None:
        """Move through interval ``tick`` under the forces held in it."""
        super().advance(tick, holds)
        self._forces += [force for _, force, _ in holds]

    def take_record(self, tick: int) -> dict[str, np.ndarray]:
        """As of one loop, all of shape (steps + 1, loops), but for ``command``, shared by all loops.

        Beside them ``held_N``: the force of every hold, shape (holds, loops).
        """
        chain, done = self._chain, self._intervals
        record = {"force": _joined([interval.held[:, 0] for interval in done], self.force)}
        for at, name in enumerate(chain.states):
            record[name] = _joined([interval.states[:-1, at] for interval in done], self.z[at])
        for at, name in enumerate(chain.positions):
            record[f"{name}_low"] = _joined([interval.lows[:-1, at] for interval in done], self.low[at])
        return record | self._take_held()

    def take_positions(self, _tick: int) -> dict[str, np.ndarray]:
        """``take_record`` with x alone of what moves."""
        return {"x": _joined([interval.states[:-1, 0] for interval in self._intervals], self.x)} | self._take_held()

    def _take_held(self) -> dict[str, np.ndarray]:
        command = [interval.held[:, 1, 0] for interval in self._intervals]
        forces, self._forces, self._intervals = self._forces, [], []
        return {"command": np.append(command, self.command), "held_N": rows_of(forces, len(self.x))}


def _joined(parts: list[np.ndarray], end: np.ndarray) -> np.ndarray:
    return np.concatenate([*parts, end[None]])
