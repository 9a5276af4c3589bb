"""Whether the first body of a chain sticks or slips, and for how long it goes on doing so."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.friction.law import Friction


class Mode:
    """Stuck, while friction holds the other forces on body 0; slipping in a direction, until v changes its sign.

    Between two states of a smooth motion the mode is watched by its margin g >= 0: the speed in its direction, or what
    friction could hold beyond the forces. g < 0 at the end means it has ceased. It may have ceased and be back where g
    falls at the start and rises at the end: its least value is not below where the tangents at both ends meet.
    States are arrays of shape (states,), or (states, many) with the other arguments to match.

    Attributes:
        is_stuck, direction: the mode; the way body 0 slips, or last slipped, +1.0 or -1.0.
    """

    def __init__(self, chain: Chain, friction: Friction, step_s: float) -> None:
        self._friction, self._v, self._size = friction, chain.count, len(chain.states)
        pull = chain.accelerations()[0] * chain.masses_kg[0]
        self._force = _Row(pull, self._size)
        self._change = _Row(pull[: self._size] @ chain.rates(stuck=True) * step_s, self._size)
        self._speed_up = step_s / chain.masses_kg[0]
        self.is_stuck, self.direction = False, 1.0

    def start(self, z: np.ndarray, load: float) -> None:
        """Find the mode in which the run begins."""
        self.direction = math.copysign(1.0, z[self._v])
        self.decide_at_rest(z, 0.0, load)

    def decide_at_rest(self, z: np.ndarray, command: float, load: float) -> None:
        """Where v is exactly 0: stick, or slip where the other forces pull (command and load in N)."""
        if z[self._v] == 0.0:
            holds, direction = self.at_rest(z, command, load)
            self.is_stuck, self.direction = bool(holds), float(direction)

    def at_rest(self, z: Any, command: Any, load: Any) -> tuple[Any, Any]:
        """Whether a body at rest sticks, and where the other forces pull it."""
        force = self._force.on(z, command, load)
        return self._friction.holds(force), np.copysign(1.0, force)

    def friction_at(self, v: float) -> float:
        """The friction force at velocity v, N; none at rest."""
        return -self.direction * self._friction.at(v) if v else 0.0

    def goes_on(self, z: Any, command: Any, load: Any) -> Any:
        """Whether the mode still holds in state z."""
        if self.is_stuck:
            return self._friction.holds(self._force.on(z, command, load))
        return self.direction * z[self._v] > 0.0

    def may_pause(self, begin: Any, end: Any, command: Any, load: Any, end_load: Any, friction: float, part: float):
        """Whether the mode may cease and be back between two states, ``part`` of a plant step apart, in which it holds.

        Args:
            load, end_load: in N, in the two states.
            friction: friction force in N between them.
        """
        force, end_force = self._force.on(begin, command, load), self._force.on(end, command, end_load)
        if not self.is_stuck:
            gain, speeds = self.direction * part * self._speed_up, (begin[self._v], end[self._v])
            g, end_g = (self.direction * v for v in speeds)
            return _tangents_meet_below(g, gain * (force + friction), end_g, gain * (end_force + friction))
        rise = self._force.of_load * (end_load - load)
        change = part * self._change.on(begin, command, load) + rise
        end_change = part * self._change.on(end, command, end_load) + rise
        most = self._friction.holds_N
        upwards = _tangents_meet_below(most - force, -change, most - end_force, -end_change)
        return upwards | _tangents_meet_below(most + force, change, most + end_force, end_change)


class _Row:
    """A linear form of (states, command, load), without its zeros."""

    def __init__(self, row: np.ndarray, size: int) -> None:
        factors = row.astype(float).tolist()
        self._of_states = [(i, factor) for i, factor in enumerate(factors[:size]) if factor]
        self._of_command, self.of_load = factors[size], factors[size + 2]

    def on(self, z: Any, command: Any, load: Any) -> Any:
        """Its value; ``z`` of shape (states,) or (states, many)."""
        total = self._of_command * command + self.of_load * load
        for i, factor in self._of_states:
            total = total + factor * z[i]
        return total


def _tangents_meet_below(g: Any, slope: Any, end_g: Any, end_slope: Any) -> Any:
    """Whether g falls at the start and rises at the end of a length of 1, and the tangents there meet at 0 or below."""
    turns = (slope < 0.0) & (end_slope > 0.0)
    return turns & (g * (end_slope - slope) <= slope * (end_g - g - end_slope))
