"""The linear loop as one matrix: what a whole tick does to the plant, the past sample and the commands in flight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from haploop.plant.chain import Chain
from haploop.plant.chain_flow import ChainFlow
from haploop.protocol.ticks import Timebase

# The search for the limit begins here and goes up by this factor.
_LEAST_N_M, _FACTOR = 1e-3, 1.1


class NotLinear(ValueError):
    """A scene whose loop in contact is no linear map; the message names what makes it none."""


class NeverStable(ValueError):
    """A loop that grows however soft its wall is."""


@dataclass(frozen=True)
class OneTickMap:
    """w -> M w for a wall that is never left, around the equilibrium; stable if and only if rho(M) < 1.

    With w = (z, x[k-1], u[k-1], ..., u[k-L-1]), z the states of the chain of bodies and x = z[0] what is sampled:
        u[k] = -K x[k] - B (x[k] - x[k-1]) / T
        z[k+1] = Phi(n - r) (Phi(r) z[k] + Gamma(r) u[k-L-1]) + Gamma(n - r) u[k-L],    d = L n + r
    Phi(i), Gamma(i) are the plant's own exact flow over i of its n steps in a tick (Franklin, Powell and Workman,
    fractional delay). Any disturbance of the linear loop grows or decays by rho(M) a tick in the end.

    Attributes:
        first, second: what u adds, and z adds to itself, over the first r and the other n - r steps of a tick;
            (z, u) -> z, each of shape (states, states + 1).
        lookahead_ticks: L.
        virtual_damping: B, the sum of the scene's damping elements, N s/m.
        period_s: T.
    """

    first: np.ndarray
    second: np.ndarray
    lookahead_ticks: int
    virtual_damping: float
    period_s: float

    @classmethod
    def of(cls, scene: dict[str, Any]) -> OneTickMap:
        """The map of a resolved scene in contact. Noise, rounding and the limits of the force are left out.

        Raises:
            NotLinear: the scene has friction, jitter, loss, an estimator, or an element other than damping.
        """
        _demand_linear(scene)
        time, chain = Timebase.of(scene["clock"], scene["duration"]), Chain.of(scene)
        flow = ChainFlow(chain, time.step_s, time.steps_per_tick, stuck=False)
        late = time.delay_steps % time.steps_per_tick
        return cls(
            first=_over(flow, late),
            second=_over(flow, time.steps_per_tick - late),
            lookahead_ticks=time.lookahead_ticks,
            virtual_damping=sum(table["damping"] for table in scene.get("dissipation", [])),
            period_s=time.period_s,
        )

    def matrix(self, stiffness: float) -> np.ndarray:
        """M for a wall of this stiffness in N/m, shape (states + L + 2, states + L + 2)."""
        states = len(self.first)
        unit = np.eye(states + 1 + self.lookahead_ticks + 1)
        rate = self.virtual_damping / self.period_s
        commands = [rate * unit[states] - (stiffness + rate) * unit[0], *unit[states + 1 :]]  # u[k], u[k-1] ...
        z = self.first @ np.vstack([unit[:states], commands[self.lookahead_ticks + 1]])
        z = self.second @ np.vstack([z, commands[self.lookahead_ticks]])
        return np.vstack([z, unit[0], *commands[: self.lookahead_ticks + 1]])

    def growth(self, stiffness: float) -> float:
        """rho(M): the factor by which the motion grows every tick, in the end."""
        return float(np.abs(np.linalg.eigvals(self.matrix(stiffness))).max())

    def stiffness_limit(self) -> float:
        """The smallest stiffness with rho(M) = 1 in N/m, bisected to the last bits. A sampled wall always has one.

        Raises:
            NeverStable: the loop grows even with the softest wall.
        """
        stable, unstable = 0.0, _LEAST_N_M
        while self.growth(unstable) < 1.0:
            stable, unstable = unstable, unstable * _FACTOR
        if not stable:
            raise NeverStable(f"The loop is unstable even with a wall of {_LEAST_N_M:g} N/m; it needs damping.")
        while stable < (middle := (stable + unstable) / 2.0) < unstable:
            if self.growth(middle) < 1.0:
                stable = middle
            else:
                unstable = middle
        return stable


def _over(flow: ChainFlow, steps: int) -> np.ndarray:
    """(z, command) -> z over some plant steps, shape (states, states + 1)."""
    states = flow.held.shape[2]
    identity = np.eye(states, states + 1)
    return identity + flow.held[: states + 1, steps - 1].T if steps else identity


def _demand_linear(scene: dict[str, Any]) -> None:
    elements = [table["kind"] for table in scene.get("dissipation", [])]
    curved = [f"[{table}]" for table in ("friction", "jitter", "loss", "velocity") if scene.get(table)]
    curved += [f"the element {kind}" for kind in elements if kind != "damping"]
    if curved:
        raise NotLinear(
            "The stiffness limit is that of a linear loop: held forces on masses, springs and dampers. "
            f"{scene['title']!r} also has {', '.join(curved)}; take it out to ask for the limit."
        )
