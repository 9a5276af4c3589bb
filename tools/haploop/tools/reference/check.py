"""The continuous plant by another method, to check the reference: integrated numerically from switch to switch."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from mpmath import mp
from scipy.integrate import solve_ivp

from haploop.tools.reference.bodies import COMMAND, FRICTION, LOAD, SLOPE, Bodies

_RELATIVE, _ABSOLUTE = 1e-13, 1e-17


class IntegratedPlant:
    """w' = A w by scipy's DOP853 in floats (Dormand and Prince), with events where friction switches.

    In relative coordinates, each body's from the one before: a stiff cable's force is no difference of two positions.

    Args:
        scene, period_s: as for ``ContinuousPlant``.
    """

    def __init__(self, scene: dict[str, Any], period_s: Any) -> None:
        bodies = Bodies(scene)
        self._v, self._period_s = bodies.count, float(period_s)
        relative, absolute = _coordinates(bodies.count, len(bodies.begin))
        self._rates = {
            stuck: _floats(relative * mp.matrix(rates) * absolute)
            for stuck, rates in ((False, bodies.free), (True, bodies.stuck))
        }
        self._felt = {stuck: _floats(mp.matrix([row]) * absolute)[0] for stuck, row in bodies.felt.items()}
        self._force = _floats(mp.matrix([bodies.force]) * absolute)[0]
        self.w = _floats(relative * mp.matrix(bodies.begin))[:, 0]
        friction = scene.get("friction")
        self._has_friction = friction is not None
        if friction:
            self._kinetic, self._breakaway = friction["kinetic"], friction.get("breakaway", friction["kinetic"])
        self.is_stuck, self._direction = False, 0.0

    @property
    def x(self) -> float:
        """Position of body 0, m."""
        return float(self.w[0])

    @property
    def v(self) -> float:
        """Velocity of body 0, m/s."""
        return float(self.w[self._v])

    def felt(self) -> float:
        """What an accelerometer feels under the force held until now, m/s^2."""
        return float(self._felt[self.is_stuck] @ self.w)

    def begin(self, load: float) -> None:
        """The load at t = 0, N, under which body 0 sticks or slips."""
        self.w[LOAD] = load
        if self._has_friction:
            self._direction = float(np.sign(self.v))
            self._decide()

    def advance(self, command: float, load: float, next_load: float) -> None:
        """Over one tick under a held command; load in N at its start and end."""
        self.w[[COMMAND, LOAD, SLOPE]] = command, load, (next_load - load) / self._period_s
        if not self._has_friction:
            self.w = self._solved(self._period_s, None).y[:, -1].copy()
            return
        self._decide()
        left = self._period_s
        while left > 0.0:
            left -= self._to_switch(left)

    def _decide(self) -> None:
        if self.v == 0.0:
            force = float(self._force @ self.w)
            self.is_stuck = abs(force) <= self._breakaway
            if not self.is_stuck:
                self._direction = math.copysign(1.0, force)
        self.w[FRICTION] = 0.0 if self.is_stuck else -self._direction * self._kinetic

    def _to_switch(self, length: float) -> float:
        """Move until friction switches, at most so long; returns how long it was."""
        v, stuck, direction = self._v, self.is_stuck, self._direction

        def margin(_t: float, w: np.ndarray) -> float:
            return self._breakaway - abs(float(self._force @ w)) if stuck else direction * float(w[v])

        margin.terminal, margin.direction = True, -1.0  # pyright: ignore[reportFunctionMemberAccess]
        solved = self._solved(length, margin)
        if not solved.t_events[0].size:
            self.w = solved.y[:, -1].copy()
            return length
        at = float(solved.t_events[0][0])
        if at > 0.0:  # once more up to there, without interpolation
            self.w = self._solved(at, None).y[:, -1].copy()
        if stuck:
            self.is_stuck, self._direction = False, math.copysign(1.0, float(self._force @ self.w))
            self.w[FRICTION] = -self._direction * self._kinetic
        else:
            self.w[v] = 0.0
            self._decide()
        return at

    def _solved(self, length: float, event: Any) -> Any:
        rates = self._rates[self.is_stuck]
        solved = solve_ivp(
            lambda _t, w: rates @ w, (0.0, length), self.w, "DOP853", events=event, rtol=_RELATIVE, atol=_ABSOLUTE,
            max_step=length / 4.0,
        )  # fmt: skip
        if not solved.success:
            raise ArithmeticError(f"DOP853 did not get through a tick: {solved.message}")
        return solved


def _coordinates(bodies: int, size: int) -> tuple[Any, Any]:
    """Relative coordinates from absolute ones, and back; what is neither position nor velocity stays."""
    relative, absolute = mp.eye(size), mp.eye(size)
    for first in (0, bodies):
        for i in range(1, bodies):
            relative[first + i, first + i - 1] = -1
            for j in range(i):
                absolute[first + i, first + j] = 1
    return relative, absolute


def _floats(matrix: Any) -> np.ndarray:
    return np.array(matrix.tolist(), float)
