"""Dry friction: the law, and when a body sticks."""

from __future__ import annotations

import math

# Sticking ends beyond the breakaway force by this much, relative: what rounding does to a sum of forces is far less.
_MARGIN = 1e-12


class Friction:
    """F(v) = kinetic + (breakaway - kinetic) exp(-(v / v_s)^2) against the motion; at rest up to ``breakaway``.

    Without a Stribeck velocity F is ``kinetic`` at every speed; without a breakaway force that is ``kinetic``, too
    (Armstrong-Helouvry, Dupont and Canudas de Wit 1994).

    Args:
        table: the resolved ``[friction]`` table.

    Attributes:
        kinetic_N: F at high speed.
        is_constant: whether F is the same at every speed.
        holds_N: the largest force it holds at rest.
    """

    def __init__(self, table: dict[str, float]) -> None:
        self.kinetic_N = table["kinetic"]
        self._breakaway_N = table.get("breakaway", self.kinetic_N)
        self._stribeck_m_s = table.get("stribeck_velocity", 0.0)
        self.is_constant = not self._stribeck_m_s
        self.holds_N = self._breakaway_N * (1.0 + _MARGIN)

    def at(self, v: float) -> float:
        """F in N at velocity v in m/s."""
        if self.is_constant:
            return self.kinetic_N
        return self.kinetic_N + (self._breakaway_N - self.kinetic_N) * math.exp(-((v / self._stribeck_m_s) ** 2))

    def holds(self, force):
        """Whether a body at rest stays there under this force (N; a float or an array)."""
        return abs(force) <= self.holds_N
