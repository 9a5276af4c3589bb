"""The figure of a bisecting sweep: how far the near side reaches, a line for every value of the second axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.tools.figure.style import ELEMENTS, FAINT, INK, WALL, fix_layout
from haploop.tools.sweep.map.axis import Ruler
from haploop.tools.sweep.map.data import Axis, MapData
from haploop.tools.sweep.map.edges import ALL_HOLD, FOUND, NONE_HOLDS, UNKNOWN, Edges, find_edges, furthest
from haploop.tools.sweep.map.legend import LOOKS, Legend
from haploop.tools.sweep.map.lines import LineStyle, PanelLines, Star, draw_line, find_lines, line_styles, write_names
from haploop.tools.sweep.map.sentences import edge_description, edge_notes
from haploop.tools.sweep.map.sheet import Sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_LINES = 8
_COLOURS = (WALL, *ELEMENTS, "#332288")
_MARKERS = "osD^vP*X"
# Signs of several lines at an edge stand above one another.
_STACK_PT = 9.0
# Of the height of a panel, what one of them takes.
_STRIP = 0.024


def bisect_figure(data: MapData) -> Figure:
    """Makes the figure of the boundaries of a finished bisecting sweep with two or three axes.

    Raises FigureError where matplotlib is missing.
    """
    edges = find_edges(data)
    x, y = Ruler.from_axis(edges.others[0]), Ruler.from_axis(edges.along)
    second = edges.others[1] if len(edges.others) > 1 else None
    count = min(MOST_LINES, len(second.values)) if second else 1
    overs = [_over(data, (x, y), second, number) for number in range(count)]
    sheet = Sheet(1, data.title, edge_description(data, edges))
    [ax] = sheet.axes
    styles = _draw_over(ax, overs, (x, y))
    x.dress(ax, "x")
    y.dress(ax, "y")
    _make_room(ax, y, edges, count)
    signs = []
    for number in range(count):
        part = (slice(None), number) if second else (slice(None),)
        colour = _COLOURS[number] if second else INK
        if not second:
            _fill(ax, x, y, edges)
        _line(ax, x, y, edges, part, number, colour)
        signs.append((second.word(number) if second else "boundary", colour, _MARKERS[number]))
    legend = Legend(sheet.side, *sheet.side_in)
    legend.lines(f"{second.key}" if second else "", signs)
    legend.map_lines(styles, {line.name: line.words for over in overs for line in over.lines})
    legend.notes(edge_notes(data, edges, overs))
    fix_layout(sheet.figure)
    best = furthest(edges)
    star = best and Star(x.coordinates[best.index[0]], float(y.place([best.value])[0]), [best.words])
    write_names(ax, overs, styles, star, avoid_markers=True)
    return sheet.figure


def _over(data: MapData, rulers: Sequence[Ruler], second: Axis | None, number: int) -> PanelLines:
    rows: Any = range(len(data.columns["verdict"]))
    if second:
        rows = np.flatnonzero(second.indices(data.columns[second.key]) == number).tolist()
    return find_lines((data.columns["scene"][row] for row in rows), rulers, bounds=second is None)


def _draw_over(ax: Axes, overs: Sequence[PanelLines], rulers: Sequence[Ruler]) -> dict[str, LineStyle]:
    """Draws the exact limit of every line in its colour, and the bounds where there is one line; returns the styles."""
    names = [line.name for over in overs for line in over.lines if line.pieces]
    styles = line_styles(list(dict.fromkeys(names)))
    for number, over in enumerate(overs):
        for line in over.lines:
            if line.pieces:
                style = styles[line.name]
                if len(overs) > 1:
                    style: LineStyle = {**style, "color": _COLOURS[number], "linewidth": 1.5}
                over.drawn[line.name] = draw_line(ax, line, rulers, style)
    return styles


def _line(ax: Axes, x: Ruler, y: Ruler, edges: Edges, part: tuple[Any, ...], number: int, colour: str) -> None:
    """Draws the boundaries of one line with their brackets; arrows at the edge where there is none."""
    from matplotlib.transforms import offset_copy

    state, at = edges.state[part], x.coordinates
    found = state == FOUND
    places = np.where(found, y.place(edges.nearest[part]), np.nan)
    joined = "none" if x.axis.names else "-"
    ax.plot(
        at, places, color=colour, linestyle=joined, linewidth=0.8, zorder=4.5, gid="boundary", marker=_MARKERS[number],
        markersize=5.5, markeredgecolor="white", markeredgewidth=0.6,
    )  # fmt: skip
    ends = y.place(edges.low[part][found]), y.place(edges.high[part][found])
    ax.vlines(at[found], *ends, color=colour, linewidth=2.4, alpha=0.5, zorder=4.4, gid="brackets")
    bottom, top = ax.get_ylim()
    far, near = (top, bottom) if edges.rising else (bottom, top)
    arrow = "^" if edges.rising else "v"
    for kind, where, marker in ((ALL_HOLD, far, arrow), (NONE_HOLDS, near, "x"), (UNKNOWN, near, "$?$")):
        here = at[state == kind]
        inwards = (1.0 if where == bottom else -1.0) * (_STACK_PT * (number + 0.6))
        shifted = offset_copy(ax.transData, ax.get_figure(root=True), y=inwards, units="points")
        ax.plot(
            here, np.full(len(here), where), color=colour, marker=marker, markersize=6, linestyle="none", zorder=6,
            gid=f"state {kind}", transform=shifted,
        )  # fmt: skip


def _make_room(ax: Axes, y: Ruler, edges: Edges, lines: int) -> None:
    """Adds a strip at either end for the signs of combinations without a boundary, one line's above the other's."""
    none, throughout = np.isin(edges.state, (NONE_HOLDS, UNKNOWN)).any(), (edges.state == ALL_HOLD).any()
    below, above = (none, throughout) if edges.rising else (throughout, none)
    bottom, top = y.edges[0], y.edges[-1]
    low, high = np.log((bottom, top)) if y.scale == "log" else (bottom, top)
    strip = (high - low) * _STRIP * (lines + 0.5)
    low, high = low - strip * below, high + strip * above
    ax.set_ylim(*(np.exp((low, high)) if y.scale == "log" else (low, high)))
    for drawn, at in ((below, bottom), (above, top)):
        if drawn:
            ax.axhline(at, color=FAINT, linewidth=0.8, zorder=0.8, gid="strip")


def _fill(ax: Axes, x: Ruler, y: Ruler, edges: Edges) -> None:
    bottom, top = y.edges[0], y.edges[-1]
    near, far = (bottom, top) if edges.rising else (top, bottom)
    borders = x.edges
    for i, state in enumerate(edges.state):
        if state in (FOUND, ALL_HOLD):
            end = float(y.place([edges.nearest[i]])[0]) if state == FOUND else far
            corners = [borders[i], borders[i + 1]]
            ax.fill_between(corners, [near] * 2, [end] * 2, color=LOOKS[0].fill, linewidth=0, zorder=0.5, gid="holds")
