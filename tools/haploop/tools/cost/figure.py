"""The work-precision figure: error of every method against its time, one panel a scene."""

from __future__ import annotations

import math
from functools import partial
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.protocol.amounts import amount
from haploop.tools.cost.data import Cost, Errors, Point, SceneCost
from haploop.tools.cost.findings import COMPILED, is_told_apart, takes_away
from haploop.tools.figure import style
from haploop.tools.figure.data import FigureError
from haploop.tools.figure.labels import Label, place_labels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL_IN = 5.0, 4.4
_MARKED_HZ = 10_000
UNCERTAIN = "#E4E4E4"
_TITLE_LETTERS, _LETTERS_PER_IN = 58, 10.5
# Colours that the colour-blind can tell apart, each with a marker, for those who see none; other methods share one.
LOOKS: dict[str, tuple[str, str]] = {
    "exact": (style.WALL, "o"),
    "semi-implicit-euler": (style.ELEMENTS[0], "s"),
    "euler": (style.ELEMENTS[2], "v"),
    "rk4": (style.ELEMENTS[1], "D"),
    "implicit-midpoint": (style.ELEMENTS[3], "^"),
    "dop853": (style.ELEMENTS[5], "P"),
    COMPILED: (style.OF_THE_PLANT["friction"], "*"),
}
_OTHER = style.GREY, "X"
# Errors below a reference's uncertainty cannot be seen: those below this share of it are drawn at this share.
_WITHIN = 0.3
# The share of a panel's height that failures take at its top edge.
_TOP = 0.08


def figure_of(cost: Cost) -> Figure:
    """Makes the figure: one panel a scene, and one that says how to read them.

    Raises FigureError where matplotlib is missing, or no scene has a point with a time.
    """
    scenes = [scene for scene in cost.scenes if any(point.time for point in scene.points)]
    if not scenes:
        raise FigureError("No scene has a point with a time, so there is nothing to draw.")
    columns = min(3, len(scenes) + 1)
    rows = -(-(len(scenes) + 1) // columns)
    figure = style.empty_figure(columns * _PANEL_IN[0], rows * _PANEL_IN[1])
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for ax, scene in zip(panels, scenes, strict=False):
        draw_panel(ax, scene, cost.tolerance_m)
    _how_to_read(panels[len(scenes)], cost, scenes)
    for ax in panels[len(scenes) + 1 :]:
        ax.set_axis_off()
    headline = "\n".join(wrap(takes_away(cost), int(_LETTERS_PER_IN * columns * _PANEL_IN[0])))
    figure.suptitle(headline, x=0.01, ha="left", fontsize=style.TEXT + 2, color=style.INK, gid="takes away")
    style.fix_layout(figure)
    for ax, scene in zip(panels, scenes, strict=False):
        label_points(ax, scene)
    return figure


def _how_to_read(ax: Axes, cost: Cost, scenes: list[SceneCost]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    ax.set_axis_off()
    sign, tolerance = partial(Line2D, [], []), f"tolerance {amount(cost.tolerance_m, 'm')}"
    handles: list[Any] = []
    for method in methods_of(scenes):
        colour, marker = LOOKS.get(method, _OTHER)
        handles.append(sign(color=colour, marker=marker, linewidth=1.6, label=method))
    point, grey = partial(sign, linestyle="none"), style.GREY
    handles += [
        point(marker="o", markersize=11, markerfacecolor="none", color=style.INK, label="at 10 kHz"),
        point(marker="o", markerfacecolor="white", color=grey, label="at most: not told apart from no error"),
        point(marker="x", markersize=7, markeredgewidth=1.8, color=grey, label="failed: no error to draw"),
        sign(color=grey, dashes=(4, 3), linewidth=0.9, label=tolerance),
        Patch(facecolor=UNCERTAIN, label="the reference's own uncertainty"),
    ]
    ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, 1.0), frameon=False, fontsize=style.TEXT, ncols=1)
    words = [
        "Numbers: plant rate in kHz. Lower is more exact, further left is cheaper.",
        f"Times: medians of {cost.repeats} repeats in random order; bars: 95 % intervals.",
        *wrap(f"Yardstick: {cost.yardstick}", 76),
        cost.machine,
    ]
    look = {"fontsize": style.SMALL, "color": style.GREY, "transform": ax.transAxes}
    ax.text(0.02, 0.0, "\n".join(words), va="bottom", gid="words", **look)


