"""The motion of a chain of bodies, moved by its exact flow from one change of force to the next."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.plant.chain.history import ChainHistory, Interval
from haploop.plant.chain.transition import ChainFlow, Responses
from haploop.plant.line.delay import Hold
from haploop.protocol.ticks import Timebase


class ChainMotion(ChainHistory):
    """z' = A z + B (command, friction, load): command and friction held, load = tau + k_h rest linear in a plant step.

    As in ``LinearMotion`` the motion is a sum z = y + D: D, the response to the load from zero at the start of an
    interval, is made beforehand; y starts as z and follows the held forces, all plant steps of a hold at once. States
    are floats with the rounding they left over (compensated addition). Sums run over the first axis, term by term.
    """

    def __init__(self, scene: dict[str, Any], time: Timebase) -> None:
        super().__init__(scene, time)
        self._free = self._responses(time, stuck=False)
        self._acting = np.zeros((len(self.z) + 2, *self.z.shape[1:]))

    def _responses(self, time: Timebase, stuck: bool) -> Responses:
        return Responses(ChainFlow(self._chain, time.step_s, self._n, stuck), self.loads, self._n)

    def advance(self, tick: int, holds: list[Hold]) -> None:
        """Move through interval ``tick`` under the forces held in it."""
        interval = self._begin(holds)
        self._follow(interval, 0, holds, self._free, tick, 0.0)
        self._accept(tick, interval)

    def _follow(
        self, interval: Interval, begin: int, holds: list[Hold], mode: Responses, tick: int, friction: float
    ) -> None:
        """Fill in the states from step ``begin`` on, under one flow and one friction force.

        Two motions under the same load differ by a motion without any: y = z - D at any step.
        """
        states, lows = interval.states, interval.lows
        response, acting = mode.of_interval(tick), self._acting
        y, low = states[begin], lows[begin]
        if begin:
            y = states[begin] - response[begin]
            low = low + _lost_in(states[begin], -response[begin], y)
        first = 0
        for count, force, _ in holds:
            at, first = max(first, begin), first + count
            if at < first:
                acting[:-2], acting[-2], acting[-1] = y, force, friction
                moved = np.add.reduce(mode.flow.held[:, : first - at] * acting[:, None, None]) + low
                change = moved + response[at + 1 : first + 1]
                states[at + 1 : first + 1] = after = y + change
                lows[at + 1 : first + 1] = change - (after - y)
                y, before = y + moved[-1], y
                low = moved[-1] - (y - before)


def _lost_in(a: np.ndarray, b: np.ndarray, total: np.ndarray) -> np.ndarray:
    """What rounding has taken from ``total`` = a + b (Knuth's two-sum)."""
    of_b = total - a
    return (a - (total - of_b)) + (b - of_b)
