"""The figure of a sweep: a map of its cells in panels, or the boundaries that a search found, in lines."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from haploop.tools.figure.data import FigureError
from haploop.tools.figure.style import ELEMENTS, FAINT, INK, WALL, fix_layout, write_figure
from haploop.tools.sweep.map.axis import Axis
from haploop.tools.sweep.map.data import Layout, MapData, Verdict, make_map_data
from haploop.tools.sweep.map.edges import Edges, State, find_edges, furthest, stiffest_steady
from haploop.tools.sweep.map.lines import (
    LineStyle,
    PanelLines,
    Star,
    draw_line,
    find_lines,
    line_signs,
    line_styles,
    write_names,
)
from haploop.tools.sweep.map.looks import LOOKS, amplitude_scale, verdict_signs
from haploop.tools.sweep.map.panels import (
    SwingScale,
    count_disagreement,
    draw_cells,
    draw_swings,
    mark_disagreement,
    unsteady_areas,
)
from haploop.tools.sweep.map.sentences import description, edge_description, edge_notes, map_notes
from haploop.tools.sweep.map.sheet import Sheet, fit_title, panel_title
from haploop.tools.sweep.table import NeedsPyarrow, TableError, read

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIDES: tuple[Literal["x", "y"], ...] = ("x", "y")
MOST_LINES = 8
_COLOURS = (WALL, *ELEMENTS, "#332288")
_MARKERS = "osD^vP*X"
# Signs of several lines at an edge are stacked; height of one of them, in points and as a share of the panel's height.
_STACK_PT, _STRIP = 9.0, 0.024


def draw_map(directory: Path, target: Path | None = None) -> Path:
    """Draws the map of a sweep, finished or not, into a file, and returns the file.

    Args:
        target: file of the figure, in the format of its suffix; ``figure.png`` in the directory when None.

    Raises:
        FigureError: matplotlib or pyarrow is missing, there is nothing to draw, or the file cannot be written.
    """
    try:
        table = read(directory)
    except (TableError, NeedsPyarrow) as error:
        raise FigureError(str(error)) from error
    data = make_map_data(table.columns, table.units, table.sweep, table.boundary)
    figure = bisect_figure(data) if data.has_edges else make_figure(data)
    return write_figure(figure, target or directory / "figure.png")


def make_figure(data: MapData) -> Figure:
    """Makes the map of a sweep's cells, with a panel for each combination of the axes that do not lie along it.

    Raises FigureError where matplotlib is missing.
    """
    cells, layout = data.cells(), Layout.from_axes(data.axes)
    along = [data.axes[layout.x]] + ([] if layout.y is None else [data.axes[layout.y]])
    panels = list(layout.panels(data.axes, cells))
    scenes = data.columns["scene"]
    overs = [find_lines((scenes[row] for row in panel.cells.row.flat if row >= 0), along) for panel in panels]
    styles = line_styles(list(dict.fromkeys(line.name for over in overs for line in over.lines if line.pieces)))
    swings = SwingScale(cells)
    scale = amplitude_scale(cells.amplitude_m[cells.verdict == Verdict.LIMIT_CYCLE]) if layout.y is not None else None
    sheet = Sheet(len(panels), data.title, description(data, cells))
    for number, (ax, panel, over) in enumerate(zip(sheet.axes, panels, overs, strict=True)):
        if layout.y is None:
            draw_swings(ax, along[0], panel.cells, swings, sheet.is_left(number))
        else:
            draw_cells(ax, along[0], along[1], panel.cells, scale)
        for axis, which in zip(along, _SIDES, strict=False):
            axis.dress(ax, which, sheet.is_low(number) if which == "x" else sheet.is_left(number))
        panel_title(ax, panel.titles[0])
        over.drawn = {it.name: draw_line(ax, it, along, styles[it.name]) for it in over.lines if it.pieces}
    sheet.column.signs(verdict_signs(cells.count(), data.word, layout.y is None, int(cells.rests_on.sum())))
    if scale:
        sheet.column.amplitudes(scale, data.word(Verdict.LIMIT_CYCLE))
    sheet.column.signs(line_signs(styles, overs))
    sheet.column.notes(map_notes(data, cells, layout, overs))
    fix_layout(sheet.figure)
    for ax, panel, over in zip(sheet.axes, panels, overs, strict=True):
        fit_title(ax, panel.titles)
        if layout.y is None:
            count_disagreement(ax, along[0], panel.cells, swings)
        else:
            mark_disagreement(ax, along[0], along[1], panel.cells)
        star = None
        if found := stiffest_steady(along, panel.cells, data.word(Verdict.STEADY)):
            x, *rest = (axis.coordinates[index] for axis, index in zip(along, found.index, strict=True))
            y = rest[0] if rest else float(swings.place(panel.cells.amplitude_m)[found.index])
            star = Star(x, y, found.words, unsteady_areas(along[0], along[1], panel.cells) if rest else ())
        write_names(ax, [over], styles, star, avoid_markers=layout.y is None)
    return sheet.figure


def bisect_figure(data: MapData) -> Figure:
    """Makes the figure of the boundaries of a finished bisecting sweep with two or three axes.

    It shows how far the near side reaches over the first of the other axes, with a line for every value of the second.
    Raises FigureError where matplotlib is missing.
    """
    from matplotlib.lines import Line2D

    edges, best = find_edges(data), None
    x, y = along = edges.others[0], edges.along
    second = edges.others[1] if len(edges.others) > 1 else None
    count = min(MOST_LINES, len(second.values)) if second else 1
    overs = []
    for number in range(count):
        at_row = second.indices(data.columns[second.key]) if second else np.zeros(len(data.verdicts))
        rows = np.flatnonzero(at_row == number)
        overs.append(find_lines((data.columns["scene"][row] for row in rows), along, bounds=second is None))
    sheet = Sheet(1, data.title, edge_description(data, edges))
    [ax] = sheet.axes
    styles = _draw_over(ax, overs, along)
    x.dress(ax, "x")
    y.dress(ax, "y")
    _make_room(ax, y, edges, count)
    if not second:
        _fill(ax, x, y, edges)
    signs = []
    for number in range(count):
        look: dict[str, Any] = {"color": _COLOURS[number] if second else INK, "marker": _MARKERS[number]}
        _draw_boundary(ax, edges, (slice(None), number) if second else (slice(None),), number, **look)
        signs.append(Line2D([], [], **look, label=second.word(number) if second else "boundary"))
    if best := furthest(edges):
        star = Star(x.coordinates[best.index[0]], float(y.place([best.value])[0]), best.words)
    else:
        star = None
    sheet.column.signs(signs, second.key if second else "")
    sheet.column.signs(line_signs(styles, overs))
    sheet.column.notes(edge_notes(data, edges, best, overs))
    fix_layout(sheet.figure)
    write_names(ax, overs, styles, star, avoid_markers=True)
    return sheet.figure


def _draw_over(ax: Axes, overs: Sequence[PanelLines], along: Sequence[Axis]) -> dict[str, LineStyle]:
    """Draws the exact limit of every line in its colour, and the bounds where there is one line; returns the styles."""
    styles = line_styles(list(dict.fromkeys(line.name for over in overs for line in over.lines if line.pieces)))
    for number, over in enumerate(overs):
        for line in over.lines:
            if line.pieces:
                style = styles[line.name]
                if len(overs) > 1:
                    style: LineStyle = {**style, "color": _COLOURS[number], "linewidth": 1.5}
                over.drawn[line.name] = draw_line(ax, line, along, style)
    return styles


def _draw_boundary(ax: Axes, edges: Edges, part: tuple[Any, ...], number: int, color: str, marker: str) -> None:
    """Draws the boundaries of one line with their brackets; signs at the edge of the panel where there is none."""
    from matplotlib.transforms import offset_copy

    x, y, state = edges.others[0], edges.along, edges.state[part]
    at, found = x.coordinates, state == State.FOUND
    ax.plot(
        at, np.where(found, y.place(edges.nearest[part]), np.nan), color=color, marker=marker, markersize=5.5,
        linestyle="none" if x.names else "-", linewidth=0.8, markeredgecolor="white", markeredgewidth=0.6, zorder=4.5,
        gid="boundary",
    )  # fmt: skip
    ends = y.place(edges.low[part][found]), y.place(edges.high[part][found])
    ax.vlines(at[found], *ends, color=color, linewidth=2.4, alpha=0.5, zorder=4.4, gid="brackets")
    bottom, top = ax.get_ylim()
    far, near = (top, bottom) if edges.rising else (bottom, top)
    arrow = "^" if edges.rising else "v"
    signs = {State.ALL_HOLD: (far, arrow), State.NONE_HOLDS: (near, "x"), State.UNKNOWN: (near, "$?$")}
    for kind, (where, sign) in signs.items():
        here = at[state == kind]
        inwards = (1.0 if where == bottom else -1.0) * (_STACK_PT * (number + 0.6))
        shifted = offset_copy(ax.transData, ax.get_figure(root=True), y=inwards, units="points")
        look = {"color": color, "marker": sign, "markersize": 6, "linestyle": "none", "zorder": 6}
        ax.plot(here, np.full(len(here), where), **look, gid=f"state {kind}", transform=shifted)


def _make_room(ax: Axes, y: Axis, edges: Edges, lines: int) -> None:
    """Adds strips at the ends for the signs of combinations without a boundary, those of several lines stacked."""
    states = {*edges.state.flat}
    none, throughout = bool({State.NONE_HOLDS, State.UNKNOWN} & states), State.ALL_HOLD in states
    below, above = (none, throughout) if edges.rising else (throughout, none)
    bottom, top = y.edges[0], y.edges[-1]
    low, high = np.log((bottom, top)) if y.scale == "log" else (bottom, top)
    strip = (high - low) * _STRIP * (lines + 0.5)
    low, high = low - strip * below, high + strip * above
    ax.set_ylim(*(np.exp((low, high)) if y.scale == "log" else (low, high)))
    for drawn, at in ((below, bottom), (above, top)):
        if drawn:
            ax.axhline(at, color=FAINT, linewidth=0.8, zorder=0.8, gid="strip")


def _fill(ax: Axes, x: Axis, y: Axis, edges: Edges) -> None:
    """Fills the area that holds: from where the search begins to the boundary, or to the end where none was found."""
    near, far = y.edges[[0, -1]] if edges.rising else y.edges[[-1, 0]]
    borders = x.edges
    for i in np.flatnonzero(np.isin(edges.state, (State.FOUND, State.ALL_HOLD))):
        end = float(y.place([edges.nearest[i]])[0]) if edges.state[i] == State.FOUND else far
        look = {"color": LOOKS[Verdict.STEADY].fill, "linewidth": 0, "zorder": 0.5, "gid": "holds"}
        ax.fill_between(borders[i : i + 2], [near] * 2, [end] * 2, **look)
