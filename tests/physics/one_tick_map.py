"""The linear loop as one matrix: what a whole tick does to state, past sample and commands in flight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm
from scipy.optimize import root_scalar


@dataclass(frozen=True)
class LinearLoop:
    """A wall that is never left, with virtual damping, on a device in a hand; x from the equilibrium.

    The command is u[k] = -K x[k] - B (x[k] - x[k-1]) / T. In interval k the command of tick k - L - 1 still acts for
    the first r of n steps and that of tick k - L for the rest, L n + r = d. With w = (x, v, x[k-1], u[k-1], ...,
    u[k-L-1]) a tick is w -> M w (Franklin, Powell and Workman, fractional delay by the exact flow of either part).
    """

    mass_kg: float
    damping: float
    hand_stiffness: float
    delay_steps: int
    virtual_damping: float = 0.0
    steps_per_tick: int = 10
    step_s: float = 1e-4

    def _flow(self, steps: int) -> np.ndarray:
        rates = np.zeros((3, 3))
        rates[0, 1] = 1.0
        rates[1] = np.array([-self.hand_stiffness, -self.damping, 1.0]) / self.mass_kg
        return expm(rates * steps * self.step_s)[:2]

    def matrix(self, stiffness: float) -> np.ndarray:
        """M for a wall of this stiffness, N/m."""
        whole, late = divmod(self.delay_steps, self.steps_per_tick)
        period_s = self.steps_per_tick * self.step_s
        size = 3 + whole + 1
        command = np.zeros(size)
        command[0] = -stiffness - self.virtual_damping / period_s
        command[2] = self.virtual_damping / period_s
        in_flight = [command, *np.eye(size)[3:]]  # u[k], u[k-1], ..., u[k-L-1]
        first, second = self._flow(late), self._flow(self.steps_per_tick - late)
        state = np.eye(size)[:2]
        state = first[:, :2] @ state + np.outer(first[:, 2], in_flight[whole + 1])
        state = second[:, :2] @ state + np.outer(second[:, 2], in_flight[whole])
        return np.stack([*state, np.eye(size)[0], *in_flight[: whole + 1]])

    def growth(self, stiffness: float) -> float:
        """rho(M), the factor by which the motion grows every tick."""
        return float(np.abs(np.linalg.eigvals(self.matrix(stiffness))).max())

    def critical_stiffness(self) -> float:
        """The smallest stiffness with rho(M) = 1, N/m."""
        stiffness = 1e-3
        while self.growth(stiffness * 1.1) < 1.0:
            stiffness *= 1.1
        found = root_scalar(
            lambda k: self.growth(k) - 1.0, bracket=(stiffness, stiffness * 1.1), xtol=1e-12, rtol=1e-14
        )
        return float(found.root)
