"""Figures: an empty one, its file, colours told apart by the colour-blind (Okabe and Ito 2008), plain axes."""

from __future__ import annotations

import contextlib
import io
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

from haploop.tools.figure.data import FigureError
from haploop.tools.render.terminal import told

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.text import Text

    from haploop.logger.summary import Summary

INK, GREY, FAINT = "#222222", "#666666", "#BBBBBB"
WALL, WALL_FILL, CLOSE, BUZZ = "#0072B2", "#D6E6F2", "#EBD9A8", "#B35900"
ELEMENTS = ("#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C564B")
PRESSING, RELEASING, EARLY = "#332288", "#DDAA33", "#C8C8C8"
# What the plant adds of its own: bodies beyond the device, forces beyond the commands.
OF_THE_PLANT = {"tip": "#117733", "hand": "#AA4499", "actuator": "#882255", "friction": "#999933"}
VERDICTS = {
    "steady": "#007A5A",
    "limit-cycle": "#B35900",
    "growing": "#8B1A1A",
    "diverged": "#8B1A1A",
    "no-contact": "#555555",
    "undecided": "#555555",
}
# Colour of a run that is steady with a proviso.
_PROVISO = "#5C6600"
TEXT, SMALL, LARGE = 9.0, 8.0, 15.0
# Letters of a legend that fit above a panel, and what the handle of an entry and a letter of the title take of them.
_ROOM_LETTERS, _HANDLE_LETTERS, _TITLE_LETTER = 88, 6, 1.25


def verdict_colour(summary: Summary | None) -> str:
    """Returns the colour of a run's verdict; steady with a proviso is less green than steady without one."""
    if not summary:
        return GREY
    has_proviso = summary["verdict"] == "steady" and summary.get("stability", {}).get("provisos")
    return _PROVISO if has_proviso else VERDICTS.get(told(summary), GREY)


def wrapped(words: str, letters: int, **how: Any) -> list[str]:
    """Returns text in lines of so many letters, none of which begins with a per cent sign; ``how`` as for textwrap."""
    return textwrap.wrap(words.replace(" %", "\u00a0%"), letters, **how)


def element_colour(number: int) -> str:
    """Returns the colour of the element with this number, by the order of their books."""
    return ELEMENTS[number % len(ELEMENTS)]


def dress(ax: Axes, title: str, x_label: str, y_label: str, *, above_pt: float = 6.0) -> None:
    """Writes title and labels in the style of all figures; the title stands so many points above the panel."""
    ax.set_title(title, loc="left", pad=above_pt, fontsize=TEXT + 1, fontweight="bold", color=INK)
    ax.set_xlabel(x_label, fontsize=TEXT, color=INK)
    ax.set_ylabel(y_label, fontsize=TEXT, color=INK)
    ax.tick_params(labelsize=SMALL, colors=GREY, labelcolor=INK)
    ax.grid(color="#E6E6E6", linewidth=0.6)
    ax.set_axisbelow(True)
    ax.ticklabel_format(useOffset=False)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        ax.spines[side].set_color(FAINT)


def few_ticks(ax: Axes) -> None:
    """Limits the numbers below the axes, so that long ones have room in a narrow panel."""
    ax.locator_params(axis="x", nbins=5)


