"""One press drawn as in the paper's Figs. 9 and 12: forces above, the displayed stiffness below."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from haploop.tools.figure.style import ELEMENTS, INK, WALL, dress, legend

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Press(NamedTuple):
    """What is drawn of a run.

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
    def of(cls, scene: dict[str, Any], log: Any) -> Press:
        """From a run's scene and log."""
        ticks = log["/controller"]
        depth = scene["wall"]["position"] - np.asarray(ticks["x"])
        wall, total = np.asarray(ticks["wall"]), np.asarray(ticks["total"])
        inside = np.asarray(ticks["in_contact"]) > 0
        displayed = np.full(len(depth), np.nan)
        displayed[inside] = total[inside] / depth[inside]
        return cls(np.arange(len(depth)) / scene["clock"]["control_rate"], wall, total - wall, total, displayed)

    def columns(self, prefix: str) -> dict[str, np.ndarray]:
        """For the data beside the figure; outside the wall the displayed stiffness is 0."""
        named = self._asdict() | {"displayed_N_m": np.nan_to_num(self.displayed_N_m)}
        return {f"{prefix}_{name}": column for name, column in named.items()}


def draw_press(forces: Axes, stiffness: Axes, press: Press, heading: str, wanted_N_m: float) -> None:
    """Into two axes, one above the other."""
    forces.plot(press.t_s, press.output_N, color=INK, linewidth=0.9, label="output")
    forces.plot(press.t_s, press.origin_N, color=WALL, linewidth=0.9, label="wall spring")
    forces.plot(press.t_s, press.element_N, color=ELEMENTS[0], linewidth=0.9, label="elements")
    dress(forces, heading, "", "force (N)")
    stiffness.plot(press.t_s, press.displayed_N_m / 1e3, ".", color=INK, markersize=2.0)
    stiffness.axhline(wanted_N_m / 1e3, color=WALL, linewidth=1.0, label="asked for")
    dress(stiffness, "", "time (s)", "displayed stiffness (N/mm)")
    stiffness.set_ylim(-0.5 * wanted_N_m / 1e3, 2.5 * wanted_N_m / 1e3)
    legend(stiffness)
