"""Drawings of several figures: a colour for each kind of element, momentum over velocity, and a press on a wall."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from haploop.tools.figure.style import ELEMENTS, FAINT, INK, TEXT, WALL, dress, legend
from haploop.tools.studies.choi2022.sampled import steps_J

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {
    "nothing": FAINT,
    "spring": WALL,
    "damping": ELEMENTS[0],
    "bidirectional-inertia": ELEMENTS[1],
    "unidirectional-inertia": ELEMENTS[2],
    "both": ELEMENTS[3],
}
SHORT = {
    "nothing": "nothing",
    "damping": "damping",
    "bidirectional-inertia": "bidirectional",
    "unidirectional-inertia": "unidirectional",
    "both": "damping and unidirectional",
}
# A legend within the axes, on a ground that hides what is behind it.
INSIDE: dict[str, Any] = {"framealpha": 0.8, "edgecolor": "none"}
UPPER_LEFT: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (0.0, 1.0), "ncols": 1}
_TAKEN, _GIVEN = "#9FD3B0", "#E8A0A0"
# Steps shorter than this share of all have no arrow.
_ARROW = 0.04


def legend_of_colours(figure: Figure, colours: Mapping[str, str]) -> None:
    """Draws a legend of labelled colours below a figure."""
    from matplotlib.patches import Patch

    handles = [Patch(facecolor=colour, edgecolor=INK, linewidth=0.4, label=name) for name, colour in colours.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False, fontsize=TEXT)


def draw_momentum(ax: Axes, v_m_s: np.ndarray, mass_kg: float, title: str) -> None:
    """Draws velocity against momentum of a virtual inertia (Choi et al. 2022, Figs. 4 and 5).

    The path is the staircase v[k-1] -> v[k-1], m v[k]; the rectangle of each step is the energy taken (green) or given
    (red).
    """
    v, momentum = 1e3 * v_m_s, 1e6 * mass_kg * v_m_s
    path = [(v[0], momentum[1])]
    for k, taken in enumerate(steps_J(v_m_s, mass_kg)[2:], 2):
        colour = _TAKEN if taken >= 0.0 else _GIVEN
        ax.fill_between([v[k - 2], v[k - 1]], momentum[k], color=colour, alpha=0.45, linewidth=0)
        path += [(v[k - 2], momentum[k]), (v[k - 1], momentum[k])]
    ax.plot(*np.array(path).T, color=INK, linewidth=1.2)
    for k in range(2, len(v)):
        step, middle = v[k - 1] - v[k - 2], (v[k - 1] + v[k - 2]) / 2.0
        if abs(step) > _ARROW * np.ptp(v):
            arrow = {"arrowstyle": "->", "color": INK}
            ax.annotate("", (middle + 1e-3 * step, momentum[k]), (middle, momentum[k]), arrowprops=arrow)
    ax.axhline(0.0, color=FAINT, linewidth=0.8, zorder=0)
    dress(ax, title, "velocity v[k−1] (mm/s)", "momentum m v[k] (g mm/s)")


class Press(NamedTuple):
    """The signals of a run that presses on a wall.

    Attributes:
        t_s: of the ticks.
        origin_N, element_N, output_N: force of the wall's spring, of all elements, and their sum.
        displayed_N_m: output over penetration, NaN outside the wall (Choi et al. 2022, V.B.2).
    """

    t_s: np.ndarray
    origin_N: np.ndarray
    element_N: np.ndarray
    output_N: np.ndarray
    displayed_N_m: np.ndarray

    @classmethod
    def from_log(cls, scene: dict[str, Any], log: Any) -> Press:
        """Takes it from a run's scene and log."""
        ticks = log["/controller"]
        depth = scene["wall"]["position"] - np.asarray(ticks["x"])
        wall, total = np.asarray(ticks["wall"]), np.asarray(ticks["total"])
        inside = np.asarray(ticks["in_contact"]) > 0
        displayed = np.full(len(depth), np.nan)
        displayed[inside] = total[inside] / depth[inside]
        return cls(np.arange(len(depth)) / scene["clock"]["control_rate"], wall, total - wall, total, displayed)

    def columns(self, prefix: str) -> dict[str, np.ndarray]:
        """Returns the data beside the figure; outside the wall the displayed stiffness is 0."""
        named = self._asdict() | {"displayed_N_m": np.nan_to_num(self.displayed_N_m)}
        return {f"{prefix}_{name}": column for name, column in named.items()}


def draw_press(forces: Axes, stiffness: Axes, press: Press, heading: str, wanted_N_m: float) -> None:
    """Draws forces and displayed stiffness as in the paper's Figs. 9 and 12, one above the other."""
    forces.plot(press.t_s, press.output_N, color=INK, linewidth=0.9, label="output")
    forces.plot(press.t_s, press.origin_N, color=WALL, linewidth=0.9, label="wall spring")
    forces.plot(press.t_s, press.element_N, color=ELEMENTS[0], linewidth=0.9, label="elements")
    dress(forces, heading, "", "force (N)")
    stiffness.plot(press.t_s, press.displayed_N_m / 1e3, ".", color=INK, markersize=2.0)
    stiffness.axhline(wanted_N_m / 1e3, color=WALL, linewidth=1.0, label="asked for")
    dress(stiffness, "", "time (s)", "displayed stiffness (N/mm)")
    stiffness.set_ylim(-0.5 * wanted_N_m / 1e3, 2.5 * wanted_N_m / 1e3)
    legend(stiffness)
