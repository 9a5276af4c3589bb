"""The map of a sweep's directory, as far as it is written, in a file."""

from __future__ import annotations

from pathlib import Path

from haploop.tools.figure.data import FigureError
from haploop.tools.figure.file import write_figure
from haploop.tools.sweep.map.data import data_of
from haploop.tools.sweep.map.draw.bisect import bisect_figure
from haploop.tools.sweep.map.draw.figure import figure_of
from haploop.tools.sweep.run.columns import NeedsPyarrow
from haploop.tools.sweep.table import TableError, read


def draw_map(directory: Path, target: Path | None = None) -> Path:
    """Draw a sweep, finished or not.

    Args:
        directory: that ``haploop sweep`` writes to.
        target: file of the figure, in the format of its suffix; ``figure.png`` in the directory when None.

    Returns:
        The file.

    Raises:
        FigureError: matplotlib or pyarrow is missing, there is nothing to draw, or the file cannot be written.
    """
    try:
        table = read(directory)
    except (TableError, NeedsPyarrow) as error:
        raise FigureError(str(error)) from error
    data = data_of(table.columns, table.units, table.sweep, table.boundary)
    figure = bisect_figure(data) if data.has_edges else figure_of(data)
    return write_figure(figure, target or directory / "figure.png")
