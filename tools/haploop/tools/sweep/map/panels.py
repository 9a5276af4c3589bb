"""The panels of a map: a cell for every pair of values, or the swing along one axis."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure.style import FAINT, GREY, INK, SMALL, TEXT
from haploop.tools.sweep.map.axis import Axis
from haploop.tools.sweep.map.data import NOT_RUN, VERDICTS, Cells, Verdict
from haploop.tools.sweep.map.looks import LOOKS, PROVISO, Look, amplitude_colours, metres_along

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import LogNorm

# Cells smaller than the first have no room for a count, those smaller than the second not even for a dot.
_COUNT_PX, _DOT_PX = (26.0, 15.0), 4.0


def draw_cells(ax: Axes, x: Axis, y: Axis, cells: Cells, scale: LogNorm | None) -> None:
    """Fills the panel; ``cells`` have the shape (values of x, values of y)."""
    from matplotlib.colors import BoundaryNorm, ListedColormap

    verdict = cells.verdict.T
    edges = x.edges, y.edges
    fills = ListedColormap([LOOKS[number].fill for number in range(len(VERDICTS))])
    norm = BoundaryNorm(np.arange(len(VERDICTS) + 1) - 0.5, len(VERDICTS))
    ran = np.ma.masked_equal(verdict, NOT_RUN)
    ax.pcolormesh(*edges, ran, cmap=fills, norm=norm, zorder=1, rasterized=True, gid="verdicts")
    swinging = (verdict == Verdict.LIMIT_CYCLE) & np.isfinite(cells.amplitude_m.T) & (cells.amplitude_m.T > 0.0)
    if scale and swinging.any():
        shown = np.ma.array(cells.amplitude_m.T, mask=~swinging)
        colours = amplitude_colours()
        ax.pcolormesh(*edges, shown, cmap=colours, norm=scale, zorder=1.1, rasterized=True, gid="amplitudes")
    for number, look in LOOKS.items():
        if look.hatch and (verdict == number).any():
            _hatch(ax, edges, verdict == number, look, f"hatch {VERDICTS[number]}")
    if cells.rests_on.any():
        _hatch(ax, edges, cells.rests_on.T, PROVISO, "hatch with a proviso")
    _outline(ax, edges, verdict)


def _hatch(ax: Axes, edges: tuple[np.ndarray, np.ndarray], where: np.ndarray, look: Look, gid: str) -> None:
    """Draws one hatched patch of all cells of a verdict, by unbroken runs in a row, so that hatching is continuous."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    boxes = []
    for (x0, y0), (x1, y1) in _runs(edges, where):
        boxes.append(Path([(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)], closed=True))
    path = Path.make_compound_path(*boxes)
    style = {"facecolor": "none", "edgecolor": look.hatch_colour, "hatch": look.hatch, "linewidth": 0}
    ax.add_patch(PathPatch(path, zorder=1.2, gid=gid, **style))


def _runs(edges: tuple[np.ndarray, np.ndarray], where: np.ndarray) -> Iterator[np.ndarray]:
    """Yields opposite corners of the unbroken runs of marked cells in every row, shape (2, 2)."""
    for row, marked in enumerate(where):
        ends = edges[0][np.flatnonzero(np.diff(np.concatenate([[0], marked.astype(int), [0]])))]
        for x0, x1 in zip(ends[::2], ends[1::2], strict=True):
            yield np.array([(x0, edges[1][row]), (x1, edges[1][row + 1])])


def unsteady_areas(x: Axis, y: Axis, cells: Cells) -> list[np.ndarray]:
    """Returns opposite corners of the areas of cells that ran and are not steady, shape (2, 2) each."""
    verdict = cells.verdict.T
    return list(_runs((x.edges, y.edges), (verdict != Verdict.STEADY) & (verdict != NOT_RUN)))


def _outline(ax: Axes, edges: tuple[np.ndarray, np.ndarray], verdict: np.ndarray) -> None:
    from matplotlib.collections import LineCollection

    steady, ran = verdict == Verdict.STEADY, verdict != NOT_RUN
    xs, ys = edges
    upright = np.argwhere((steady[:, 1:] != steady[:, :-1]) & ran[:, 1:] & ran[:, :-1])
    level = np.argwhere((steady[1:] != steady[:-1]) & ran[1:] & ran[:-1])
    lines = [[(xs[column + 1], ys[row]), (xs[column + 1], ys[row + 1])] for row, column in upright]
    lines += [[(xs[column], ys[row + 1]), (xs[column + 1], ys[row + 1])] for row, column in level]
    look = {"colors": INK, "linewidths": 1.1, "zorder": 2, "capstyle": "projecting"}
    ax.add_collection(LineCollection(lines, **look, gid="edge of steady"))


