"""The looks of verdicts, told apart without colour as well, and the column that explains them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from haploop.tools.figure.style import GREY, INK, SMALL, TEXT
from haploop.tools.figure.style import VERDICTS as COLOURS
from haploop.tools.render.units import amount
from haploop.tools.sweep.map.data import (
    DIVERGED,
    FAILED,
    GROWING,
    LIMIT_CYCLE,
    NO_CONTACT,
    STEADY,
    UNDECIDED,
    VERDICTS,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis as MatplotlibAxis
    from matplotlib.colors import Colormap, LogNorm
    from matplotlib.figure import SubFigure

    from haploop.tools.sweep.map.lines import LineStyle


class Look(NamedTuple):
    """Fill of a cell, hatching and its colour, marker of a point and its colour."""

    fill: str
    hatch: str
    hatch_colour: str
    marker: str
    colour: str


# From light to dark: steady, no contact, undecided, failed, the limit cycles' scale, growing, diverged.
LOOKS = {
    STEADY: Look("#D9EEF7", "", "", "o", COLOURS["steady"]),
    NO_CONTACT: Look("#FFFFFF", "...", "#A8A8A8", "s", COLOURS["no-contact"]),
    FAILED: Look("#BFBFBF", "xxx", "#666666", "x", "#222222"),
    UNDECIDED: Look("#E6E6E6", "\\\\\\", "#8C8C8C", "P", COLOURS["undecided"]),
    LIMIT_CYCLE: Look("#E0A030", "", "", "D", COLOURS["limit-cycle"]),
    GROWING: Look("#7A2430", "+++", "#D0A0A8", "v", COLOURS["growing"]),
    DIVERGED: Look("#3B0F1E", "///", "#A58090", "^", COLOURS["diverged"]),
}
# Of amplitudes that have colours of their own, the least over the greatest.
_RANGE = 1e-5


def verdict_words(verdict: int) -> str:
    return VERDICTS[verdict].replace("-", " ")


def amplitude_colours() -> Colormap:
    """Makes the colours from yellow to brown, without ends that could be taken for a steady or a diverged cell."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps["YlOrBr"](np.linspace(0.4, 0.9, 256)), name="amplitudes")


def amplitude_scale(amplitudes_m: np.ndarray) -> LogNorm | None:
    """Makes one logarithmic scale for some amplitudes, a great range cut at its lower end; None where none is known."""
    from matplotlib.colors import LogNorm

    known = amplitudes_m[np.isfinite(amplitudes_m) & (amplitudes_m > 0.0)]
    if not len(known):
        return None
    low, high = max(float(known.min()), _RANGE * float(known.max())), float(known.max())
    return LogNorm(low, high) if high > 2.0 * low else LogNorm(low / 1.5, high * 1.5)


def metres_along(axis: MatplotlibAxis, ratio: float) -> None:
    """Puts numbers with their own unit along a logarithmic axis of metres that reaches over a ratio."""
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

    log = LogLocator(subs=(1.0,) if ratio > 60.0 else (1.0, 3.0), numticks=7)
    axis.set_major_locator(log if ratio > 12.0 else MaxNLocator(4))
    axis.set_major_formatter(FuncFormatter(lambda value, _: amount(value, "m", digits=1)))
    axis.set_minor_formatter(NullFormatter())


_ROW_IN, _LINE_IN, _GAP_IN = 0.27, 0.155, 0.16
_SIGN_IN, _LETTERS = 0.34, 42


