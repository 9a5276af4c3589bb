"""Velocity against momentum of a virtual inertia: the loops of Choi et al. 2022, Fig. 4 and 5, drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure.style import FAINT, INK, dress

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TAKEN, GIVEN = "#9FD3B0", "#E8A0A0"
# Steps shorter than this share of all have no arrow.
_ARROW = 0.04


def steps_J(v_m_s: np.ndarray, mass_kg: float) -> np.ndarray:
    """Energy taken in each sample, m v[k] (v[k-1] - v[k-2]), 0 for the first two (Choi et al. 2022, eq. 8)."""
    taken = np.zeros_like(v_m_s)
    taken[2:] = mass_kg * v_m_s[2:] * (v_m_s[1:-1] - v_m_s[:-2])
    return taken


def draw_loop(ax: Axes, v_m_s: np.ndarray, mass_kg: float, title: str) -> None:
    """The staircase v[k-1] -> v[k-1], m v[k]: each step's rectangle is the energy taken (green) or given (red)."""
    v, momentum = 1e3 * v_m_s, 1e6 * mass_kg * v_m_s
    steps = steps_J(v_m_s, mass_kg)
    for k in range(2, len(v)):
        colour = TAKEN if steps[k] >= 0.0 else GIVEN
        ax.fill_between([v[k - 2], v[k - 1]], momentum[k], color=colour, alpha=0.45, linewidth=0)
    path = [(v[0], momentum[1])]
    for k in range(2, len(v)):
        path += [(v[k - 2], momentum[k]), (v[k - 1], momentum[k])]
    x, y = np.array(path).T
    ax.plot(x, y, color=INK, linewidth=1.2)
    for k in range(2, len(v)):
        if abs(v[k - 1] - v[k - 2]) > _ARROW * np.ptp(v):
            middle = (v[k - 1] + v[k - 2]) / 2.0, momentum[k]
            ax.annotate(
                "",
                (middle[0] + 1e-3 * (v[k - 1] - v[k - 2]), middle[1]),
                middle,
                arrowprops={"arrowstyle": "->", "color": INK},
            )
    ax.axhline(0.0, color=FAINT, linewidth=0.8, zorder=0)
    dress(ax, title, "velocity v[k−1] (mm/s)", "momentum m v[k] (g mm/s)")
