"""Chains of many loops whose first bodies stick and slip."""

from __future__ import annotations

from typing import Any

import numpy as np

from haploop.plant.chain.history import HELD, Interval
from haploop.plant.chain.motion_batch import ChainMotionArray
from haploop.plant.friction.motion import FrictionMotion
from haploop.plant.line.delay import Hold
from haploop.protocol.arrays import Shared, of_one
from haploop.protocol.ticks import Timebase


class FrictionMotionArray(ChainMotionArray):
    """``FrictionMotion`` of many loops with the same chain and the same friction.

    In an interval all loops go as far as they would if nothing switched, those that stick and those that slip apart.
    Most do. For each of the others the interval is gone through anew by the motion of one loop.
    """

    held_names = (*HELD, "friction", "stuck")

    def __init__(self, scene: dict[str, Any], time: Timebase) -> None:
        self._one = Shared(FrictionMotion(of_one(scene), time))
        self._pieces: list[tuple[int, dict[str, np.ndarray]]] = []
        super().__init__(scene, time)
        self._clamped = self._responses(time, stuck=True)

    def _held_before(self) -> np.ndarray:
        one, loops = self._one.held, self.z.shape[1:]
        self._forces = []
        self._is_stuck, self._direction = np.full(loops, one.mode.is_stuck), np.full(loops, one.mode.direction)
        return np.multiply.outer(one.last_held, np.ones(loops))

    def advance(self, tick: int, holds: list[Hold]) -> None:
        """Move through interval ``tick`` under the forces held in it."""
        interval, loads = self._begin(holds), self.loads(tick * self._n, (tick + 1) * self._n + 1)
        is_stuck, direction = self._decided(interval, loads)
        goes_on = np.empty(is_stuck.shape, bool)
        for kind in (False, True):
            places = np.flatnonzero(is_stuck == kind)
            if len(places):
                goes_on[places] = self._as_they_go(interval, kind, places, direction[places], holds, tick, loads)
        for place in np.flatnonzero(~goes_on).tolist():
            is_stuck[place], direction[place] = self._by_itself(interval, place, holds, tick)
        self._is_stuck, self._direction = is_stuck, direction
        self._forces += [force for _, force, _ in holds]
        self._accept(tick, interval)

    def _begin(self, holds: list[Hold]) -> Interval:
        return super()._begin(holds)._replace(at_ends=np.zeros((self._n, 2, *self.z.shape[1:])))

    def _decided(self, interval: Interval, loads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Whether each loop sticks, and where it slips, at the beginning; see ``Mode.decide_at_rest``."""
        z, mode = interval.states[0], self._one.held.mode
        is_at_rest, (holds, way) = z[self._v] == 0.0, mode.at_rest(z, interval.held[0, 0], loads[0])
        return np.where(is_at_rest, holds, self._is_stuck), np.where(is_at_rest, way, self._direction)

    def _as_they_go(
        self,
        interval: Interval,
        is_stuck: bool,
        places: np.ndarray,
        direction: np.ndarray,
        holds: list[Hold],
        tick: int,
        loads: np.ndarray,
    ) -> np.ndarray:
        """Let some loops, alike in whether they stick, follow their mode; returns which of them it holds for."""
        mode = self._one.held.mode
        mode.is_stuck, mode.direction = is_stuck, direction
        some = Interval(*(np.ascontiguousarray(part[..., places]) for part in interval))
        self._acting = np.empty((len(self.z) + 2, len(places)))
        of_some = [(count, force[places] if np.ndim(force) else force, command) for count, force, command in holds]
        friction = self._one.held.slipping(mode)
        self._follow(some, 0, of_some, self._clamped if is_stuck else self._free, tick, friction)
        some.held[:, 2], some.held[:, 3] = friction, is_stuck
        some.at_ends[:, 0], some.at_ends[:, 1] = friction, is_stuck
        for part, of_these in zip(interval, some, strict=True):
            part[..., places] = of_these
        return self._one.held.goes_on(some, 0, friction, loads).all(axis=0)

    def _by_itself(self, interval: Interval, place: int, holds: list[Hold], tick: int) -> tuple[bool, float]:
        """Take one loop through the interval; returns whether it sticks at the end, and where it slips or slipped."""
        one, mode = self._one.held, self._one.held.mode
        mode.is_stuck, mode.direction = bool(self._is_stuck[place]), float(self._direction[place])
        one.z, one.low = self.z[:, place].copy(), self.low[:, place].copy()
        one.advance(tick, [(n, float(force[place]) if np.ndim(force) else force, k) for n, force, k in holds])
        for part, of_this in zip(interval, one.take_interval(), strict=True):
            part[..., place] = of_this
        pieces = one.take_pieces()
        if len(pieces["pieces.step"]):
            self._pieces.append((place, pieces))
        return mode.is_stuck, mode.direction

    def take_record(self, tick: int) -> dict[str, Any]:
        """As without friction; ``pieces``: (loop, its pieces) wherever friction switched within an interval."""
        held = {"friction": 2, "stuck": 3}
        columns = {
            name: np.concatenate([*(interval.held[:, at] for interval in self._intervals), self.last_held[None, at]])
            for name, at in held.items()
        }
        pieces, self._pieces = self._pieces, []
        return super().take_record(tick) | columns | {"pieces": pieces}

    def take_positions(self, tick: int) -> dict[str, np.ndarray]:
        """``take_record`` with x alone of what moves."""
        self._pieces = []
        return super().take_positions(tick)
