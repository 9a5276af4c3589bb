"""The figure of whatever is to be drawn: a run, several runs over one another, or the map of a sweep."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from haploop.tools.figure.data import FigureError
from haploop.tools.figure.overlay import draw_overlay
from haploop.tools.figure.run_figure import draw
from haploop.tools.sweep.table import is_sweep


def draw_any(directories: Sequence[Path], target: Path | None = None) -> Path:
    """Draws what is in one directory or several; returns the figure's file.

    Args:
        directories: of runs, or one of a sweep.
        target: file of the figure; in the first directory when None.

    Raises:
        FigureError: there is nothing to draw, or a sweep is to be drawn with something else.
    """
    if not directories:
        raise FigureError("There is no run to draw: name a directory of one.")
    first, *others = directories
    if sweeps := [path for path in directories if is_sweep(path)]:
        if others:
            raise FigureError(f"{sweeps[0]} is a sweep, which is drawn alone; only runs are drawn together.")
        from haploop.tools.sweep.map.figure import draw_map

        return draw_map(first, target)
    return draw_overlay(directories, target) if others else draw(first, target)
