"""The figure of a comparison: how much more is held with every stabilizer, with intervals, and what it costs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.advise.families import NOTHING
from haploop.tools.compare.bench import Row, family_of
from haploop.tools.compare.comparison import Comparison, OfLoop
from haploop.tools.compare.ranking import best, held, more, ranking, without
from haploop.tools.compare.report import SIGNS
from haploop.tools.figure import style
from haploop.tools.render.units import format_stiffness

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_IN, _ROW_IN, _BESIDE_IN = 11.0, 0.3, 2.0
_GREY = "#777777"
# Height of a legend, in points, above which the name of the device stands.
_LEGEND_PT = 36.0
_FORCES = {
    "ripple_N": ("ripple above 30 Hz, p-p", "|"),
    "extra_N": ("largest own force", "D"),
    "extra_rms_N": ("own force, r.m.s.", "."),
}


def draw(told: Comparison, target: Path) -> Path:
    """Draws into a file, in the format of its suffix; FigureError without matplotlib, or where it cannot be written."""
    return style.write_figure(figure_of([told]), target)


def figure_of(comparisons: Sequence[Comparison]) -> Figure:
    """Makes a row of panels per device: how much more is held than without any element, as described under both sets of
    seeds, and on the other loops if there are any; ripple and force of the element.

    Raises FigureError where matplotlib is missing.
    """
    heights = [len(_rows(told.loops[0])) * _ROW_IN + _BESIDE_IN for told in comparisons]
    figure = style.empty_figure(_WIDTH_IN, sum(heights))
    has_others = any(told.loops[1:] for told in comparisons)
    widths = (1.1, 1.0, 0.8) if has_others else (1.5, 0.8)
    axes = figure.subplots(len(comparisons), len(widths), squeeze=False, width_ratios=widths, height_ratios=heights)
    for (left, *middle, right), told in zip(axes, comparisons, strict=True):
        first, *others = told.loops
        _gains(left, told)
        for ax in middle:
            _loops(ax, first, others)
        _costs(right, first)
        for ax in (*middle, right):
            ax.set_yticklabels([])
    return figure


def _rows(of: OfLoop) -> list[Row]:
    """Returns the rows that are drawn, from top to bottom."""
    return [row for row in of.rows if row.family != NOTHING.name]


def _gains(ax: Axes, told: Comparison) -> None:
    of, names = told.loops[0], list[str]()
    (found, tied), order = best(of), ranking(of)
    again = {row.family: row for row in of.again}
    for place, row in enumerate(_rows(of)):
        colour = style.WALL if row is found or row in tied else _GREY
        _interval(ax, more(row, without(of.rows)), place - 0.14, colour, "o", 5.0)
        _interval(ax, more(again[row.family], without(of.again)), place + 0.14, colour, "s", 4.0, filled=False)
        told_apart = SIGNS[order.versus(row.family, NOTHING.name)]
        names.append(f"{row.family}{told_apart}\n{family_of(row.family).words(row.values)}")
    delay = f", round trip {of.delay_s * 1e3:g} ms" if of.delay_s else ""
    _finish(ax, f"{told.name}{delay}", "held more than without any element, N/mm", of)
    ax.set_yticks(range(len(names)), names, fontsize=6.5)
    for marker, colour, fill, label in (
        ("o", _GREY, _GREY, "seeds shown"),
        ("s", _GREY, "white", "other seeds, other tuning"),
        ("o", style.WALL, style.WALL, "not told apart from the best"),
    ):
        ax.plot([], [], marker, color=colour, markerfacecolor=fill, markersize=4.5, label=label)
    _legend(ax)
    value = format_stiffness(held(without(of.rows)).value)
    ax.set_xlabel(
        f"held more than without any element ({value}), N/mm;\n"
        f"mean and 95 % over {told.effort.seeds} seeds; ▲ ▼ told apart from none",
        fontsize=style.SMALL,
    )


def _loops(ax: Axes, first: OfLoop, others: Sequence[OfLoop]) -> None:
    for number, of in enumerate(others):
        colour = style.element_colour(number)
        for place, row in enumerate(_rows(first)):
            on_this = next(each for each in of.rows if each.family == row.family)
            at = place + 0.24 * (number - (len(others) - 1) / 2.0)
            _interval(ax, more(on_this, without(of.rows)), at, colour, "o", 3.0)
        alone = format_stiffness(held(without(of.rows)).value)
        ax.plot([], [], "o-", color=colour, markersize=3.0, label=f"{of.name} (without: {alone})")
    _finish(ax, "", "the same on other loops, N/mm", first)
    _legend(ax)


def _costs(ax: Axes, of: OfLoop) -> None:
    for place, row in enumerate(_rows(of)):
        shown = [each.rendered for each in row.seeds if each.rendered.held_N_m]
        for number, (name, (_, marker)) in enumerate(_FORCES.items()):
            value = float(np.mean([getattr(each, name) for each in shown])) if shown else 0.0
            if value > 0.0:
                size = 9 if marker == "|" else 4
                ax.plot([value], [place], marker, color=style.ELEMENTS[number], markersize=size)
    for number, (label, marker) in enumerate(_FORCES.values()):
        ax.plot([], [], marker, color=style.ELEMENTS[number], label=label, markersize=5)
    _finish(ax, "", "force, N", of, zero=False)
    if ax.dataLim.x1 > 0.0:  # else no element held a wall, and there is no force to show
        ax.set_xscale("log")
        low, high = ax.get_xlim()
        style.plain_numbers(ax.xaxis, (1.0,) if high > 100.0 * low else (1.0, 2.0, 5.0))
    _legend(ax)


def _legend(ax: Axes) -> None:
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=1, fontsize=6.5, frameon=False, borderpad=0.0)


def _interval(
    ax: Axes, inside: tuple[float, ...], place: float, colour: str, marker: str, size: float, *, filled: bool = True
) -> None:
    value, low, high = (end / 1e3 for end in inside)
    ax.plot([low, high], [place, place], color=colour, linewidth=1.3)
    ax.plot([value], [place], marker, color=colour, markerfacecolor=colour if filled else "white", markersize=size)


def _finish(ax: Axes, title: str, x_label: str, of: OfLoop, *, zero: bool = True) -> None:
    style.dress(ax, title, x_label, "", above_pt=_LEGEND_PT)
    rows = _rows(of)
    ax.set_yticks(range(len(rows)))
    ax.set_ylim(len(rows) - 0.4, -0.6)
    if zero:
        ax.axvline(0.0, color=style.INK, linewidth=0.8)