class Legend:
    """Writes the column beside a map, of a width and a height in inches, from the top down."""

    def __init__(self, side: SubFigure, width: float, height: float) -> None:
        self._side, self._width, self._height = side, width, height
        self._ax: Axes = side.add_axes((0.0, 0.0, 1.0, 1.0))
        self._ax.set(xlim=(0.0, width), ylim=(height, 0.0))
        self._ax.set_axis_off()
        self._y = 0.36

    def verdicts(self, counts: Mapping[int, int], as_points: bool) -> None:
        """Writes the sign of every verdict and how many cells came to it."""
        from matplotlib.patches import Rectangle

        for number, count in counts.items():
            look, middle = LOOKS[number], self._y + _ROW_IN / 2
            if as_points:
                self._ax.plot(_SIGN_IN / 2, middle, look.marker, color=look.colour, markersize=6)
            else:
                box = Rectangle((0.0, middle - 0.09), _SIGN_IN, 0.18)
                box.set(facecolor=look.fill, edgecolor=look.hatch_colour or GREY, hatch=look.hatch, linewidth=0.6)
                self._ax.add_patch(box)
            unit = "cell" if count == 1 else "cells"
            self._write(f"{verdict_words(number)}: {count} {unit}", middle)
            self._y += _ROW_IN
        self._y += _GAP_IN

    def amplitudes(self, scale: LogNorm) -> None:
        """Draws the colours of the limit cycles."""
        from matplotlib.cm import ScalarMappable

        self._heading(f"{verdict_words(LIMIT_CYCLE)}: swing, peak to peak")
        bottom = self._height - self._y - 0.14
        bar = self._side.add_axes((0.05, bottom / self._height, 0.86, 0.14 / self._height))
        shown = ScalarMappable(scale, amplitude_colours())
        self._side.figure.colorbar(shown, cax=bar, orientation="horizontal")
        metres_along(bar.xaxis, float(scale.vmax or 1.0) / float(scale.vmin or 1.0))
        bar.tick_params(labelsize=SMALL, colors=GREY, labelcolor=INK)
        bar.set_gid("amplitude scale")
        self._y += 0.14 + 0.28 + _GAP_IN

    def map_lines(self, styles: Mapping[str, LineStyle], words: Mapping[str, str]) -> None:
        """Writes the names of the lines over the map and what they say."""
        for name, style in styles.items():
            middle = self._y + _LINE_IN / 2
            self._ax.plot([0.0, _SIGN_IN], [middle, middle], **style)
            self._write(name, middle, fontweight="bold")
            self._y += _LINE_IN + 0.02
            self._lines(words.get(name, ""), _SIGN_IN + 0.1, GREY)
            self._y += 0.07
        self._y += _GAP_IN if styles else 0.0

    def lines(self, heading: str, signs: Sequence[tuple[str, str, str]]) -> None:
        """Writes the values that the lines through cells stand for, each with its colour and marker."""
        if heading:
            self._heading(heading)
        for words, colour, marker in signs:
            places = [0.0, _SIGN_IN / 2, _SIGN_IN], [self._y + _LINE_IN / 2] * 3
            self._ax.plot(*places, markevery=[1], markersize=6, color=colour, marker=marker)
            self._write(words, self._y + _LINE_IN / 2)
            self._y += _LINE_IN + 0.06
        self._y += _GAP_IN

    def notes(self, sentences: Sequence[str]) -> None:
        """Writes sentences, a paragraph each."""
        for number, sentence in enumerate(sentences):
            self._lines(sentence, 0.0, INK if number == 0 else GREY)
            self._y += 0.1

    def _heading(self, text: str) -> None:
        self._write(text, self._y + _LINE_IN / 2, left=0.0)
        self._y += _LINE_IN + 0.06

    def _lines(self, text: str, left: float, colour: str) -> None:
        letters = int(_LETTERS * (self._width - left) / self._width)
        for line in wrap(text, letters, break_on_hyphens=False):
            self._write(line, self._y + _LINE_IN / 2, left, size=SMALL, color=colour)
            self._y += _LINE_IN

    def _write(self, text: str, y: float, left: float = _SIGN_IN + 0.1, size: float = TEXT, **look: Any) -> None:
        look = {"color": INK} | look
        self._ax.text(left, y, text, va="center", ha="left", fontsize=size, gid="legend", **look)
