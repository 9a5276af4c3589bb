"""The ``[hand.force]`` table: tau(t), one class a kind."""

from __future__ import annotations

import math
from typing import Annotated

from haploop.protocol.quantity import si
from haploop.protocol.scene.table import Table

Force = Annotated[float, si("N", "force that is reached")]
RiseTime = Annotated[float, si("s", "time from 0 until the force is reached", above=0)]


class Constant(Table):
    """The same force throughout."""

    kind = "constant"
    value: Annotated[float, si("N", "the force")]


class Ramp(Table):
    """In a straight line from 0 at t = 0 to value at rise_time, then held."""

    kind = "ramp"
    value: Force
    rise_time: RiseTime


class Step(Table):
    """0 before, value from the time at on."""

    kind = "step"
    value: Force
    at: Annotated[float, si("s", "time of the step", at_least=0)]


class Sine(Table):
    """offset + amplitude sin(2 pi frequency t + phase)."""

    kind = "sine"
    amplitude: Annotated[float, si("N", "amplitude of the sine")]
    frequency: Annotated[float, si("Hz", "frequency of the sine", above=0)]
    offset: Annotated[float, si("N", "constant force added")] = 0.0
    phase: Annotated[float, si("rad", "phase at t = 0")] = 0.0


class MinimumJerk(Table):
    """value (10 s^3 - 15 s^4 + 6 s^5) with s = t / rise_time, then held (Flash and Hogan 1985)."""

    kind = "minimum-jerk"
    value: Force
    rise_time: RiseTime


class Trace(Table):
    """Recorded samples, joined by straight lines, held before the first and after the last.

    A scene file gives the lists time and force, or as ``file`` the path of a CSV of two columns, relative to its own.
    """

    kind = "trace"
    time: tuple[Annotated[float, si("s", "time of the sample, later than the one before")], ...]
    force: tuple[Annotated[float, si("N", "force at that time")], ...]


HandForce = Constant | Ramp | Step | Sine | MinimumJerk | Trace


def constant_from_s(force: HandForce | None) -> float:
    """Returns the time in s from which on a hand's force stays the same: infinite of a sine and of a trace."""
    match force:
        case None | Constant():
            return 0.0
        case Step(at=at):
            return at
        case Ramp(rise_time=rise_time) | MinimumJerk(rise_time=rise_time):
            return rise_time
    return math.inf
