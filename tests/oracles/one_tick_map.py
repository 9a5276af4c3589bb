"""The linear loop as one matrix: the effect of a whole tick on state, past sample and commands in flight."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy
from scipy.linalg import expm


@dataclass(frozen=True, kw_only=True)
class OneTickMap(ABC):
    """A wall that is never left, with virtual damping, on a linear plant z' = A z + b u whose z[0] is sampled.

    z counts from the equilibrium. The command is u[k] = -K x[k] - B (x[k] - x[k-1]) / T. In interval k the command of
    tick k - L - 1 still acts for the first r of n steps and that of tick k - L for the rest, L n + r = d. With
    w = (z, x[k-1], u[k-1], ..., u[k-L-1]) a tick is w -> M w (Franklin, Powell and Workman, fractional delay by the
    exact flow of either part).
    """

    delay_steps: int
    virtual_damping: float = 0.0
    steps_per_tick: int = 10
    step_s: float = 1e-4

    @abstractmethod
    def rates(self) -> tuple[np.ndarray, np.ndarray]:
        """A, shape (m, m), and b, shape (m,)."""

    @cached_property
    def _flows(self) -> tuple[np.ndarray, np.ndarray]:
        """Maps from (z, u) to z over the first r steps of an interval and over the rest, each of shape (m, m + 1)."""
        a, b = self.rates()
        rates = np.vstack([np.column_stack([a, b]), np.zeros(len(b) + 1)])
        late = self.delay_steps % self.steps_per_tick
        first, second = (expm(rates * steps * self.step_s)[:-1] for steps in (late, self.steps_per_tick - late))
        return first, second

    def matrix(self, stiffness: float) -> np.ndarray:
        """M for a wall of this stiffness, N/m."""
        whole = self.delay_steps // self.steps_per_tick
        period_s = self.steps_per_tick * self.step_s
        first, second = self._flows
        order = len(first)
        size = order + 1 + whole + 1
        command = np.zeros(size)
        command[0] = -stiffness - self.virtual_damping / period_s
        command[order] = self.virtual_damping / period_s
        in_flight = [command, *np.eye(size)[order + 1 :]]  # u[k], u[k-1], ..., u[k-L-1]
        state = np.eye(size)[:order]
        state = first[:, :order] @ state + np.outer(first[:, order], in_flight[whole + 1])
        state = second[:, :order] @ state + np.outer(second[:, order], in_flight[whole])
        return np.stack([*state, np.eye(size)[0], *in_flight[: whole + 1]])

    def magnitudes(self, stiffness: float) -> np.ndarray:
        """Magnitudes of the eigenvalues of M, the largest first: the factors by which the modes change in a tick."""
        return np.sort(np.abs(np.linalg.eigvals(self.matrix(stiffness))))[::-1]

    def growth(self, stiffness: float) -> float:
        """rho(M), the factor by which the motion grows every tick."""
        return float(self.magnitudes(stiffness)[0])

    def critical_stiffness(self) -> float:
        """The smallest stiffness with rho(M) = 1, N/m."""
        stiffness = 1e-3
        while self.growth(stiffness * 1.1) < 1.0:
            stiffness *= 1.1
        found = scipy.optimize.root_scalar(
            lambda k: self.growth(k) - 1.0, bracket=(stiffness, stiffness * 1.1), xtol=1e-12, rtol=1e-14
        )
        return float(found.root)


@dataclass(frozen=True)
class LinearLoop(OneTickMap):
    """The one-tick map of a device in a hand: one mass."""

    mass_kg: float
    damping: float
    hand_stiffness: float

    def rates(self) -> tuple[np.ndarray, np.ndarray]:
        m = self.mass_kg
        return np.array([[0.0, 1.0], [-self.hand_stiffness / m, -self.damping / m]]), np.array([0.0, 1.0 / m])


def growth_of(ran: Any, from_tick: int = 300, over_ticks: int = 400) -> float:
    """Growth per tick of a run whose x = Re(c z^k): x[k]^2 - x[k+1] x[k-1] = |c|^2 sin^2(arg z) |z|^{2k}."""
    assert ran.controller["in_contact"].all()
    x = ran.controller["x"]
    measure = [x[k] ** 2 - x[k + 1] * x[k - 1] for k in (from_tick, from_tick + over_ticks)]
    return (measure[1] / measure[0]) ** (0.5 / over_ticks)
