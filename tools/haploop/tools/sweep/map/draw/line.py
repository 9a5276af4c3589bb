"""One axis: how far everything swings along it, and the verdict of every cell."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure.style import FAINT, GREY, INK, SMALL, TEXT
from haploop.tools.sweep.map.axis import Ruler
from haploop.tools.sweep.map.data import NOT_RUN, STEADY, VERDICTS, Cells
from haploop.tools.sweep.map.draw.look import LOOKS, metres_along

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Room below the least and above the greatest amplitude, for cells that have none.
_BELOW, _ABOVE = 3.0, 6.0


class SwingScale:
    """One logarithmic scale of oscillations for all panels, with a shelf above for cells that have no number."""

    def __init__(self, cells: Cells) -> None:
        known = np.concatenate([cells.amplitude_m.ravel(), cells.least_m.ravel()])
        known = known[np.isfinite(known) & (known > 0.0)]
        self.any = bool(len(known))
        least, most = (float(known.min()), float(known.max())) if self.any else (1e-6, 1e-3)
        # Below a picometre there is nothing to see.
        least = max(least, 1e-12, 1e-8 * most)
        self.floor = least
        self.low, self.high = least / _BELOW, max(most, least) * _ABOVE
        self.shelf = self.high / np.sqrt(_ABOVE)

    def place(self, amplitudes_m: np.ndarray) -> np.ndarray:
        """Where amplitudes stand: none at all on the floor, unknown and boundless ones on the shelf."""
        at = np.maximum(amplitudes_m, self.floor)
        return np.where(np.isfinite(at), at, self.shelf)


def draw_swings(ax: Axes, x: Ruler, cells: Cells, scale: SwingScale) -> None:
    """Draw a panel; ``cells`` have the shape (values of x,)."""
    ran = cells.verdict != NOT_RUN
    at, places = x.coordinates, scale.place(cells.amplitude_m)
    _shade(ax, x, cells.verdict)
    known = ran & np.isfinite(cells.amplitude_m)
    ax.plot(at, np.where(known, places, np.nan), color=FAINT, linewidth=1.2, zorder=2, gid="line")
    for i in np.flatnonzero(known & (cells.seeds > 1)):
        span = scale.place(np.array([cells.least_m[i], cells.amplitude_m[i]]))
        ax.plot([at[i]] * 2, span, color=INK, linewidth=0.9, alpha=0.6, zorder=2.5, gid="seeds")
    for number, look in LOOKS.items():
        here = cells.verdict == number
        if here.any():
            ax.plot(
                at[here], places[here], look.marker, color=look.colour, markersize=5.5, zorder=3, linestyle="none",
                markeredgecolor="white" if look.marker != "x" else look.colour,
                markeredgewidth=0.5 if look.marker != "x" else 1.5, gid=f"cells {VERDICTS[number]}",
            )  # fmt: skip
    ax.set_yscale("log")
    ax.set_ylim(scale.low, scale.high)
    metres_along(ax.yaxis, scale.high / scale.low)
    ax.tick_params(axis="y", labelsize=SMALL, colors=GREY, labelcolor=INK)
    ax.grid(axis="y", color="#E6E6E6", linewidth=0.6, zorder=0.5)


def label_swings(ax: Axes, label: bool) -> None:
    """What stands along y, in the first panel of a row."""
    ax.tick_params(axis="y", which="both", labelleft=label)
    if label:
        ax.set_ylabel("oscillation, peak to peak", fontsize=TEXT, color=INK)


def _shade(ax: Axes, x: Ruler, verdict: np.ndarray) -> None:
    """The steady cells have a ground of their own."""
    edges = x.edges
    for index in np.flatnonzero(verdict == STEADY):
        ax.axvspan(edges[index], edges[index + 1], color=LOOKS[STEADY].fill, linewidth=0, zorder=0.2, gid="steady")


def count_disagreement(ax: Axes, x: Ruler, cells: Cells, scale: SwingScale) -> None:
    """How many seeds came to the verdict shown, above the marker, where not all did."""
    split = np.flatnonzero((cells.agree < cells.seeds) & (cells.verdict != NOT_RUN))
    at, places = x.coordinates, scale.place(cells.amplitude_m)
    for i in split if len(split) <= 25 else ():
        ax.annotate(
            f"{cells.agree[i]}/{cells.seeds[i]}", (at[i], places[i]), (0, 6), textcoords="offset points", ha="center",
            fontsize=SMALL - 1, color=INK, gid="seeds disagree",
        )  # fmt: skip
