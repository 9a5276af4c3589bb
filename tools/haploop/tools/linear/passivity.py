"""The largest stiffness at which a sampled wall with its elements is passive (Colgate and Schenkel 1997)."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from haploop.plant.chain.chain import Chain
from haploop.tools.linear.controller import LinearController
from haploop.tools.linear.linearity import Kinds, installed_kinds

# Angles theta = w T in rad at which the condition is looked at first; below the least nothing changes any more.
_LEAST, _ANGLES = 1e-4, 1000


def largest_passive_stiffness(scene: dict[str, Any], delay_ticks: int, kinds: Kinds | None = None) -> float:
    """K in N/m; 0 where the elements alone are not passive.

    With z = e^(j theta), H the elements' force over -x, L whole ticks of delay and b the damping of the sampled body
    to ground, whatever passive hangs on it, the loop is passive if and only if at all 0 < theta <= pi
        b > (T/2) / (1 - cos theta) Re{(1 - z^-1) (K + H(z)) z^-L} = Re{g (K + H(z))},
        g = (T/2) j e^(-j theta (L + 1/2)) / sin(theta / 2)

    Args:
        scene: resolved, linear but for friction; its controller reads positions alone.
    """
    controller = LinearController.from_scene(scene, installed_kinds() if kinds is None else kinds)
    damping = next(b for name, (body, b) in Chain.from_scene(scene).grounded.items() if body == 0 and name != "hand")
    period_s = 1.0 / scene["clock"]["control_rate"]

    def allowed(theta: np.ndarray) -> np.ndarray:
        g = 0.5j * period_s * np.exp(-1j * theta * (delay_ticks + 0.5)) / np.sin(theta / 2.0)
        left = damping - (g * _elements(controller, np.exp(1j * theta))).real
        spring = np.where(g.real > 0.0, g.real, 1.0)
        return np.where(left < 0.0, 0.0, np.where(g.real > 0.0, left / spring, np.inf))

    grid = np.union1d(np.geomspace(_LEAST, np.pi, _ANGLES), np.linspace(_LEAST, np.pi, _ANGLES))
    found = allowed(grid)
    least = int(np.argmin(found))
    around = grid[max(least - 1, 0)], grid[min(least + 1, len(grid) - 1)]
    refined = minimize_scalar(lambda theta: float(allowed(np.array([theta]))[0]), bounds=around, method="bounded")
    return float(min(found[least], refined.fun))


def _elements(controller: LinearController, z: np.ndarray) -> np.ndarray:
    """H(z): the elements' force over -x, at every z."""
    moved, force = controller
    memory = len(moved)
    of_memory = z[:, None, None] * np.eye(memory) - moved[:, :memory]
    states = np.linalg.solve(of_memory, np.broadcast_to(moved[:, memory:], (len(z), memory, 1)))[..., 0]
    return -(states @ force[:memory] + force[memory])
