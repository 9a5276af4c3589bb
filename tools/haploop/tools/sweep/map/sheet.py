"""The sheet of a map: which axis goes where, its title, and the room for panels and a column of signs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, product
from math import prod
from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure.style import GREY, INK, LARGE, SMALL, TEXT, empty_figure, fit_text
from haploop.tools.sweep.map.data import STIFFNESS, Axis, Cells

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure
    from matplotlib.text import Text

MOST_PANELS = 12


@dataclass(frozen=True)
class Layout:
    """Numbers of the axes: of those along x and y of a panel (y is None where the amplitude is), and of the others."""

    x: int
    y: int | None
    others: tuple[int, ...]

    @classmethod
    def from_axes(cls, axes: Sequence[Axis]) -> Layout:
        """Lays numbers along the map, the wall's stiffness upwards; names, or the shortest of three, make panels."""
        numeric = [number for number, axis in enumerate(axes) if not axis.names]
        if len(numeric) == 3:
            free = [number for number in numeric if axes[number].key != STIFFNESS]
            numeric.remove(min(free, key=lambda number: (len(axes[number].values), -number)))
        along = numeric or [*range(len(axes))][:2]
        if len(along) == 2 and axes[along[0]].key == STIFFNESS:
            along.reverse()
        others = tuple(number for number in range(len(axes)) if number not in along)
        return cls(along[0], along[1] if len(along) == 2 else None, others)

    def count(self, axes: Sequence[Axis]) -> int:
        """Counts the panels."""
        return prod(len(axes[number].values) for number in self.others)

    def panels(self, axes: Sequence[Axis], cells: Cells) -> Iterator[Panel]:
        """Yields the first panels, as many as are drawn."""
        turned = self.y is not None and self.y < self.x
        lengths = [range(len(axes[number].values)) for number in self.others]
        for fixed in islice(product(*lengths), MOST_PANELS):
            at = dict(zip(self.others, fixed, strict=True))
            where = tuple(at.get(number, slice(None)) for number in range(len(axes)))
            taken = [array[where] for array in vars(cells).values()]
            words = {axes[number].key: axes[number].word(index) for number, index in at.items()}
            full = ", ".join(f"{key} = {word}" for key, word in words.items())
            short = ", ".join(f"{key.rpartition('.')[2]} = {word}" for key, word in words.items())
            titles = full, short, ", ".join(words.values())
            yield Panel(titles, Cells(*(np.ascontiguousarray(array.T) if turned else array for array in taken)))


@dataclass(frozen=True)
class Panel:
    """A part of a sweep whose cells have the values of all axes but those along it in common.

    Attributes:
        titles: these values in words, in full and ever shorter; empty words where there are none.
        cells: of shape (x values, y values) or (x values,).
    """

    titles: tuple[str, ...]
    cells: Cells


# A screen's 1280 pixels wide.
WIDTH_IN, SIDE_IN, _HEADER_IN = 11.64, 2.75, 0.8
# Height of a row of panels, by how many rows there are.
_HEIGHTS_IN = {1: 6.0, 2: 3.6}
_LEAST_HEIGHT_IN = 2.7
# How far a panel's title may reach into the gap beside it, as a multiple of the panel's width.
_BEYOND = 1.05


class Sheet:
    """A figure with a header, so many panels in rows, and a column beside them; FigureError without matplotlib.

    Attributes:
        side, side_in: the column beside them and its size.
    """

    def __init__(self, panels: int, title: str, line: str) -> None:
        self.columns = panels if panels <= 3 else 2 if panels == 4 else 3 if panels <= 9 else 4
        rows = -(-panels // self.columns)
        body_in = rows * _HEIGHTS_IN.get(rows, _LEAST_HEIGHT_IN)
        self.figure: Figure = empty_figure(WIDTH_IN, _HEADER_IN + body_in)
        header, body = self.figure.subfigures(2, 1, squeeze=False, height_ratios=(_HEADER_IN, body_in))[:, 0]
        widths = WIDTH_IN - SIDE_IN, SIDE_IN
        left, self.side = body.subfigures(1, 2, squeeze=False, width_ratios=widths)[0]
        self.side_in = SIDE_IN, body_in
        grid = left.add_gridspec(rows, self.columns)
        self.axes: list[Axes] = [
            left.add_subplot(grid[number // self.columns, number % self.columns]) for number in range(panels)
        ]
        _write(header, title, 0.70, LARGE, INK, "title", bold=True)
        _write(header, line, 0.24, SMALL, GREY, "description")

    def is_left(self, number: int) -> bool:
        """Tells whether a panel is the first of its row."""
        return number % self.columns == 0

    def is_low(self, number: int) -> bool:
        """Tells whether there is no panel below a panel."""
        return number + self.columns >= len(self.axes)


def _write(header: SubFigure, words: str, y: float, size: float, colour: str, gid: str, bold: bool = False) -> None:
    """Writes one line, smaller if it has to be, cut off if that does not do."""
    weight = "bold" if bold else "normal"
    text = header.text(0.008, y, words, fontsize=size, color=colour, va="center", fontweight=weight, gid=gid)
    fit_text(text, header.figure.bbox.width * 0.984)


def panel_title(ax: Axes, words: str) -> Text:
    """Writes the title of a panel, which its cells have in common."""
    return ax.set_title(words, loc="left", fontsize=TEXT, fontweight="bold", color=INK)


def fit_title(ax: Axes, titles: Sequence[str]) -> None:
    """Writes the first of some titles that is no wider than its panel; the last, cut off, if need be."""
    room_px = ax.get_window_extent().width * _BEYOND
    for words in titles:
        title = panel_title(ax, words)
        if words == titles[-1] or title.get_window_extent().width <= room_px:
            fit_text(title, room_px)
            return
