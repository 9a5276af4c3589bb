"""The figure of a sweep: a map of its cells, a panel for each combination of the axes beyond two."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from haploop.tools.figure.data import FigureError
from haploop.tools.figure.style import fix_layout, write_figure
from haploop.tools.sweep.map.axis import Ruler
from haploop.tools.sweep.map.bisect_figure import bisect_figure
from haploop.tools.sweep.map.data import LIMIT_CYCLE, MapData, make_map_data
from haploop.tools.sweep.map.edges import stiffest_steady
from haploop.tools.sweep.map.legend import Legend, amplitude_scale
from haploop.tools.sweep.map.lines import Star, draw_line, find_lines, line_styles, write_names
from haploop.tools.sweep.map.panels import (
    SwingScale,
    count_disagreement,
    draw_cells,
    draw_swings,
    mark_disagreement,
)
from haploop.tools.sweep.map.sentences import count_verdicts, description, map_notes, star_words
from haploop.tools.sweep.map.sheet import Layout, Sheet, fit_title, panel_title
from haploop.tools.sweep.table import NeedsPyarrow, TableError, read

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SIDES: tuple[Literal["x", "y"], ...] = ("x", "y")


def make_figure(data: MapData) -> Figure:
    """Makes the map of a sweep's cells, a panel for each combination of the axes that do not lie along it.

    Raises FigureError where matplotlib is missing.
    """
    cells, layout = data.cells(), Layout.from_axes(data.axes)
    along = [data.axes[layout.x]] + ([] if layout.y is None else [data.axes[layout.y]])
    rulers = [Ruler.from_axis(axis) for axis in along]
    panels = list(layout.panels(data.axes, cells))
    scenes = data.columns["scene"]
    overs = [find_lines((scenes[row] for row in panel.cells.row.flat if row >= 0), rulers) for panel in panels]
    words = {line.name: line.words for over in overs for line in over.lines if line.pieces}
    styles = line_styles(list(words))
    swinging = cells.amplitude_m[cells.verdict == LIMIT_CYCLE]
    swings, scale = SwingScale(cells), amplitude_scale(swinging) if layout.y is not None else None
    sheet = Sheet(len(panels), data.title, description(data, cells))
    for number, (ax, panel, over) in enumerate(zip(sheet.axes, panels, overs, strict=True)):
        if layout.y is None:
            draw_swings(ax, rulers[0], panel.cells, swings, sheet.is_left(number))
        else:
            draw_cells(ax, rulers[0], rulers[1], panel.cells, scale)
        for ruler, which in zip(rulers, _SIDES, strict=False):
            ruler.dress(ax, which, sheet.is_low(number) if which == "x" else sheet.is_left(number))
        panel_title(ax, panel.titles[0])
        over.drawn = {it.name: draw_line(ax, it, rulers, styles[it.name]) for it in over.lines if it.pieces}
    legend = Legend(sheet.side, *sheet.side_in)
    legend.verdicts(count_verdicts(cells), as_points=layout.y is None)
    if scale:
        legend.amplitudes(scale)
    legend.map_lines(styles, words)
    legend.notes(map_notes(data, cells, layout, overs))
    fix_layout(sheet.figure)
    for ax, panel, over in zip(sheet.axes, panels, overs, strict=True):
        fit_title(ax, panel.titles)
        if layout.y is None:
            count_disagreement(ax, rulers[0], panel.cells, swings)
        else:
            mark_disagreement(ax, rulers[0], rulers[1], panel.cells)
        star = None
        if found := stiffest_steady(along, panel.cells):
            x, *rest = (ruler.coordinates[index] for ruler, index in zip(rulers, found.index, strict=True))
            y = rest[0] if rest else float(swings.place(panel.cells.amplitude_m)[found.index])
            star = Star(x, y, star_words(found))
        write_names(ax, [over], styles, star, avoid_markers=layout.y is None)
    return sheet.figure


def draw_map(directory: Path, target: Path | None = None) -> Path:
    """Draws the map of a sweep, finished or not, into a file, and returns that.

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
