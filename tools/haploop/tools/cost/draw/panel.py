"""One panel of the work-precision figure: the error of every method against its time, for one scene."""

from __future__ import annotations

import math
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.tools.cost.data import Point, SceneCost
from haploop.tools.cost.finding_words import name_of
from haploop.tools.figure.labels import Label, place_labels
from haploop.tools.figure.style import ELEMENTS, FAINT, GREY, INK, SMALL, WALL, dress, plain_numbers

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MARKED_HZ = 10_000
UNCERTAIN = "#E4E4E4"
_TITLE_LETTERS = 58
# Colours that the colour-blind tell apart, and a marker each, for those who see none; others begin anew.
LOOKS: dict[str, tuple[str, str]] = {
    "exact": (WALL, "o"),
    "semi-implicit-euler": (ELEMENTS[0], "s"),
    "euler": (ELEMENTS[2], "v"),
    "rk4": (ELEMENTS[1], "D"),
    "implicit-midpoint": (ELEMENTS[3], "^"),
    "dop853": (ELEMENTS[5], "P"),
}
# Below a reference's uncertainty there is nothing to see: what is smaller than this share of it is drawn there.
_WITHIN = 0.3
# The share of a panel's height that the failures of one method take at its top edge.
_ROW = 0.045


def look(method: str) -> tuple[str, str]:
    """Colour and marker of a method."""
    return LOOKS.get(method, (GREY, "X"))


def draw_panel(ax: Axes, scene: SceneCost, tolerance_m: float) -> None:
    """Every point of a scene that has a time; labels come once the panel has its place."""
    reference = scene.reference
    what = "RMS error of the position (m)" if reference.pointwise else "error of the amplitude (m)"
    dress(ax, _title(scene), "time per simulated tick, in one process (µs)", what)
    low, high = _limits(scene, tolerance_m)
    ax.set_xscale("log")
    ax.set_yscale("log")
    plain_numbers(ax.xaxis)
    ax.set_ylim(low, high)
    ax.axhspan(low, max(reference.error_m, low), color=UNCERTAIN, zorder=0, linewidth=0, gid="uncertainty")
    ax.axhline(tolerance_m, color=GREY, linewidth=0.9, dashes=(4, 3), zorder=1, gid="tolerance")
    for method in methods_of([scene]):
        _curve(ax, [point for point in scene.points if point.method == method], scene)
    _mark_failures(ax, scene)
    times = [edge for p in scene.points if (t := p.us_per_tick) for edge in (t.q1, t.median, t.q3)]
    ax.set_xlim(min(times) / 1.25, max(times) * 1.25)


def _title(scene: SceneCost) -> str:
    """Its name, in two lines where it is long."""
    return "\n".join(wrap(name_of(scene), _TITLE_LETTERS))


def _limits(scene: SceneCost, tolerance_m: float) -> tuple[float, float]:
    """Whole decades around all errors, the reference's and the tolerance, and room for crosses above."""
    sizes = [drawn_m(point, scene) for point in scene.points if point.error]
    sizes = [size for size in [*sizes, scene.reference.error_m, tolerance_m] if 0.0 < size < math.inf]
    low, high = math.floor(math.log10(min(sizes)) - 0.3), math.ceil(math.log10(max(sizes)) + 0.2)
    rows = 1 + len(_failing(scene))
    return 10.0**low, 10.0 ** (low + (high - low) / (1.0 - _ROW * rows))


def drawn_m(point: Point, scene: SceneCost) -> float:
    """The error of a point as drawn: within the reference's uncertainty, what is smaller shows nothing more."""
    size = point.error.size_m if point.error else math.inf
    return max(size, _WITHIN * scene.reference.error_m, 1e-18)


def _failed(point: Point) -> bool:
    return point.error is None or not math.isfinite(point.error.size_m)


def _failing(scene: SceneCost) -> list[str]:
    """Methods that fail at some rate, in the order of their rows."""
    failing = {point.method for point in scene.points if point.us_per_tick and _failed(point)}
    return [method for method in methods_of([scene]) if method in failing]