def draw_panel(ax: Axes, scene: SceneCost, tolerance_m: float) -> None:
    """Draws every point of a scene that has a time; labels come once the panel has its place."""
    reference = scene.reference
    what = "RMS error of the position (m)" if reference.pointwise else "error of the mean amplitude (m)"
    style.dress(ax, "\n".join(wrap(scene.short_title, _TITLE_LETTERS)), "time of a tick, over the yardstick's", what)
    ax.loglog()
    style.plain_numbers(ax.xaxis)
    low, edge, high = _limits(scene, tolerance_m)
    ax.set_ylim(low, high)
    ax.axhspan(low, max(reference.error_m, low), color=UNCERTAIN, zorder=0, linewidth=0, gid="uncertainty")
    ax.axhline(tolerance_m, color=style.GREY, linewidth=0.9, dashes=(4, 3), zorder=1, gid="tolerance")
    for method in methods_of([scene]):
        _curve(ax, [point for point in drawn(scene) if point.method == method], scene)
    if any(point.time and not point.error for point in scene.points):
        ax.axhline(edge, color=style.FAINT, linewidth=0.8, zorder=1)
        ax.set_yticks([tick for tick in ax.get_yticks() if low <= tick < edge])
        place = {"ha": "right", "va": "center", "transform": ax.transAxes}
        ax.text(0.995, 1.0 - _TOP / 2.0, "failed", fontsize=style.SMALL, color=style.GREY, **place)
    times = [end for p in drawn(scene) if (t := p.time) for end in (t.low, t.median, t.high)]
    ax.set_xlim(min(times) / 1.25, max(times) * 1.25)


def _limits(scene: SceneCost, tolerance_m: float) -> tuple[float, float, float]:
    sizes = [drawn_m(point, scene) for point in scene.points]
    sizes = [size for size in [*sizes, scene.reference.error_m, tolerance_m] if 0.0 < size < math.inf]
    low, high = math.floor(math.log10(min(sizes)) - 0.3), math.ceil(math.log10(max(sizes)) + 0.2)
    return 10.0**low, 10.0**high, 10.0 ** (low + (high - low) / (1.0 - _TOP))


def drawn_m(point: Point, scene: SceneCost) -> float:
    """Returns a point's error as drawn: the upper end if in doubt; at least a share of the reference's uncertainty."""
    size_m = math.inf if point.error is None else point.at_most_m if _in_doubt(point.error) else point.error.size_m
    return max(size_m, _WITHIN * scene.reference.error_m, 1e-18)


def _in_doubt(error: Errors) -> bool:
    return bool(error.doubt_m) and not is_told_apart(error)


def _position(ax: Axes, point: Point, scene: SceneCost) -> tuple[float, float]:
    """Returns where a point is drawn: its time and its error; without one, at the top edge."""
    assert point.time is not None
    low, high = np.log10(ax.get_ylim())
    top = float(10.0 ** (high - _TOP / 2.0 * (high - low)))
    return point.time.median, drawn_m(point, scene) if point.error else top


def _curve(ax: Axes, points: list[Point], scene: SceneCost) -> None:
    points = sorted((point for point in points if point.time), key=lambda point: point.plant_rate)
    if not points:
        return
    method = points[0].method
    colour, marker = LOOKS.get(method, _OTHER)
    xy = np.array([_position(ax, point, scene) for point in points])
    failed = [point.error is None for point in points]
    wide = 2.2 if method == "exact" else 1.2
    ax.plot(xy[:, 0], np.where(failed, np.nan, xy[:, 1]), color=colour, linewidth=wide, zorder=3, gid=f"line {method}")
    for point, (x, y) in zip(points, xy, strict=True):
        mark = partial(ax.plot, [x], [y], color=colour, zorder=4, linestyle="none")
        bar = partial(ax.plot, color=colour, linewidth=0.9, alpha=0.7, zorder=2)
        if point.error is None:
            mark(marker="x", markersize=7.0, markeredgewidth=1.8, clip_on=False, gid="failure")
        elif _in_doubt(point.error):
            mark(marker=marker, markersize=5.5, markerfacecolor="white", gid="at most")
        else:
            mark(marker=marker, markersize=5.5, gid="point")
            if doubt_m := point.error.doubt_m:
                bar([x, x], [y - doubt_m, y + doubt_m], gid="interval of error")
        if time := point.time:
            bar([time.low, time.high], [y, y], gid="interval of time")
        if point.plant_rate == _MARKED_HZ:
            mark(marker="o", markersize=11, markerfacecolor="none", markeredgecolor=style.INK, gid="10 kHz")


def label_points(ax: Axes, scene: SceneCost) -> None:
    """Writes the plant rate in kHz beside the points: for the scene's own method first, then where there is room."""
    timed = [point for point in drawn(scene) if point.time]
    labels = []
    for point in sorted(timed, key=lambda point: (point.method != scene.own_method, not point.error)):
        in_kHz, colour = f"{point.plant_rate / 1000:g}", LOOKS.get(point.method, _OTHER)[0]
        half_px = 9.0 if point.plant_rate == _MARKED_HZ else 5.0
        labels.append(Label(*_position(ax, point, scene), in_kHz, colour, in_kHz, half_px))
    lines = [line.get_xydata() for line in ax.lines if (line.get_gid() or "").startswith("line ")]
    whole = [line[np.isfinite(line).all(axis=1)] for line in map(np.asarray, lines)]
    place_labels(ax, labels, whole)


def drawn(scene: SceneCost) -> list[Point]:
    """Returns the points of a scene, and those of machine code."""
    return [*scene.points, *scene.compiled]


def methods_of(scenes: list[SceneCost]) -> list[str]:
    """Returns all methods, in the order of their looks, others after."""
    found = dict.fromkeys(point.method for scene in scenes for point in drawn(scene))
    return [method for method in LOOKS if method in found] + [method for method in found if method not in LOOKS]
