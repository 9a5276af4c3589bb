"""Device and hand as one linear system in any number of digits, its flow, and the roots of its power series.

Only for making references: it needs mpmath, and it is slow.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from mpmath import mp, mpf

from haploop.protocol.scene.scene import Hand, Scene

Row = list[Any]
Matrix = list[Row]
COMMAND, FRICTION, LOAD, SLOPE = -4, -3, -2, -1


class Bodies:
    """w' = A w, w = (positions, velocities, actuator's force, accelerometer's output; command, friction, load, slope).

    [motor -cable-] tip [-grip- hand] - hand's spring - ground, in absolute coordinates (50 digits can afford that).
    Load is tau + k_h rest and rises by its slope, N/s; command and friction are held. p' = 2 pi bandwidth (command - p)
    and y' = 2 pi bandwidth (a - y); both are absent where the scene has no bandwidth.

    Attributes:
        free, stuck: A with body 0 free, and with it held in place.
        force: the row of w that gives the force on body 0 without friction, N.
        sensed: by whether body 0 is stuck, the row of w that an accelerometer feels.
        begin: w at t = 0, with nothing acting.
    """

    def __init__(self, scene: Scene) -> None:
        device, hand, cable, meter = scene.device, scene.hand or Hand(), scene.transmission, scene.accelerometer
        masses, ground, links = [mpf(device.mass)], [mpf(device.damping)], []
        if cable:
            masses.insert(0, mpf(cable.motor_mass))
            ground.insert(0, mpf(cable.motor_damping))
            links.append((cable.stiffness, cable.damping))
        tip = len(masses) - 1
        if hand.grip:
            masses.append(mpf(0))
            ground.append(mpf(0))
            links.append((hand.grip.stiffness, hand.grip.damping))
        masses[-1] += mpf(hand.mass)
        ground[-1] += mpf(hand.damping)
        n = self.count = len(masses)
        actuator = scene.actuator.bandwidth if scene.actuator else None
        output = meter.bandwidth if meter else None
        size = 2 * n + bool(actuator) + bool(output) + 4
        sensor = 0 if meter and meter.mount == "motor" else tip

        forces = [[mpf(0)] * size for _ in masses]
        for i, (stiffness, damping) in enumerate(links):
            for body, sign in ((i, 1), (i + 1, -1)):
                for state, value in ((i, stiffness), (n + i, damping)):
                    forces[body][state] -= sign * mpf(value)
                    forces[body][state + 1] += sign * mpf(value)
        for body in range(n):
            forces[body][n + body] -= ground[body]
        forces[-1][n - 1] -= mpf(hand.stiffness)
        forces[-1][LOAD] += 1
        forces[0][2 * n if actuator else COMMAND] += 1
        self.force = forces[0].copy()
        forces[0][FRICTION] += 1
        free = [[entry / mass for entry in row] for row, mass in zip(forces, masses, strict=True)]
        held = [[mpf(0)] * size, *free[1:]]
        self.sensed = {False: free[sensor], True: held[sensor]}

        def rates(accelerations: Matrix, stuck: bool) -> Matrix:
            moving = [[mpf(j == n + i and not (stuck and i == 0)) for j in range(size)] for i in range(n)]
            rows = [*moving, *accelerations]
            if actuator:
                rate = 2 * mp.pi * mpf(actuator)
                rows.append([rate * ((j == size + COMMAND) - (j == 2 * n)) for j in range(size)])
            if output:
                rate, y = 2 * mp.pi * mpf(output), len(rows)
                rows.append([rate * (a - (j == y)) for j, a in enumerate(accelerations[sensor])])
                self.sensed = {mode: [mpf(j == y) for j in range(size)] for mode in (False, True)}
            zero = [mpf(0)] * size
            return [*rows, zero, zero, [mpf(j == size + SLOPE) for j in range(size)], zero]

        self.free, self.stuck = rates(free, False), rates(held, True)
        self.begin = [mpf(device.position)] * n + [mpf(device.velocity)] * n + [mpf(0)] * (size - 2 * n)


class Flow:
    """e^{A t} of one mode: over a fixed length by the matrix exponential, over any shorter length by its series."""

    def __init__(self, rates: Matrix, length_s: Any) -> None:
        self._rates = rates
        self._over = mp.expm(mp.matrix(rates) * length_s).tolist()

    def whole(self, w: Row) -> Row:
        return _times(self._over, w)

    def part(self, w: Row, t: Any) -> Row:
        """Returns w after t, by its series sum (A t)^k w / k!, until the terms are below the last digit."""
        total, term, order = list(w), list(w), 0
        while any(abs(part) > mp.eps * mpf(1e-10) * abs(whole) for part, whole in zip(term, total, strict=True)):
            order += 1
            term = [entry * t / order for entry in _times(self._rates, term)]
            total = [whole + part for whole, part in zip(total, term, strict=True)]
        return total

    def taylor(self, row: Row, terms: int) -> Matrix:
        """Returns the rows r_k = row A^k / k!: row . w(t) = sum r_k . w(0) t^k."""
        columns, rows = [list(column) for column in zip(*self._rates, strict=True)], [row]
        for order in range(1, terms):
            rows.append([entry / order for entry in _times(columns, rows[-1])])
        return rows


def fastest_rate(bodies: Bodies) -> float:
    """Returns the largest magnitude of an eigenvalue of both modes, 1/s."""
    both = (np.array([[float(entry) for entry in row] for row in rates]) for rates in (bodies.free, bodies.stuck))
    return max(float(np.abs(np.linalg.eigvals(rates)).max()) for rates in both)


def product(row: Row, w: Sequence[Any]) -> Any:
    return mp.fdot((a, b) for a, b in zip(row, w, strict=True) if a and b)


def _times(rows: Matrix, w: Sequence[Any]) -> Row:
    return [product(row, w) for row in rows]


def sign_changes(series: Row, length: Any) -> Row:
    """Returns all t in [0, length] at which the polynomial sum series[k] t^k changes its sign, in order.

    Where the constant outweighs all other terms there is none. Else the roots of the derivative cut the interval into
    pieces in which the polynomial only rises or only falls, and each holds at most one.
    """
    rest, power = mpf(0), mpf(1)
    for coefficient in series[1:]:
        power *= length
        rest += abs(coefficient) * power
    if abs(series[0]) > rest or not rest:
        return []
    turns = sign_changes([k * coefficient for k, coefficient in enumerate(series)][1:], length)
    ends = [mpf(0), *turns, length]
    found = []
    for begin, end in pairwise(ends):
        at_begin, at_end = _value(series, begin), _value(series, end)
        if at_begin == 0:
            found.append(begin)
        elif at_begin * at_end < 0:
            found.append(_between(series, begin, end, at_begin))
    return found


def _between(series: Row, begin: Any, end: Any, at_begin: Any) -> Any:
    """Finds the one root in between by Newton's steps, with a bisection wherever they would leave the bracket."""
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


def _value(series: Row, t: Any) -> Any:
    total = mpf(0)
    for coefficient in reversed(series):
        total = total * t + coefficient
    return total
