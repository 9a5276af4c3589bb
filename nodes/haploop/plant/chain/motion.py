"""The motion of a chain of bodies, moved by its exact transition from one change of force to the next."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.plant.chain.history import ChainHistory, Interval
from haploop.plant.chain.transition import ChainResponse
from haploop.plant.line import Hold
from haploop.plant.where_it_pays import WhereItPays
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase

# They pay from this many intervals in all.
LOOPS = WhereItPays("haploop.plant.chain.loops", 60_000)


class ChainMotion(ChainHistory):
    """z' = A z + B (command, friction, load): command and friction held, load = tau + k_h rest linear in a plant step.

    The motion is a sum z = y + D: D, the forced response to the load from zero at the start of an interval, is computed
    beforehand; y starts equal to z and follows the held forces, all plant steps of a hold at once. States are floats,
    each with the digits that rounding left over (compensated addition). Sums run over the first axis, term by term.
    """

    def __init__(self, scene: Scene, time: Timebase, members: int | None = None) -> None:
        super().__init__(scene, time, members)
        self._free = self._response(stuck=False)

    def _response(self, *, stuck: bool) -> ChainResponse:
        has_members = self._members is not None
        return ChainResponse(self.chain, self._step_s, self._n, self.loads, stuck=stuck, has_members=has_members)

    def advance(self, tick: int, holds: list[Hold]) -> Any:
        interval = self._begin(holds)
        follow(self._free.held, self._free.of_interval(tick), interval, 0, holds, 0.0)
        return self._accept(tick, interval)

    def select(self, kept: np.ndarray) -> None:
        super().select(kept)
        self._free.select(kept)


class LoneChainMotion(ChainMotion):
    """``ChainMotion`` of one run, by a loop of machine code where that saves time."""

    def __init__(self, scene: Scene, time: Timebase) -> None:
        super().__init__(scene, time)
        self._loops = LOOPS.module_for(time.ticks)
        self._held = np.ascontiguousarray(self._free.held.swapaxes(0, 1))

    def advance(self, tick: int, holds: list[Hold]) -> Any:
        if not self._loops:
            return super().advance(tick, holds)
        interval, ends = self._begin(holds), self._loops.ends_of(tuple([count for count, _, _ in holds]))
        self._loops.follow(self._held, self._free.of_interval(tick), interval.course, ends)
        return self._accept(tick, interval)


def follow(
    held: np.ndarray, forced: np.ndarray, interval: Interval, begin: int, holds: list[Hold], friction: Any
) -> None:
    """Fills in the states of an interval from step ``begin`` on, at which they are known.

    Two motions under the same load differ by a motion without load: y = z - D at any step.

    Args:
        held: ``held`` of the ``ChainTransition`` that applies.
        forced: D, the forced response at every step and at the end, shape (n + 1, states).
        holds: what is held in the interval.
        friction: force of friction in N, the same throughout.
    """
    states, comps = interval.states, interval.comps
    acting = np.empty((states.shape[1] + 2, *states.shape[2:]))
    y, comp = states[begin], comps[begin]
    if begin:
        y = states[begin] - forced[begin]
        comp = comp + lost_in(states[begin], -forced[begin], y)
    first = 0
    for count, force, _ in holds:
        at, first = max(first, begin), first + count
        if at < first:
            acting[:-2], acting[-2], acting[-1] = y, force, friction
            moved = np.add.reduce(held[:, : first - at] * acting[:, None, None]) + comp
            change = moved + forced[at + 1 : first + 1]
            states[at + 1 : first + 1] = after = y + change
            comps[at + 1 : first + 1] = change - (after - y)
            y, before = y + moved[-1], y
            comp = moved[-1] - (y - before)


def lost_in(a: np.ndarray, b: np.ndarray, total: np.ndarray) -> np.ndarray:
    """Returns what rounding has taken from ``total`` = a + b (Knuth's two-sum)."""
    of_b = total - a
    return (a - (total - of_b)) + (b - of_b)
