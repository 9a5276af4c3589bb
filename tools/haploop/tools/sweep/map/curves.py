"""The lines over a map as drawn, each with its own dashes and its name, and the star of the answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.tools.figure.style import INK
from haploop.tools.sweep.map.lines import EXACT, MapLine

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from haploop.tools.figure.labels import LabelRoom
    from haploop.tools.sweep.map.axis import Ruler

# Of a straight line, so that its name finds room.
_POINTS = 41
_DASHES = ((5, 2), (2, 1.5), (7, 2, 1.5, 2), (1, 1), (9, 3), (4, 1.5, 1, 1.5, 1, 1.5))
_STAR = "#C00000"
_COLOURS = ("#0B5FA5", "#7A1FA2", "#00664A", "#5B3A29", "#8A0F3C", "#3C3C8F")


def line_styles(names: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Returns colour and dashes of every line by its name; the exact limit is solid and black."""
    styles: dict[str, dict[str, Any]] = {}
    bounds = [name for name in names if name != EXACT]
    for number, name in enumerate(bounds):
        turn = number % len(_COLOURS)
        styles[name] = {"color": _COLOURS[turn], "dashes": _DASHES[turn], "linewidth": 1.8}
    return ({EXACT: {"color": INK, "linewidth": 2.0}} if EXACT in names else {}) | styles


def draw_line(ax: Axes, line: MapLine, rulers: Sequence[Ruler], style: dict[str, Any]) -> list[np.ndarray]:
    """Draws all pieces of a line; a piece that is one value of the only axis stands upright.

    Returns:
        The pieces in the coordinates of the panel.
    """
    from matplotlib.patheffects import Normal, withStroke

    halo = [withStroke(linewidth=style["linewidth"] + 1.8, foreground="white"), Normal()]
    look = style | {
        "zorder": 4 if len(rulers) == 2 else 1.5,
        "path_effects": halo,
        "gid": f"boundary {line.name}",
        "solid_capstyle": "round",
    }
    drawn = []
    for piece in line.pieces:
        places = np.column_stack([ruler.place(piece[:, number]) for number, ruler in enumerate(rulers)])
        if len(rulers) == 1:
            for (x,) in places:
                ax.axvline(x, **look)
            low, high = np.log(ax.get_ylim())
            upper = np.exp(np.linspace(high, low + 0.75 * (high - low), _POINTS))
            places = np.column_stack([np.full(_POINTS, places[0, 0]), upper])
        else:
            if len(places) == 1:
                places = _across(places[0], rulers)
            ax.plot(places[:, 0], places[:, 1], **look)
        drawn.append(places)
    return drawn


def _across(place: np.ndarray, rulers: Sequence[Ruler]) -> np.ndarray:
    """Returns a point as a line across the only cell there is along an axis."""
    points = np.tile(place, (_POINTS, 1))
    for number, ruler in enumerate(rulers):
        if len(ruler.axis.values) == 1:
            points[:, number] = np.linspace(ruler.edges[0], ruler.edges[-1], _POINTS)
    return points


def draw_star(ax: Axes, room: LabelRoom, x: float, y: float, texts: Sequence[str]) -> None:
    """Draws the star of the answer, and beside it the first of some texts that has room."""
    ax.plot(x, y, "*", color=_STAR, markersize=13, markeredgecolor="white", zorder=6, gid="star")
    room.beside(x, y, texts, _STAR, "star words")


def name_lines(room: LabelRoom, drawn: Mapping[str, Sequence[np.ndarray]], styles: dict[str, dict[str, Any]]) -> None:
    """Writes the name of each line on its longest piece, where there is room."""
    for name, pieces in drawn.items():
        if pieces:
            room.on_line(max(pieces, key=len), name, styles[name]["color"], "name of a line")
