"""Dry friction: its law, and whether the first body of a chain sticks or slips under it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.chain.history import HELD, ChainHistory, StickSlipState
from haploop.protocol.scene import effects
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase

# Sticking ends beyond the breakaway force by this much, relative: what rounding does to a sum of forces is far less.
_MARGIN = 1e-12


class Friction:
    """F(v) = kinetic + (breakaway - kinetic) exp(-(v / v_s)^2) against the motion; at rest up to ``breakaway``.

    Without a Stribeck velocity F is ``kinetic`` at every speed; without a breakaway force that is ``kinetic``, too
    (Armstrong-Helouvry, Dupont and Canudas de Wit 1994).

    Attributes:
        kinetic_N: F at high speed.
        is_constant: whether F is the same at every speed.
        holds_N: the largest force it holds at rest.
    """

    def __init__(self, table: effects.Friction) -> None:
        self.kinetic_N = table.kinetic
        self._breakaway_N = table.kinetic if table.breakaway is None else table.breakaway
        self._stribeck_m_s = table.stribeck_velocity or 0.0
        self.is_constant = not self._stribeck_m_s
        self.holds_N = self._breakaway_N * (1.0 + _MARGIN)

    def at(self, v: float) -> float:
        """Returns F in N at velocity v in m/s."""
        if self.is_constant:
            return self.kinetic_N
        return self.kinetic_N + (self._breakaway_N - self.kinetic_N) * math.exp(-((v / self._stribeck_m_s) ** 2))

    def holds(self, force):
        """Tells whether a body at rest stays there under this force (N; a float or an array)."""
        return abs(force) <= self.holds_N


class StickSlip:
    """Stuck, while friction holds the other forces on body 0; slipping in a direction, until v changes its sign.

    Between two states of a smooth motion the mode is watched by its margin g >= 0: the speed in its direction, or what
    friction could hold beyond the forces. g < 0 at the end means it has ceased. It may have ceased and be back where g
    falls at the start and rises at the end: its least value is not below where the tangents at both ends meet.
    States are arrays of shape (states,), or (states, many) with the other arguments to match; forces are in N.
    """

    def __init__(self, chain: Chain, friction: Friction, step_s: float) -> None:
        self.friction, self._v, self._size = friction, chain.count, len(chain.states)
        pull = chain.accelerations()[0] * chain.masses_kg[0]
        self._force = _Row(pull, self._size)
        self._change = _Row(pull[: self._size] @ chain.rates(stuck=True) * step_s, self._size)
        self._speed_up = step_s / chain.masses_kg[0]

    def decide_at_rest(self, mode: StickSlipState, z: np.ndarray, command: float, load: float) -> StickSlipState:
        """Returns the mode from a state on: where v is exactly 0, sticking, or slipping where the other forces pull."""
        if z[self._v] != 0.0:
            return mode
        holds, direction = self.at_rest(z, command, load)
        return StickSlipState(bool(holds), float(direction))

    def at_rest(self, z: Any, command: Any, load: Any) -> StickSlipState:
        force = self._force.on(z, command, load)
        return StickSlipState(self.friction.holds(force), np.copysign(1.0, force))

    def friction_at(self, mode: StickSlipState, v: float) -> float:
        """Returns the friction force at velocity v, N; none at rest."""
        return -mode.direction * self.friction.at(v) if v else 0.0

    def slipping(self, mode: StickSlipState) -> Any:
        """Returns the friction force while the mode holds, where it is the same at every speed, N."""
        return 0.0 if mode.is_stuck else -mode.direction * self.friction.kinetic_N

    def holds_through(self, mode: StickSlipState, z: Any, command: Any, load: Any) -> Any:
        """Tells whether the mode still holds in state z; all of many stick or all slip."""
        if mode.is_stuck:
            return self.friction.holds(self._force.on(z, command, load))
        return mode.direction * z[self._v] > 0.0

    def may_switch_within(
        self, mode: StickSlipState, begin: Any, end: Any, command: Any, load: Any, end_load: Any, friction: Any,
        part: float,
    ) -> Any:  # fmt: skip
        """Tells whether the mode may cease and be back between two states in which it holds.

        They are ``part`` of a plant step apart, with command and friction force held; all of many stick or all slip.
        """
        force, end_force = self._force.on(begin, command, load), self._force.on(end, command, end_load)
        if not mode.is_stuck:
            gain, speeds = mode.direction * part * self._speed_up, (begin[self._v], end[self._v])
            g, end_g = (mode.direction * v for v in speeds)
            return _tangents_meet_below(g, gain * (force + friction), end_g, gain * (end_force + friction))
        rise = self._force.of_load * (end_load - load)
        change = part * self._change.on(begin, command, load) + rise
        end_change = part * self._change.on(end, command, end_load) + rise
        most = self.friction.holds_N
        upwards = _tangents_meet_below(most - force, -change, most - end_force, -end_change)
        return upwards | _tangents_meet_below(most + force, change, most + end_force, end_change)


class _Row:
    """A linear form of (states, command, load), without its zeros."""

    def __init__(self, row: np.ndarray, size: int) -> None:
        factors = row.astype(float).tolist()
        self._of_states = [(i, factor) for i, factor in enumerate(factors[:size]) if factor]
        self._of_command, self.of_load = factors[size], factors[size + 2]

    def on(self, z: Any, command: Any, load: Any) -> Any:
        """Returns its value; ``z`` of shape (states,) or (states, many)."""
        total = self._of_command * command + self.of_load * load
        for i, factor in self._of_states:
            total = total + factor * z[i]
        return total


def _tangents_meet_below(g: Any, slope: Any, end_g: Any, end_slope: Any) -> Any:
    """Tells whether g falls at the start and rises at the end of a length of 1, and the tangents meet at 0 or below."""
    turns = (slope < 0.0) & (end_slope > 0.0)
    return turns & (g * (end_slope - slope) <= slope * (end_g - g - end_slope))


class RubbingHistory(ChainHistory):
    """State and record of a chain whose first body sticks and slips; goes before the motion without friction."""

    held_names = (*HELD, "friction", "stuck")

    def __init__(self, scene: Scene, time: Timebase, *members: int | None) -> None:
        assert scene.friction
        self.friction = Friction(scene.friction)
        super().__init__(scene, time, *members)

    def _begun(self, z: np.ndarray) -> tuple[np.ndarray, StickSlipState | None]:
        self._stick_slip = StickSlip(self.chain, self.friction, self._step_s)
        return self.begun_under(z, float(self.loads(0, 1)[0]))

    def begun_under(self, z: np.ndarray, load: float) -> tuple[np.ndarray, StickSlipState]:
        """Returns (what is held at the start of one run in state z, shape (states,), under a load in N; the mode)."""
        slipping = StickSlipState(False, math.copysign(1.0, z[self._v]))
        mode = self._stick_slip.decide_at_rest(slipping, z, 0.0, load)
        friction = self._stick_slip.friction_at(mode, z[self._v])
        return np.array([0.0, -1.0, friction, float(mode.is_stuck)]), mode
