"""Dry friction: its law, and whether the first body of a chain sticks or slips under it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from haploop.plant.chain.chain import Chain
from haploop.plant.chain.history import HELD, ChainHistory, StickSlipState
from haploop.protocol.scene import effects
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase

# Sticking ends this much (relative) beyond the breakaway force: rounding changes a sum of forces by far less.
_MARGIN = 1e-12


class Friction(NamedTuple):
    """F(v) = kinetic + (breakaway - kinetic) exp(-(v / v_s)^2) against the motion; at rest up to ``breakaway``.

    Without a Stribeck velocity F is ``kinetic`` at every speed; without a breakaway force, that one is ``kinetic``, too
    (Armstrong-Helouvry, Dupont and Canudas de Wit 1994).

    Attributes:
        kinetic_N: F at high speed.
        breakaway_N: F near rest.
        stribeck_m_s: v_s; 0 where F is the same at every speed.
        holds_N: the largest force it holds at rest.
    """

    kinetic_N: float
    breakaway_N: float
    stribeck_m_s: float
    holds_N: float

    @classmethod
    def of(cls, table: effects.Friction) -> Friction:
        breakaway_N = table.kinetic if table.breakaway is None else table.breakaway
        return cls(table.kinetic, breakaway_N, table.stribeck_velocity or 0.0, breakaway_N * (1.0 + _MARGIN))


# The functions below serve one run with plain numbers, many runs at once with arrays and, unchanged, the loops of
# machine code.


def friction_at(law: Friction, v: float) -> float:
    """Returns F in N at velocity v in m/s."""
    if law.stribeck_m_s == 0.0:
        return law.kinetic_N
    part = v / law.stribeck_m_s
    return law.kinetic_N + (law.breakaway_N - law.kinetic_N) * math.exp(-(part * part))


def holds_against(law: Friction, force: Any) -> Any:
    """Tells whether a body at rest stays there under this force (N; a float or an array)."""
    return abs(force) <= law.holds_N


class Row(NamedTuple):
    """A linear form of (states, command, load), without its zeros: (which state, factor) of each nonzero term."""

    of_states: Any
    of_command: float
    of_load: float

    @classmethod
    def of(cls, row: np.ndarray, size: int) -> Row:
        factors = row.astype(float).tolist()
        of_states = [(i, factor) for i, factor in enumerate(factors[:size]) if factor]
        return cls(of_states, factors[size], factors[size + 2])


def row_on(row: Row, z: Any, command: Any, load: Any) -> Any:
    """Returns the value of a linear form; ``z`` of shape (states,) or (states, many)."""
    total = row.of_command * command + row.of_load * load
    for i, factor in row.of_states:
        total = total + factor * z[i]
    return total


class StickSlip(NamedTuple):
    """Body 0, stuck while friction holds the other forces on it, or slipping in a direction until v changes sign.

    Between two states of a smooth motion the mode is watched by its margin g >= 0: the speed in its direction, or the
    force that friction could still hold. g < 0 at the end means that the mode has ceased. It may have ceased and
    returned where g falls at the start and rises at the end; the least value of g is then not below the point where
    the tangents at both ends meet. States are arrays of shape (states,), or (states, many) with the other arguments to
    match; forces are in N.

    Attributes:
        law: of friction.
        v: the number of bodies, and the place of the velocity of body 0 among the states.
        mass_kg: of body 0.
        speed_up: change of its speed caused by 1 N over a plant step, m/s.
        force: the sum of the other forces on it.
        change: by how much the states alone change that sum in a plant step while body 0 sticks, N.
    """

    law: Friction
    v: int
    mass_kg: float
    speed_up: float
    force: Row
    change: Row

    @classmethod
    def of(cls, chain: Chain, law: Friction, step_s: float) -> StickSlip:
        size, mass_kg = len(chain.states), chain.masses_kg[0]
        pull = chain.accelerations()[0] * mass_kg
        change = Row.of(pull[:size] @ chain.rates(stuck=True) * step_s, size)
        return cls(law, chain.count, mass_kg, step_s / mass_kg, Row.of(pull, size), change)


def decide_at_rest(of: StickSlip, mode: StickSlipState, z: Any, command: float, load: float) -> StickSlipState:
    """Returns the mode from a state on: if v is exactly 0, sticking, or slipping the way the other forces pull."""
    if z[of.v] != 0.0:
        return mode
    force = row_on(of.force, z, command, load)
    return StickSlipState(bool(holds_against(of.law, force) and of.law.holds_N > 0.0), math.copysign(1.0, force))


def slipping(of: StickSlip, mode: StickSlipState) -> Any:
    """Returns the friction force while the mode holds, where it is the same at every speed, N."""
    return 0.0 if mode.is_stuck else -mode.direction * of.law.kinetic_N


def slipping_at(of: StickSlip, mode: StickSlipState, v: float) -> float:
    """Returns the friction force at velocity v, N; 0 at rest."""
    return -mode.direction * friction_at(of.law, v) if v else 0.0


def holds_through(of: StickSlip, mode: StickSlipState, z: Any, command: Any, load: Any) -> Any:
    """Tells whether the mode still holds in state z; of many states all stick or all slip."""
    if mode.is_stuck:
        return holds_against(of.law, row_on(of.force, z, command, load))
    return mode.direction * z[of.v] > 0.0


def creeps(of: StickSlip, mode: StickSlipState, v: Any) -> Any:
    """Tells whether body 0 slips so slowly that the margin of the breakaway force would stop it within a plant step.

    That counts as rest, wherever friction holds the other forces as well. A device on a damped hand whose friction is
    the same at every speed comes to rest like this: it creeps, v = c exp(-t / T), and never reaches 0. In the end its v
    would be the rounding of what moves it, and would change sign with that.
    """
    return (not mode.is_stuck) & (abs(v) < _MARGIN * of.speed_up * of.law.holds_N)


def may_switch_within(
    of: StickSlip, mode: StickSlipState, begin: Any, end: Any, command: Any, load: Any, end_load: Any, friction: Any,
    part: float,
) -> Any:  # fmt: skip
    """Tells whether the mode may cease and return between two states in which it holds.

    They are ``part`` of a plant step apart, with command and friction force held; of many states all stick or all slip.
    """
    force, end_force = row_on(of.force, begin, command, load), row_on(of.force, end, command, end_load)
    if not mode.is_stuck:
        gain = mode.direction * part * of.speed_up
        g, end_g = mode.direction * begin[of.v], mode.direction * end[of.v]
        return tangents_meet_below(g, gain * (force + friction), end_g, gain * (end_force + friction))
    rise = of.force.of_load * (end_load - load)
    change = part * row_on(of.change, begin, command, load) + rise
    end_change = part * row_on(of.change, end, command, end_load) + rise
    most = of.law.holds_N
    upwards = tangents_meet_below(most - force, -change, most - end_force, -end_change)
    return upwards | tangents_meet_below(most + force, change, most + end_force, end_change)


def tangents_meet_below(g: Any, slope: Any, end_g: Any, end_slope: Any) -> Any:
    """Tells whether g falls at the start and rises at the end of a length of 1, and the tangents meet at 0 or below."""
    turns = (slope < 0.0) & (end_slope > 0.0)
    return turns & (g * (end_slope - slope) <= slope * (end_g - g - end_slope))


class RubbingHistory(ChainHistory):
    """State and record of a chain whose first body sticks and slips; a base before the motion without friction."""

    held_names = (*HELD, "friction", "stuck")

    def __init__(self, scene: Scene, time: Timebase, *members: int | None) -> None:
        assert scene.friction
        self.friction = Friction.of(scene.friction)
        super().__init__(scene, time, *members)

    def _begun(self, z: np.ndarray) -> tuple[np.ndarray, StickSlipState | None]:
        self.stick_slip = StickSlip.of(self.chain, self.friction, self._step_s)
        return self.begun_under(z, float(self.loads(0, 1)[0]))

    def begun_under(self, z: np.ndarray, load: float) -> tuple[np.ndarray, StickSlipState]:
        """Returns (what is held at the start of one run in state z, shape (states,), under a load in N; the mode)."""
        begun = StickSlipState(False, math.copysign(1.0, z[self._v]))
        mode = decide_at_rest(self.stick_slip, begun, z, 0.0, load)
        friction = slipping_at(self.stick_slip, mode, z[self._v])
        return np.array([0.0, -1.0, friction, float(mode.is_stuck)]), mode