def mark_disagreement(ax: Axes, x: Axis, y: Axis, cells: Cells) -> None:
    """Marks cells in which not all seeds came to the verdict shown: by their count, or by a dot in a small cell.

    Call when the place and limits of the panel are fixed.
    """
    from matplotlib.patheffects import withStroke

    frame = ax.get_window_extent()
    width, height = frame.width / len(x.values), frame.height / len(y.values)
    split = np.argwhere((cells.agree < cells.seeds) & (cells.verdict != NOT_RUN))
    if not len(split) or min(width, height) < _DOT_PX:
        return
    xs, ys = x.coordinates, y.coordinates
    if width < _COUNT_PX[0] or height < _COUNT_PX[1]:
        size = min(3.5, 0.3 * min(width, height))
        ax.plot(
            xs[split[:, 0]], ys[split[:, 1]], "o", color=INK, markeredgecolor="white", markeredgewidth=0.5,
            markersize=size, zorder=3, linestyle="none", gid="seeds disagree",
        )  # fmt: skip
        return
    halo = [withStroke(linewidth=1.8, foreground="white")]
    for i, j in split.tolist():
        ax.text(
            xs[i], ys[j], f"{cells.agree[i, j]}/{cells.seeds[i, j]}", ha="center", va="center", fontsize=6.5, color=INK,
            zorder=5.5, path_effects=halo, gid="seeds disagree",
        )  # fmt: skip


# Room below the least and above the greatest amplitude, as factors, for cells without one.
_BELOW, _ABOVE = 3.0, 6.0


class SwingScale:
    """One logarithmic scale of swings for all panels, with a shelf above for cells that have no number.

    Attributes:
        least: the least swing that has a number along the scale.
        floor: place, below ``least``, of cells that swing less or not at all; None where there are none.
    """

    def __init__(self, cells: Cells) -> None:
        known = np.concatenate([cells.amplitude_m.ravel(), cells.least_m.ravel()])
        known = known[np.isfinite(known)]
        swinging = known[known > 0.0]
        self.any = bool(len(swinging))
        least, most = (float(swinging.min()), float(swinging.max())) if self.any else (1e-6, 1e-3)
        # Below a picometre there is nothing to see.
        self.least = max(least, 1e-12, 1e-8 * most)
        self.floor = self.least / _BELOW if (known < self.least).any() else None
        self.low, self.high = (self.floor or self.least) / _BELOW, max(most, self.least) * _ABOVE
        self.shelf = self.high / np.sqrt(_ABOVE)

    def place(self, amplitudes_m: np.ndarray) -> np.ndarray:
        """Returns coordinates of amplitudes: below ``least`` on the floor, unknown and infinite ones on the shelf."""
        at = np.where(amplitudes_m < self.least, self.floor or self.least, amplitudes_m)
        return np.where(np.isfinite(at), at, self.shelf)


def draw_swings(ax: Axes, x: Axis, cells: Cells, scale: SwingScale, label: bool) -> None:
    """Draws a panel; ``cells`` have the shape (values of x,). The first panel of a row has the label along y."""
    ran = cells.verdict != NOT_RUN
    at, places, edges = x.coordinates, scale.place(cells.amplitude_m), x.edges
    for i in np.flatnonzero(cells.verdict == Verdict.STEADY):
        style = {"facecolor": LOOKS[Verdict.STEADY].fill, "edgecolor": PROVISO.hatch_colour, "linewidth": 0}
        hatch = PROVISO.hatch if cells.rests_on[i] else ""
        ax.axvspan(edges[i], edges[i + 1], **style, hatch=hatch, zorder=0.2, gid="steady")
    known = ran & np.isfinite(cells.amplitude_m)
    ax.plot(at, np.where(known, places, np.nan), color=FAINT, linewidth=1.2, zorder=2, gid="line")
    for i in np.flatnonzero(known & (cells.seeds > 1)):
        span = scale.place(np.array([cells.least_m[i], cells.amplitude_m[i]]))
        ax.plot([at[i]] * 2, span, color=INK, linewidth=0.9, alpha=0.6, zorder=2.5, gid="seeds")
    for number, look in LOOKS.items():
        here = cells.verdict == number
        edge = ("white", 0.5) if look.marker != "x" else (look.colour, 1.5)
        if here.any():
            ax.plot(
                at[here], places[here], look.marker, color=look.colour, markersize=5.5, zorder=3, linestyle="none",
                markeredgecolor=edge[0], markeredgewidth=edge[1], gid=f"cells {VERDICTS[number]}",
            )  # fmt: skip
    ax.set_yscale("log")
    ax.set_ylim(scale.low, scale.high)
    metres_along(ax.yaxis, scale.high / scale.low, np.sqrt(scale.least * (scale.floor or scale.least)))
    ax.tick_params(axis="y", labelsize=SMALL, colors=GREY, labelcolor=INK)
    ax.tick_params(axis="y", which="both", labelleft=label)
    if label:
        ax.set_ylabel("swing, peak to peak", fontsize=TEXT, color=INK)
        if scale.floor:
            style = {"ha": "right", "va": "center", "fontsize": SMALL, "color": INK, "gid": "none"}
            ax.text(-0.012, scale.floor, "none", transform=ax.get_yaxis_transform(), **style)
    ax.grid(axis="y", color="#E6E6E6", linewidth=0.6, zorder=0.5)


def count_disagreement(ax: Axes, x: Axis, cells: Cells, scale: SwingScale) -> None:
    """Writes how many seeds came to the verdict shown, above the marker, where not all did."""
    split = np.flatnonzero((cells.agree < cells.seeds) & (cells.verdict != NOT_RUN))
    at, places = x.coordinates, scale.place(cells.amplitude_m)
    for i in split if len(split) <= 25 else ():
        ax.annotate(
            f"{cells.agree[i]}/{cells.seeds[i]}", (at[i], places[i]), (0, 6), textcoords="offset points", ha="center",
            fontsize=SMALL - 1, color=INK, gid="seeds disagree",
        )  # fmt: skip
