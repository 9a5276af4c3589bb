"""The continuous plant moved tick by tick, every instant at which friction switches found to 1e-30 s."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from mpmath import mp, mpf

from haploop.tools.reference.bodies import COMMAND, FRICTION, LOAD, SLOPE, Bodies, Flow, Row, fastest_rate

# Pieces in which a switch is looked for are no longer than this part of the fastest time constant or radian ...
_PART = 0.25
# ... so that this many terms of a series are good for sixty digits: 0.25^40 / 40! = 1e-72.
_TERMS = 40
_INSTANT_S = "1e-30"


class ContinuousPlant:
    """The plant of a scene under held commands and a load that is linear between ticks.

    Without friction a tick is one matrix exponential. With friction it is cut into pieces; in each the margin of the
    mode (the speed in its direction, or what friction could hold beyond the forces) is a power series in t, whose
    first root, if there is one, is where the mode ends. None is missed: see ``roots``.

    Args:
        scene: resolved; friction without a Stribeck velocity, since that is not linear.
        period_s: one tick, as an exact number.
    """

    def __init__(self, scene: dict[str, Any], period_s: Any) -> None:
        self._bodies = bodies = Bodies(scene)
        self._period_s, self.w = period_s, list(bodies.begin)
        friction = scene.get("friction")
        self._v = bodies.count
        self.is_stuck, self._direction, self.switches = False, 0, 0
        self._parts = 1
        if friction:
            self._kinetic = mpf(friction["kinetic"])
            self._breakaway = mpf(friction.get("breakaway", friction["kinetic"]))
            while fastest_rate(bodies) * float(period_s) / self._parts > _PART:
                self._parts *= 2
        length = period_s / self._parts
        self._flows = {False: Flow(bodies.free, length)}
        if friction:
            self._flows[True] = Flow(bodies.stuck, length)
            speed = [mpf(j == self._v) for j in range(len(self.w))]
            self._margins = {
                stuck: self._flows[stuck].taylor(row, _TERMS) for stuck, row in ((False, speed), (True, bodies.force))
            }
        self._has_friction = bool(friction)

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
        return float(_product(self._bodies.felt[self.is_stuck], self.w))

    def begin(self, load: Any) -> None:
        """The load at t = 0, N, under which body 0 sticks or slips."""
        self.w[LOAD] = load
        if self._has_friction:
            self._direction = _sign(self.w[self._v])
            self._decide()

    def advance(self, command: float, load: Any, next_load: Any) -> None:
        """Over one tick under a held command; load in N at its start and end."""
        self.w[COMMAND], self.w[LOAD] = mpf(command), load
        self.w[SLOPE] = (next_load - load) / self._period_s
        if self._has_friction:
            self._decide()
        for _ in range(self._parts):
            if self._has_friction:
                self._through(self._period_s / self._parts)
            else:
                self.w = self._flows[False].whole(self.w)

    def _force(self) -> Any:
        """On body 0 without friction, N."""
        return _product(self._bodies.force, self.w)

    def _decide(self) -> None:
        """Where v is 0: stick if friction can hold the other forces, else slip where they pull."""
        w = self.w
        if w[self._v] == 0:
            force = self._force()
            self.is_stuck = abs(force) <= self._breakaway
            if not self.is_stuck:
                self._direction = _sign(force)
        w[FRICTION] = mpf(0) if self.is_stuck else -self._direction * self._kinetic

    def _through(self, length: Any) -> None:
        """Through one piece, from switch to switch."""
        left = length
        while (at := self._mode_ends(left)) is not None:
            self.w = self._flows[self.is_stuck].part(self.w, at)
            left -= at
            self.switches += 1
            if self.is_stuck:
                self.is_stuck, self._direction = False, _sign(self._force())
                self.w[FRICTION] = -self._direction * self._kinetic
            else:
                self.w[self._v] = mpf(0)
                self._decide()
        flow = self._flows[self.is_stuck]
        self.w = flow.whole(self.w) if left == length else flow.part(self.w, left)

    def _mode_ends(self, length: Any) -> Any:
        """When the present mode ends, s, or None if it lasts for ``length``."""
        series = [_product(row, self.w) for row in self._margins[self.is_stuck]]
        levels = (self._breakaway, -self._breakaway) if self.is_stuck else (mpf(0),)
        found = [t for level in levels for t in roots([series[0] - level, *series[1:]], length)]
        return min((t for t in found if t > mpf(_INSTANT_S)), default=None)


def _product(row: Row, w: Row) -> Any:
    return mp.fdot(zip(row, w, strict=True))


def _sign(value: Any) -> int:
    return (value > 0) - (value < 0)


Series = list[Any]


def roots(series: Series, length: Any) -> Series:
    """All t in [0, length] at which the polynomial sum series[k] t^k changes its sign, in order.

    Where the constant outweighs all other terms there is none. Else the roots of the derivative cut the interval into
    pieces in which it only rises or only falls, and each holds one at most.
    """
    rest, power = mpf(0), mpf(1)
    for coefficient in series[1:]:
        power *= length
        rest += abs(coefficient) * power
    if abs(series[0]) > rest or not rest:
        return []
    turns = roots([k * coefficient for k, coefficient in enumerate(series)][1:], length)
    ends = [mpf(0), *turns, length]
    found = []
    for begin, end in pairwise(ends):
        at_begin, at_end = _value(series, begin), _value(series, end)
        if at_begin == 0:
            found.append(begin)
        elif at_begin * at_end < 0:
            found.append(_between(series, begin, end, at_begin))
    return found


def _between(series: Series, begin: Any, end: Any, at_begin: Any) -> Any:
    """The one root between: Newton's steps, and a bisection wherever they would leave the bracket."""
    slope_series = [k * coefficient for k, coefficient in enumerate(series)][1:]
    t = (begin + end) / 2
    while end - begin > mp.eps * end:
        value, slope = _value(series, t), _value(slope_series, t)
        if value == 0:
            return t
        begin, end = (t, end) if value * at_begin > 0 else (begin, t)
        step = value / slope if slope else mp.inf
        t, before = t - step, t
        if not begin < t < end:
            t = (begin + end) / 2
        if abs(t - before) < mp.eps * abs(end):
            break
    return t


def _value(series: Series, t: Any) -> Any:
    total = mpf(0)
    for coefficient in reversed(series):
        total = total * t + coefficient
    return total
