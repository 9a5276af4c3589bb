"""The sheet of a map: its title, the room for its panels, and a column of signs and notes beside them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from haploop.tools.figure.style import GREY, INK, LARGE, SMALL, TEXT, empty_figure, fit_text, wrapped
from haploop.tools.sweep.map.looks import amplitude_colours, metres_along

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure, SubFigure
    from matplotlib.text import Text

# As wide as 1280 pixels of a screen.
WIDTH_IN, _SIDE_IN, _HEADER_IN = 11.64, 2.75, 0.8
# Height of a row of panels, by the number of rows.
_HEIGHTS_IN = {1: 6.0, 2: 3.6}
_LEAST_HEIGHT_IN = 2.7
# How far a panel's title may reach into the gap beside it, as a multiple of the panel's width.
_BEYOND = 1.05
# Of the column: the room above it and between its parts, the height of the amplitude scale, the letters of a line.
_ABOVE_IN, _GAP_IN, _BAR_IN, _LETTERS = 0.36, 0.16, 0.14, 44


class Sheet:
    """A figure with a header, panels in rows, and a column beside them; FigureError without matplotlib."""

    def __init__(self, panels: int, title: str, line: str) -> None:
        self.columns = panels if panels <= 3 else 2 if panels == 4 else 3 if panels <= 9 else 4
        rows = -(-panels // self.columns)
        body_in = rows * _HEIGHTS_IN.get(rows, _LEAST_HEIGHT_IN)
        self.figure: Figure = empty_figure(WIDTH_IN, _HEADER_IN + body_in)
        header, body = self.figure.subfigures(2, 1, squeeze=False, height_ratios=(_HEADER_IN, body_in))[:, 0]
        left, side = body.subfigures(1, 2, squeeze=False, width_ratios=(WIDTH_IN - _SIDE_IN, _SIDE_IN))[0]
        self.axes: list[Axes] = list(left.subplots(rows, self.columns, squeeze=False).ravel())
        for spare in self.axes[panels:]:
            spare.remove()
        del self.axes[panels:]
        self.column = Column(side, body_in)
        _write(header, title, 0.70, LARGE, INK, "title", bold=True)
        _write(header, line, 0.24, SMALL, GREY, "description")

    def is_left(self, number: int) -> bool:
        """Tells whether a panel is the first of its row."""
        return number % self.columns == 0

    def is_low(self, number: int) -> bool:
        """Tells whether there is no panel below a panel."""
        return number + self.columns >= len(self.axes)


class Column:
    """Writes beside a map from the top down, in a part of the figure ``height_in`` inches high."""

    def __init__(self, side: SubFigure, height_in: float) -> None:
        self._side, self._height_in = side, height_in
        self._ax: Axes = side.add_axes((0.0, 0.0, 1.0, 1.0))
        self._ax.set_axis_off()
        self._top = 1.0 - _ABOVE_IN / height_in

    def signs(self, signs: Sequence[Artist], heading: str = "") -> None:
        """Draws signs beside their labels."""
        from matplotlib.legend import Legend

        if not signs:
            return
        made = Legend(
            self._ax, signs, [str(sign.get_label()) for sign in signs], title=heading or None, loc="upper left",
            bbox_to_anchor=(0.0, self._top), borderaxespad=0.0, borderpad=0.0, frameon=False, alignment="left",
            fontsize=TEXT, title_fontsize=TEXT, labelcolor=INK, handlelength=2.6, handleheight=1.3, labelspacing=0.6,
        )  # fmt: skip
        self._ax.add_artist(made)
        for text in (*made.get_texts(), *[made.get_title()] * bool(heading)):
            text.set_gid("legend")
        self._go_below(made)

    def amplitudes(self, scale: LogNorm, word: str) -> None:
        """Draws the colour scale of the swings, named by the word for their verdict."""
        from matplotlib.cm import ScalarMappable

        self._write(f"{word}: swing, peak to peak", TEXT, INK)
        bottom = self._top - _BAR_IN / self._height_in
        bar = self._side.add_axes((0.02, bottom, 0.86, _BAR_IN / self._height_in))
        self._side.figure.colorbar(ScalarMappable(scale, amplitude_colours()), cax=bar, orientation="horizontal")
        metres_along(bar.xaxis, float(scale.vmax or 1.0) / float(scale.vmin or 1.0))
        bar.tick_params(labelsize=SMALL, colors=GREY, labelcolor=INK)
        bar.set_gid("amplitude scale")
        self._top = bottom - (_BAR_IN + _GAP_IN) / self._height_in - _GAP_IN / self._height_in

    def notes(self, sentences: Sequence[str]) -> None:
        """Writes sentences, a paragraph each, the first darker than the others."""
        for number, sentence in enumerate(sentences):
            lines = wrapped(sentence, _LETTERS, break_on_hyphens=False)
            self._write("\n".join(lines), SMALL, GREY if number else INK)

    def _write(self, words: str, size: float, colour: str) -> None:
        look = {"fontsize": size, "color": colour, "transform": self._ax.transAxes, "gid": "legend"}
        self._go_below(self._ax.text(0.0, self._top, words, va="top", **look))

    def _go_below(self, part: Artist) -> None:
        low = self._ax.transAxes.inverted().transform((0.0, part.get_window_extent().y0))[1]
        self._top = float(low) - 0.6 * _GAP_IN / self._height_in


def _write(header: SubFigure, words: str, y: float, size: float, colour: str, gid: str, bold: bool = False) -> None:
    """Writes one line, smaller if necessary, and cut off if that does not suffice."""
    weight = "bold" if bold else "normal"
    text = header.text(0.008, y, words, fontsize=size, color=colour, va="center", fontweight=weight, gid=gid)
    fit_text(text, header.figure.bbox.width * 0.984)


def panel_title(ax: Axes, words: str) -> Text:
    """Writes the title of a panel, which all its cells share."""
    return ax.set_title(words, loc="left", fontsize=TEXT, fontweight="bold", color=INK)


def fit_title(ax: Axes, titles: Sequence[str]) -> None:
    """Writes the first of some titles that is no wider than its panel; the last, cut off, if need be."""
    room_px = ax.get_window_extent().width * _BEYOND
    for words in titles:
        title = panel_title(ax, words)
        if words == titles[-1] or title.get_window_extent().width <= room_px:
            fit_text(title, room_px)
            return
