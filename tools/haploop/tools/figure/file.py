"""An empty figure, and a figure in a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from haploop.tools.figure.data import FigureError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DPI = 110


def empty_figure(width_in: float, height_in: float) -> Figure:
    """A white figure of this size in inches that makes room for what it holds.

    Raises:
        FigureError: matplotlib is missing.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise FigureError("Figures need matplotlib; install it with: pip install 'haploop[plot]'") from error
    return Figure(figsize=(width_in, height_in), dpi=_DPI, facecolor="white", layout="constrained")


def write_figure(figure: Figure, target: Path) -> Path:
    """Write a figure in the format of the file's suffix; returns the file.

    Raises:
        FigureError: it cannot be written.
    """
    try:
        figure.savefig(target, dpi=_DPI)
    except (ValueError, OSError) as error:
        raise FigureError(f"The figure {target} cannot be written: {error}.") from error
    return target


def fix_layout(figure: Figure) -> None:
    """Give everything its place and keep it there, so that labels can be placed among what is drawn."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