def _mark_failures(ax: Axes, scene: SceneCost) -> None:
    """Above a line at the top there are no errors to be read, but failures."""
    if not (rows := len(_failing(scene))):
        return
    low, high = np.log10(ax.get_ylim())
    edge = 10.0 ** (high - _ROW * rows * (high - low))
    ax.axhline(edge, color=FAINT, linewidth=0.8, zorder=1)
    ax.set_yticks([tick for tick in ax.get_yticks() if 10.0**low <= tick < edge])
    place = {"ha": "right", "va": "center", "transform": ax.transAxes}
    ax.text(0.995, 1.0 - _ROW * rows / 2.0, "failed", fontsize=SMALL, color=GREY, **place)


def _place_of(ax: Axes, point: Point, scene: SceneCost) -> tuple[float, float]:
    """Where a point is drawn: its time and its error; without one, in the row of its method at the top edge."""
    assert point.us_per_tick is not None
    if not _failed(point):
        return point.us_per_tick.median, drawn_m(point, scene)
    low, high = np.log10(ax.get_ylim())
    row = 0.5 + _failing(scene).index(point.method)
    return point.us_per_tick.median, float(10.0 ** (high - _ROW * row * (high - low)))


def _curve(ax: Axes, points: list[Point], scene: SceneCost) -> None:
    """A method's line, broken where it failed; the quartiles of its times; what is wrong about a point."""
    points = sorted((point for point in points if point.us_per_tick), key=lambda point: point.plant_rate)
    if not points:
        return
    method = points[0].method
    colour, marker = look(method)
    xy = np.array([_place_of(ax, point, scene) for point in points])
    failed = np.array([_failed(point) for point in points])
    wide = 2.2 if method == "exact" else 1.2
    ax.plot(xy[:, 0], np.where(failed, np.nan, xy[:, 1]), color=colour, linewidth=wide, zorder=3, gid=f"line {method}")
    for point, (x, y) in zip(points, xy, strict=True):
        wrong = point.error is not None and not point.error.verdict_right
        style: dict[str, Any] = {"color": colour, "marker": marker, "markersize": 5.5, "zorder": 4, "linestyle": "none"}
        if _failed(point):
            style |= {"marker": "x", "markersize": 7.0, "markeredgewidth": 1.8, "clip_on": False, "gid": "failure"}
        elif wrong:
            style |= {"markerfacecolor": "white", "gid": "wrong verdict"}
        else:
            style |= {"gid": "point"}
        ax.plot([x], [y], **style)
        spread = point.us_per_tick
        assert spread is not None
        ax.plot([spread.q1, spread.q3], [y, y], color=colour, linewidth=0.9, alpha=0.7, zorder=2, gid="quartiles")
        if point.plant_rate == _MARKED_HZ:
            ax.plot([x], [y], marker="o", markersize=11, markerfacecolor="none", markeredgecolor=INK, gid="10 kHz")


def label_points(ax: Axes, scene: SceneCost) -> None:
    """The plant rate in kHz beside the points: of the scene's own method first, then where there is room."""
    timed = [point for point in scene.points if point.us_per_tick]
    labels = []
    for point in sorted(timed, key=lambda point: (point.method != scene.own_method, _failed(point))):
        in_kHz, colour = f"{point.plant_rate / 1000:g}", look(point.method)[0]
        half_px = 9.0 if point.plant_rate == _MARKED_HZ else 5.0
        labels.append(Label(*_place_of(ax, point, scene), in_kHz, colour, in_kHz, half_px))
    lines = [line.get_xydata() for line in ax.lines if (line.get_gid() or "").startswith("line ")]
    whole = [line[np.isfinite(line).all(axis=1)] for line in map(np.asarray, lines)]
    place_labels(ax, labels, whole)


def methods_of(scenes: list[SceneCost]) -> list[str]:
    """All methods, in the order of the looks, others after."""
    found = dict.fromkeys(point.method for scene in scenes for point in scene.points)
    return [method for method in LOOKS if method in found] + [method for method in found if method not in LOOKS]
