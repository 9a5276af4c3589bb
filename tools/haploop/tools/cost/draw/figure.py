"""The work-precision figure: what error each method reaches in what time, one panel a scene."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from haploop.tools.cost.data import Cost, SceneCost
from haploop.tools.cost.draw.panel import UNCERTAIN, draw_panel, label_points, look, methods_of
from haploop.tools.figure.data import FigureError
from haploop.tools.figure.file import empty_figure, fix_layout, write_figure
from haploop.tools.figure.style import GREY, INK, SMALL, TEXT
from haploop.tools.render.units import amount

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL_IN = 5.0, 4.4


def draw(cost: Cost, target: Path) -> Path:
    """Draw what was measured into a file, in the format of its suffix.

    Raises:
        FigureError: matplotlib is missing, nothing was measured, or the file cannot be written.
    """
    return write_figure(figure_of(cost), target)


def figure_of(cost: Cost) -> Figure:
    """One panel a scene, and one that says how to read them.

    Raises:
        FigureError: matplotlib is missing, or no scene has a point with a time.
    """
    scenes = [scene for scene in cost.scenes if any(point.us_per_tick for point in scene.points)]
    if not scenes:
        raise FigureError("No scene has a point with a time, so there is nothing to draw.")
    columns = min(3, len(scenes) + 1)
    rows = -(-(len(scenes) + 1) // columns)
    figure = empty_figure(columns * _PANEL_IN[0], rows * _PANEL_IN[1])
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for ax, scene in zip(panels, scenes, strict=False):
        draw_panel(ax, scene, cost.tolerance_m)
    _how_to_read(panels[len(scenes)], cost, scenes)
    for ax in panels[len(scenes) + 1 :]:
        ax.set_axis_off()
    fix_layout(figure)
    for ax, scene in zip(panels, scenes, strict=False):
        label_points(ax, scene)
    return figure


def _how_to_read(ax: Axes, cost: Cost, scenes: list[SceneCost]) -> None:
    """Methods and signs, and what was measured on what."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    ax.set_axis_off()
    handles: list[Any] = []
    for method in methods_of(scenes):
        colour, marker = look(method)
        handles.append(Line2D([], [], color=colour, marker=marker, linewidth=1.6, label=method))
    sign: dict[str, Any] = {"linestyle": "none", "color": GREY}
    black: dict[str, Any] = sign | {"color": INK}
    handles += [
        Line2D([], [], marker="o", markersize=11, markerfacecolor="none", label="at 10 kHz", **black),
        Line2D([], [], marker="o", markerfacecolor="white", label="wrong verdict", **sign),
        Line2D([], [], marker="x", markersize=7, markeredgewidth=1.8, label="failed: no error to draw", **sign),
        Line2D([], [], color=GREY, dashes=(4, 3), linewidth=0.9, label=f"tolerance {amount(cost.tolerance_m, 'm')}"),
        Patch(facecolor=UNCERTAIN, label="the reference's own uncertainty"),
    ]
    ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, 1.0), frameon=False, fontsize=TEXT, ncols=1)
    words = [
        "Numbers: plant rate in kHz. Lower is more exact, further left is cheaper.",
        f"Times: medians of {cost.repeats} repeats, interleaved in random order; bars: quartiles.",
        cost.machine + (", which was busy meanwhile" if cost.load and cost.load.busy else ""),
    ]
    ax.text(0.02, 0.0, "\n".join(words), fontsize=SMALL, color=GREY, va="bottom", transform=ax.transAxes, gid="words")
