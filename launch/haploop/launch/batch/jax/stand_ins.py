"""What takes the place of the hand, of random numbers and of rounding in a tick that is compiled."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax


class Given:
    """The force of the hand about one tick; stands in for a ``HandForce``."""

    def __init__(self, first: int, force: Any) -> None:
        self._first, self._force = first, force

    def at_steps(self, first: int, last: int) -> Any:
        """tau at the steps first ... last - 1."""
        return self._force[first - self._first : last - self._first]


class Outside(NamedTuple):
    """What comes to a tick from outside.

    Attributes:
        tau: hand force at the steps of the interval and at its end, N, shape (n + 1, 1 or loops).
        response: D of the interval, shape (n + 1, 2, 1), where all loops have the same; else None.
        noise: a row of every random stream, shape (loops,) or () each.
        zero: a whole number, which the compiler cannot know.
        commands: the two that act in the interval, the older first, N; of those that were computed before this tick.
    """

    tau: Any
    response: Any
    noise: tuple[Any, ...]
    zero: Any
    commands: tuple[Any, ...] = ()

    def at(self, tick: Any, n: int) -> Outside:
        """The row of one of many ticks, each of n steps."""
        tau = jax.lax.dynamic_slice_in_dim(self.tau, tick * n, n + 1)
        response = None if self.response is None else self.response[tick]
        return Outside(tau, response, tuple(rows[tick] for rows in self.noise), self.zero, self.commands)


def rounded(value: Any, zero: Any) -> Any:
    """The same; but not to be made one with what is computed of it, in a single rounding.

    A measured position may lie on the face of the wall, and is in contact if it is beside it by a last bit.
    """
    bits = jax.lax.bitcast_convert_type(value, zero.dtype)
    return jax.lax.bitcast_convert_type(bits ^ zero, value.dtype)
