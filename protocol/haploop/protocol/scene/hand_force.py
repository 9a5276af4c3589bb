"""The ``[hand.force]`` table: tau(t), one class per kind."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, get_type_hints

from haploop.protocol.quantity import Quantity, si
from haploop.protocol.register import Register, UnknownKind
from haploop.protocol.scene.table import OpenTable, Table

if TYPE_CHECKING:
    from numpy import ndarray


class HandForce(Table):
    """Base of every kind of force: a table of its numbers, and ``force_at``, the force at given times.

    In a batch a number may be an array of shape (members,); times then have the shape (n, 1).
    """

    group: ClassVar[str] = "haploop.hand_forces"
    named_by: ClassVar[str] = "kind"

    def force_at(self, t: ndarray) -> ndarray:
        """Returns the force in N at times in s, in the shape of these, or (n, members)."""
        raise NotImplementedError(f"{type(self).__name__} has no method force_at.")

    def constant_from_s(self) -> float:
        """Returns the time in s from which the force stays the same; infinity if that is not known."""
        return math.inf

    @classmethod
    def of_kind(cls, kind: str) -> type[HandForce]:
        """Returns the class of a kind; for an unavailable kind, one that holds any numbers and makes no force."""
        try:
            return FORCES.find(kind)
        except UnknownKind:
            return _unknown(kind)

    @classmethod
    def alternatives(cls) -> list[type[HandForce]]:
        """Returns every kind that may stand in the table."""
        return [*FORCES.all().values()]

    @classmethod
    def parameters(cls) -> dict[str, tuple[Quantity, Any]]:
        """Returns its numbers by name: the declaration, and the default or MISSING.

        Raises:
            TypeError: one of them is not declared as a number.
        """
        hints, found = get_type_hints(cls, include_extras=True), dict[str, tuple[Quantity, Any]]()
        for name, default in cls._defaults.items():
            marks = [mark for mark in getattr(hints[name], "__metadata__", ()) if isinstance(mark, Quantity)]
            if not marks:
                raise TypeError(f'must declare {name} with its unit, as in {name}: Annotated[float, si("N")].')
            found[name] = marks[0], default
        return found

    @classmethod
    def complaint(cls) -> str:
        """Returns what is wrong with a class that is meant to be a hand's force; "" if nothing is."""
        if cls.force_at is HandForce.force_at:
            return "has no method force_at, which it must define: the force in N at an array of times in s."
        try:
            cls.parameters()
        except TypeError as error:
            return str(error)
        return ""

    def __reduce__(self) -> tuple[Callable[..., HandForce], tuple[str, dict[str, Any]]]:
        """Passes the kind to another process, which has the class of a plugin file only under that name."""
        return _made, (self.kind, vars(self))


class UnknownForce(HandForce, OpenTable):
    """A force whose kind is not available."""

    def force_at(self, t: ndarray) -> ndarray:
        """Raises UnknownKind."""
        FORCES.find(self.kind)
        raise AssertionError(self.kind)


@cache
def _unknown(kind: str) -> type[HandForce]:
    return type("Unknown", (UnknownForce,), {"kind": kind, "__module__": __name__})


def _made(kind: str, values: dict[str, Any]) -> HandForce:
    return HandForce.of_kind(kind)(**values)


Force = Annotated[float, si("N", "force that is reached")]
RiseTime = Annotated[float, si("s", "time from 0 until the force is reached", above=0)]


class Constant(HandForce):
    """The same force throughout."""

    kind = "constant"
    value: Annotated[float, si("N", "the force")]

    def force_at(self, t: ndarray) -> ndarray:
        import numpy as np

        return np.zeros_like(t) + self.value

    def constant_from_s(self) -> float:
        return 0.0


class Ramp(HandForce):
    """A straight line from 0 at t = 0 to value at rise_time, then held."""

    kind = "ramp"
    value: Force
    rise_time: RiseTime

    def force_at(self, t: ndarray) -> ndarray:
        import numpy as np

        return self.value * np.minimum(t / self.rise_time, 1.0)

    def constant_from_s(self) -> float:
        return self.rise_time


class Step(HandForce):
    """0 before the time ``at``, value from then on."""

    kind = "step"
    value: Force
    at: Annotated[float, si("s", "time of the step", at_least=0)]

    def force_at(self, t: ndarray) -> ndarray:
        import numpy as np

        return np.where(t >= self.at, self.value, 0.0)

    def constant_from_s(self) -> float:
        return self.at


class Sine(HandForce):
    """offset + amplitude sin(2 pi frequency t + phase)."""

    kind = "sine"
    amplitude: Annotated[float, si("N", "amplitude of the sine")]
    frequency: Annotated[float, si("Hz", "frequency of the sine", above=0)]
    offset: Annotated[float, si("N", "constant force added")] = 0.0
    phase: Annotated[float, si("rad", "phase at t = 0")] = 0.0

    def force_at(self, t: ndarray) -> ndarray:
        import numpy as np

        return self.offset + self.amplitude * np.sin(2 * np.pi * self.frequency * t + self.phase)


class MinimumJerk(HandForce):
    """value (10 s^3 - 15 s^4 + 6 s^5) with s = t / rise_time, then held (Flash and Hogan 1985)."""

    kind = "minimum-jerk"
    value: Force
    rise_time: RiseTime

    def force_at(self, t: ndarray) -> ndarray:
        import numpy as np

        s = np.minimum(t / self.rise_time, 1.0)
        return self.value * (s * s * s * (10.0 + s * (6.0 * s - 15.0)))

    def constant_from_s(self) -> float:
        return self.rise_time


class Trace(HandForce):
    """Recorded samples, joined by straight lines, held before the first and after the last.

    A scene file gives the lists time and force, or as ``file`` the path of a two-column CSV, relative to its folder.
    """

    kind = "trace"
    time: tuple[Annotated[float, si("s", "time of the sample, later than the one before")], ...]
    force: tuple[Annotated[float, si("N", "force at that time")], ...]

    def force_at(self, t: ndarray) -> ndarray:
        import numpy as np

        return np.interp(t, np.asarray(self.time, float), np.asarray(self.force, float))


# Every kind by the name that a scene gives it.
FORCES: Register[HandForce] = Register(
    "hand force of the kind",
    HandForce.group,
    {force.kind: force for force in (Constant, Ramp, Step, Sine, MinimumJerk, Trace)},
)


def constant_from_s(force: HandForce | None) -> float:
    """Returns the time in s from which a hand's force stays the same: infinite for a sine and for a trace."""
    return 0.0 if force is None else force.constant_from_s()
