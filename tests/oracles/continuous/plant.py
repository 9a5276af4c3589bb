"""The continuous plant tick by tick: in any number of digits, and by DOP853 to check it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
import scipy
from mpmath import mp, mpf

from haploop.protocol.scene.scene import Scene
from oracles.continuous.bodies import (
    COMMAND,
    FRICTION,
    LOAD,
    SLOPE,
    Bodies,
    Flow,
    Row,
    fastest_rate,
    product,
    sign_changes,
)

# Pieces in which a switch is looked for are no longer than this part of the fastest time constant or radian ...
_PART = 0.25
# ... so that this many terms of a series are good for sixty digits: 0.25^40 / 40! = 1e-72.
_TERMS = 40
_INSTANT_S = "1e-30"
# Tolerances of DOP853.
_RELATIVE, _ABSOLUTE = 1e-13, 1e-17
Vector = TypeVar("Vector", bound=Any)


class StickSlipPlant(ABC, Generic[Vector]):
    """Motion w' = A w with body 0 free or held; where its velocity is 0, friction decides which.

    Args:
        scene: resolved; friction without a Stribeck velocity, since that is not linear.
        w: states at t = 0.
        number: converts a float of the scene to the numbers of w.

    Attributes:
        w: states, as in ``Bodies``.
    """

    def __init__(self, scene: Scene, bodies: Bodies, w: Vector, number: Any) -> None:
        self.w: Vector = w
        self.is_stuck = False
        self._bodies, self._v, self._direction = bodies, bodies.count, 0
        self._has_friction = scene.friction is not None
        if scene.friction:
            kinetic, breakaway = scene.friction.kinetic, scene.friction.breakaway
            self._kinetic, self._breakaway = number(kinetic), number(kinetic if breakaway is None else breakaway)

    @abstractmethod
    def _force(self) -> Any:
        """Returns the force on body 0 without friction, N."""

    @property
    def x(self) -> float:
        return float(self.w[0])

    @property
    def v(self) -> float:
        return float(self.w[self._v])

    def begin(self, load: Any) -> None:
        """Sets the load at t = 0, N, under which body 0 sticks or slips."""
        self.w[LOAD] = load
        if self._has_friction:
            self._direction = _sign(self.w[self._v])
            self._decide()

    def _decide(self) -> None:
        """Lets body 0 stick at v = 0 if friction can hold the other forces, or else slip in their direction."""
        if self.w[self._v] == 0:
            force = self._force()
            self.is_stuck = abs(force) <= self._breakaway
            if not self.is_stuck:
                self._direction = _sign(force)
        self.w[FRICTION] = 0 * self._kinetic if self.is_stuck else -self._direction * self._kinetic

    def _switch(self) -> None:
        """Ends the present mode: a stuck body slips in the direction of the force, a slipping one has come to v = 0."""
        if self.is_stuck:
            self.is_stuck, self._direction = False, _sign(self._force())
            self.w[FRICTION] = -self._direction * self._kinetic
        else:
            self.w[self._v] = 0 * self.w[self._v]
            self._decide()


class ContinuousPlant(StickSlipPlant[Row]):
    """The plant of a scene under held commands and a load that is linear between ticks, in mpmath's digits.

    Without friction a tick is one matrix exponential. With friction it is cut into pieces; in each the margin of the
    mode (the speed in its direction, or the force that friction could hold beyond the others) is a power series in t.
    Its first root, if there is one, is where the mode ends, known to 1e-30 s. None is missed: see ``sign_changes``.

    Args:
        period_s: one tick, as an exact number.
    """

    def __init__(self, scene: Scene, period_s: Any) -> None:
        bodies = Bodies(scene)
        super().__init__(scene, bodies, list(bodies.begin), mpf)
        self._period_s, self._parts, self.switches = period_s, 1, 0
        while self._has_friction and fastest_rate(bodies) * float(period_s) / self._parts > _PART:
            self._parts *= 2
        length = period_s / self._parts
        self._flows = {False: Flow(bodies.free, length)}
        if self._has_friction:
            self._flows[True] = Flow(bodies.stuck, length)
            speed = [mpf(j == self._v) for j in range(len(self.w))]
            self._margins = {
                stuck: self._flows[stuck].taylor(row, _TERMS) for stuck, row in ((False, speed), (True, bodies.force))
            }

    def sensed(self) -> float:
        """Returns the acceleration an accelerometer feels under the force held until now, m/s^2."""
        return float(product(self._bodies.sensed[self.is_stuck], self.w))

    def advance(self, command: float, load: Any, next_load: Any) -> None:
        """Advances one tick under a held command; load in N at its start and end."""
        self.w[COMMAND], self.w[LOAD] = mpf(command), load
        self.w[SLOPE] = (next_load - load) / self._period_s
        if not self._has_friction:
            self.w = self._flows[False].whole(self.w)
            return
        self._decide()
        for _ in range(self._parts):
            self._through(self._period_s / self._parts)

    def _force(self) -> Any:
        return product(self._bodies.force, self.w)

    def _through(self, length: Any) -> None:
        left = length
        while (at := self._mode_ends(left)) is not None:
            self.w = self._flows[self.is_stuck].part(self.w, at)
            left -= at
            self.switches += 1
            self._switch()
        flow = self._flows[self.is_stuck]
        self.w = flow.whole(self.w) if left == length else flow.part(self.w, left)

    def _mode_ends(self, length: Any) -> Any:
        """Returns when the present mode ends, s; None if it lasts for ``length``."""
        series = [product(row, self.w) for row in self._margins[self.is_stuck]]
        levels = (self._breakaway, -self._breakaway) if self.is_stuck else (mpf(0),)
        found = [t for level in levels for t in sign_changes([series[0] - level, *series[1:]], length)]
        return min((t for t in found if t > mpf(_INSTANT_S)), default=None)


class IntegratedPlant(StickSlipPlant[np.ndarray]):
    """The plant of a scene by scipy's DOP853 in floats (Dormand and Prince), with events where friction switches.

    It uses relative coordinates, each body's from the one before, so that a stiff cable's force is not a difference of
    two positions.
    """

    def __init__(self, scene: Scene, period_s: Any) -> None:
        bodies = Bodies(scene)
        relative, absolute = _coordinates(bodies.count, len(bodies.begin))
        super().__init__(scene, bodies, _floats(relative * mp.matrix(bodies.begin))[:, 0], float)
        self._period_s = float(period_s)
        self._rates = {
            stuck: _floats(relative * mp.matrix(rates) * absolute)
            for stuck, rates in ((False, bodies.free), (True, bodies.stuck))
        }
        self._sensed = {stuck: _floats(mp.matrix([row]) * absolute)[0] for stuck, row in bodies.sensed.items()}
        self._row = _floats(mp.matrix([bodies.force]) * absolute)[0]

    def sensed(self) -> float:
        return float(self._sensed[self.is_stuck] @ self.w)

    def advance(self, command: float, load: float, next_load: float) -> None:
        self.w[[COMMAND, LOAD, SLOPE]] = command, load, (next_load - load) / self._period_s
        if not self._has_friction:
            self.w = self._solved(self._period_s, None).y[:, -1].copy()
            return
        self._decide()
        left = self._period_s
        while left > 0.0:
            left -= self._to_switch(left)

    def _force(self) -> float:
        return float(self._row @ self.w)

    def _to_switch(self, length: float) -> float:
        """Advances by at most ``length``; returns by how much it did."""
        if self.is_stuck:
            switch = _Switch(lambda w: self._breakaway - abs(float(self._row @ w)))
        else:
            switch = _Switch(lambda w: self._direction * float(w[self._v]))
        solved = self._solved(length, switch)
        if not solved.t_events[0].size:
            self.w = solved.y[:, -1].copy()
            return length
        at = float(solved.t_events[0][0])
        if at > 0.0:  # once more up to there, without interpolation
            self.w = self._solved(at, None).y[:, -1].copy()
        self._switch()
        return at

    def _solved(self, length: float, event: Any) -> Any:
        rates = self._rates[self.is_stuck]
        solved = scipy.integrate.solve_ivp(
            lambda _t, w: rates @ w, (0.0, length), self.w, "DOP853", events=event, rtol=_RELATIVE, atol=_ABSOLUTE,
            max_step=length / 4.0,
        )  # fmt: skip
        if not solved.success:
            raise ArithmeticError(f"DOP853 did not get through a tick: {solved.message}")
        return solved


class _Switch(NamedTuple):
    """An event of ``solve_ivp`` that ends the motion where the margin falls below 0."""

    margin: Callable[[np.ndarray], float]
    terminal: bool = True
    direction: float = -1.0

    def __call__(self, _t: float, w: np.ndarray) -> float:
        return self.margin(w)


def _coordinates(bodies: int, size: int) -> tuple[Any, Any]:
    """Returns the matrices from absolute to relative coordinates, and back; other states stay unchanged."""
    relative, absolute = mp.eye(size), mp.eye(size)
    for first in (0, bodies):
        for i in range(1, bodies):
            relative[first + i, first + i - 1] = -1
            for j in range(i):
                absolute[first + i, first + j] = 1
    return relative, absolute


def _floats(matrix: Any) -> np.ndarray:
    return np.array(matrix.tolist(), float)


def _sign(value: Any) -> int:
    return int(value > 0) - int(value < 0)
