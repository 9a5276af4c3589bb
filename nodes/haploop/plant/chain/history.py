"""The states of a chain of bodies from one plant step to the next, and what is told of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, NamedTuple

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.chain.sensed_acceleration import felt_acceleration
from haploop.plant.line.delay import Hold
from haploop.plant.motion.hand_force import hand_force
from haploop.protocol.ticks import Timebase

HELD = ("force", "command")


class Interval(NamedTuple):
    """How an interval went.

    Attributes:
        states, lows: at every plant step and at the end, shape (n + 1, states); what rounding left of the states.
        held: force and command tick (and whatever else) held over every step, shape (n, columns).
        at_ends: friction in N and whether body 0 is stuck at the end of every step, shape (n, 2).

    Of many loops at once all have one more axis, the last.
    """

    states: np.ndarray
    lows: np.ndarray
    held: np.ndarray
    at_ends: np.ndarray


class ChainHistory(ABC):
    """Where a chain has come to, and its record; what moves it is written in what builds on this.

    Attributes:
        x, v: position in m and velocity in m/s of body 0 at the end of the last interval.
        force, command: what is held last, N, and the tick of its command; 0 and -1 before the first.
        last_held: force and command and whatever else is held last, shape (columns,).
        z, low: all states and what rounding left of them.
    """

    held_names = HELD

    def __init__(self, scene: dict[str, Any], time: Timebase) -> None:
        self._chain = chain = Chain.of(scene)
        self._n, self._v, self._step_s = time.steps_per_tick, chain.count, time.step_s
        self._tau = hand_force(scene, time.plant_rate)
        self._rest_N = chain.spring[0] * chain.spring[1]
        self._intervals: list[Interval] = []
        self.z = chain.start_state(*([scene["loops"]] if "loops" in scene else []))
        self.low = np.zeros_like(self.z)
        self.last_held = self._held_before()
        self._publish()
        self._feel, self._felt = felt_acceleration(scene, chain, time, self.loads)
        begun = np.append(self.last_held[2:], (0.0, 0.0))[None, :2]
        self._feel(Interval(np.stack([self.z, self.z]), np.zeros(0), self.last_held[None], begun), 0)

    def _held_before(self) -> np.ndarray:
        """What is held at the start, before any command has come."""
        return np.array([0.0, -1.0])

    def _publish(self) -> None:
        self.x, self.v = float(self.z[0]), float(self.z[self._v])
        self.force, self.command = float(self.last_held[0]), int(self.last_held[1])

    def loads(self, first: int, last: int) -> np.ndarray:
        """Load on the last body at the steps first ... last - 1, N."""
        return self._tau.at_steps(first, last) + self._rest_N

    def _begin(self, holds: list[Hold]) -> Interval:
        """An interval of which the start is known, and what is held in it."""
        states, lows = np.empty((2, self._n + 1, *self.z.shape))
        states[0], lows[0] = self.z, self.low
        held = np.empty((self._n, len(self.held_names), *self.z.shape[1:]))
        first = 0
        for count, force, command in holds:
            held[first : first + count, 0], held[first : first + count, 1] = force, command
            first += count
        return Interval(states, lows, held, np.zeros((self._n, 2, *[1] * (self.z.ndim - 1))))

    @abstractmethod
    def advance(self, tick: int, holds: list[Hold]) -> None:
        """Move through interval ``tick`` under the forces held in it."""

    def _accept(self, tick: int, interval: Interval) -> None:
        """The interval went this way."""
        self._intervals.append(interval)
        self.z, self.low, self.last_held = interval.states[-1], interval.lows[-1], interval.held[-1]
        self._publish()
        self._feel(interval, tick * self._n + 1)

    def acceleration(self, _tick: int) -> float:
        """What a sensor with the scene's bandwidth and delay feels now, m/s^2."""
        return self._felt()

    def take_record(self, tick: int) -> dict[str, np.ndarray]:
        """Every state, what rounding left of each length, and what was held, by name; starts anew.

        At every plant step since the last call, and at the end, whose held columns are the last ones.
        """
        chain, done = self._chain, self._intervals
        states = np.vstack([*(interval.states[:-1] for interval in done), self.z])
        lows = np.vstack([*(interval.lows[:-1] for interval in done), self.low])
        held = np.vstack([*(interval.held for interval in done), self.last_held])
        self._intervals = []
        record = dict(zip(chain.states, states.T, strict=True))
        record |= {f"{name}_low": low for name, low in zip(chain.positions, lows.T, strict=False)}
        return record | dict(zip(self.held_names, held.T, strict=True))
