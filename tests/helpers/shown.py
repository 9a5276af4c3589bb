"""Parts of a figure and of a terminal's text."""

from __future__ import annotations

import io
from typing import Any

from matplotlib.axis import Axis
from rich.console import Console


def artists(figure: Any, name: str) -> list[Any]:
    """Everything drawn under a name, in the order of drawing; no ticks, which looking at them would create."""
    within = (
        [] if isinstance(figure, Axis) else [found for one in figure.get_children() for found in artists(one, name)]
    )
    return [*within, figure] if figure.get_gid() == name else within


def shown(renderable: Any, width: int = 100) -> str:
    terminal = Console(width=width, file=io.StringIO(), highlight=False)
    terminal.print(renderable)
    return terminal.file.getvalue()  # pyright: ignore[reportAttributeAccessIssue]


def row(text: str, begins: str) -> list[str]:
    """The cells of the line that begins with some words."""
    (line,) = [line for line in text.splitlines() if line.strip().startswith(begins)]
    return [cell.strip() for cell in line.strip().removeprefix(begins).split("  ") if cell.strip()]


def words(figure: Any, name: str) -> list[str]:
    """The texts drawn under a name, each on one line."""
    return [" ".join(text.get_text().split()) for text in artists(figure, name)]


def axes(figure: Any) -> list[Any]:
    """The axes of all parts of a figure that are switched on."""
    return [ax for part in figure.subfigs for ax in part.axes if ax.axison]