def plain_numbers(axis: Axis, at: tuple[float, ...] = (1.0, 2.0, 5.0)) -> None:
    """Labels a logarithmic axis at these multiples in every decade, with plain numbers, not powers of ten."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=at))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
    axis.set_tick_params(which="minor", length=0)


def legend(ax: Axes, only: tuple[str, ...] = (), spare: tuple[str, ...] = (), **where: Any) -> None:
    """Draws a small legend above the axes' right end, where no line can run through it, or at ``where``.

    Entries that do not fit beside the title are left out, ``spare`` ones first, in their order; the colours are
    explained beside the books, too.
    """
    named = [(handle, label) for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)]
    named = [(handle, label) for handle, label in named if label in only or not only]
    room = _ROOM_LETTERS * _share_of_widest(ax) - _TITLE_LETTER * len(ax.get_title(loc="left"))
    while not where and sum(len(label) + _HANDLE_LETTERS for _, label in named) > room:
        labels = [label for _, label in named]
        del named[next((labels.index(label) for label in spare if label in labels), -1)]
    if named:
        handles, labels = zip(*named, strict=True)
        place = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "ncols": len(named), "frameon": False} | where
        look = {"fontsize": SMALL, "borderaxespad": 0.2, "handlelength": 1.6, "columnspacing": 1.0}
        ax.legend(handles, labels, **look, **place)


def _share_of_widest(ax: Axes) -> float:
    """Returns the width of the axes' column in its grid, as a share of the widest column's."""
    if not (spec := ax.get_subplotspec()):
        return 1.0
    widths = [float(width) for width in spec.get_gridspec().get_width_ratios()]  # pyright: ignore[reportGeneralTypeIssues]
    return widths[spec.colspan.start] / max(widths)


def corner_legend(ax: Axes) -> None:
    """Draws a legend in the upper left corner, which loops of springs and inertias leave free."""
    few_ticks(ax)
    legend(ax, loc="upper left", bbox_to_anchor=(0.0, 1.0), ncols=1, framealpha=0.8, edgecolor="none")


_DPI = 110


def empty_figure(width_in: float, height_in: float) -> Figure:
    """Returns a white figure of a size in inches that makes room for its contents; FigureError without matplotlib."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise FigureError("Figures need matplotlib; install it with: pip install 'haploop[plot]'") from error
    return Figure(figsize=(width_in, height_in), dpi=_DPI, facecolor="white", layout="constrained")


def write_figure(figure: Figure, target: Path) -> Path:
    """Writes a figure in the format of the file's suffix, ``.png`` where it has none; returns the file.

    Raises FigureError where it cannot be written; a figure that was there before is then kept.
    """
    if not target.suffix and not target.is_dir():
        target = target.with_name(f"{target.name}.png")
    picture, part = io.BytesIO(), target.with_name(f"{target.name}.part")
    _take_as_written(figure)
    try:
        figure.savefig(picture, dpi=_DPI, format=target.suffix.removeprefix(".") or None)
        try:
            part.write_bytes(picture.getbuffer())
            part.replace(target)
        except OSError:
            with contextlib.suppress(OSError):
                part.unlink()
            raise
    except ValueError as error:  # it names the available formats
        raise FigureError(f"The figure {target} cannot be written: {error}.") from error
    except OSError as error:
        raise FigureError(f"The figure {target} cannot be written: {error.strerror}.") from error
    return target


def _take_as_written(figure: Figure) -> None:
    """Has the user's names and titles drawn as they are written: their dollar signs enclose no formula."""
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        if "$" in text.get_text() and r"\mathdefault" not in text.get_text():  # powers of ten at an axis
            text.set_parse_math(False)


def fix_layout(figure: Figure) -> None:
    """Lays out everything and fixes the layout, so that labels can be placed among what is drawn."""
    _take_as_written(figure)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")


def fit_text(text: Text, room_px: float, smallest: float = 0.78) -> None:
    """Makes a text no wider than a number of pixels: smaller, down to a share of its size, then cut off.

    Dollar signs in it do not enclose a formula.
    """
    text.set_parse_math(False)
    width, size = text.get_window_extent().width, float(text.get_fontsize())
    if width > room_px:
        # A little smaller than in proportion, since the widths of letters are whole pixels.
        text.set_fontsize(size * max(smallest, min(1.0, 0.98 * room_px / width)))
    content = text.get_text()
    while content and (width := text.get_window_extent().width) > room_px:
        content = content[: min(len(content) - 1, int(len(content) * room_px / width))].rstrip()
        text.set_text(f"{content} …")
