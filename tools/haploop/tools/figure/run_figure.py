"""The figure of a run: does it rest, what moves it, and where its energy goes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from haploop.tools.figure.data import TOGETHER, FigureError, RunData
from haploop.tools.figure.loops import draw_force_position, draw_momentum
from haploop.tools.figure.style import (
    CLOSE,
    INK,
    OF_THE_PLANT,
    WALL,
    element_colour,
    empty_figure,
    few_ticks,
    legend,
    write_figure,
)
from haploop.tools.figure.text_panels import draw_books, draw_events, draw_header, event_lines
from haploop.tools.figure.time import energy_panel, force_panel, mark_events, position_panel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FigureError", "draw", "make_figure"]


def draw(run_directory: Path, target: Path | None = None) -> Path:
    """Draws the figure of a run into a file.

    Args:
        run_directory: what ``haploop run`` made; the log of a run that was killed serves as well.
        target: file of the figure, in the format of its suffix; ``figure.png`` in the directory when None.

    Returns:
        The file.

    Raises:
        FigureError: matplotlib is missing, there is nothing to draw, or the file cannot be written.
        LogError: the log is no log.
    """
    target = target or run_directory / "figure.png"
    return write_figure(make_figure(RunData.from_directory(run_directory)), target)


def make_figure(run: RunData) -> Figure:
    """Makes the figure of a run, with all panels.

    Raises:
        FigureError: matplotlib is missing.
    """
    figure = empty_figure(15.0, 9.2)
    events = event_lines(run)
    heights = 0.085, 1.0, 0.001 + 0.025 * len(events)
    header, body, footer = figure.subfigures(3, 1, squeeze=False, height_ratios=heights)[:, 0]
    grid = body.add_gridspec(3, 3, width_ratios=(1.9, 1.25, 1.15))
    close_s = run.close_s()
    position, force, energy = (body.add_subplot(grid[row, 0]) for row in range(3))
    position_panel(position, run, run.span_s, "Position")
    force_panel(force, run, run.span_s, "Force by part")
    for ax in (position, force):
        legend(ax)
        ax.axvspan(*close_s, color=CLOSE, alpha=0.5, zorder=0.5, linewidth=0)
    books = run.books()
    colours = OF_THE_PLANT | {"wall": WALL, TOGETHER: INK}
    colours |= {span.name: element_colour(number) for number, span in enumerate(run.history.elements)}
    energy_panel(energy, run, books, colours)
    mark_events([position, force, energy], run)
    close_position, close_force = (body.add_subplot(grid[row, 1]) for row in range(2))
    position_panel(close_position, run, close_s, "Position, close view")
    force_panel(close_force, run, close_s, "Force by part, close view")
    few_ticks(close_position)
    few_ticks(close_force)
    draw_force_position(body.add_subplot(grid[0, 2]), run, close_s)
    draw_momentum(body.add_subplot(grid[1, 2]), run, close_s)
    draw_books(body.add_subplot(grid[2, 1:]), run, books, colours)
    draw_header(header, run)
    draw_events(footer, events)
    body.align_ylabels()
    return figure
