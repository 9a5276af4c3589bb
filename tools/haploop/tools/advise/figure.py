"""The figure of an advice: the stiffest wall with each element, beside what is known, and what a change would gain."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.advise.advice import Advice
from haploop.tools.advise.report import answer, format_attacked, format_limit, moves
from haploop.tools.advise.walls.limit import Limit
from haploop.tools.advise.withstand import WORTH
from haploop.tools.figure import style
from haploop.tools.render.units import format_stiffness

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.transforms import Transform

_WIDTH_IN, _ROW_IN, _BESIDE_IN = 11.0, 0.37, 1.6
# Of the answer: letters of its headline and of other lines, the height of a line, and, in the figure's widths, where
# names end and lines begin.
_HEADLINE_LETTERS, _LETTERS, _LINE_IN, _NAMES_END, _LINES_BEGIN = 130, 124, 0.2, 0.12, 0.128
_NAME_LETTERS = 60
_DOT = 7.0
_LIGHT, _HALF, _SOFTER = "white", "#9CC3E0", "#B07A45"
# Right ends of the columns of numbers beside the axes, in points.
_COLUMNS = 95, 192, 289
# Numbers at which an axis may begin and end, in every decade.
_ENDS = (1.0, 2.0, 5.0)
# About where an axis lies on which there is nothing to mark.
_NO_WALL_N_MM = 1.0
# An axis ends at this factor below the stiffest wall; softer ones are drawn at its end, as arrows.
_SPAN = 300.0


def draw(told: Advice, target: Path) -> Path:
    """Draws into a file, in the format of its suffix; FigureError without matplotlib, or where it cannot be written."""
    return style.write_figure(figure_of(told), target)


def figure_of(told: Advice) -> Figure:
    """Makes two panels: the limits of every element with formulas and published values, and those of changed devices.

    The second is left out where no change makes any wall possible.

    Dots on one logarithmic axis, on which the length of a bar would mean nothing; the numbers stand beside it. The
    answer in words stands between the panels.

    Raises FigureError where matplotlib is missing.
    """
    changed = (*told.changed, *told.without)
    has_element = bool(told.found.advised.values)
    others = [(row.words, row.limit, row.alone if has_element else None) for row in changed]
    for of, half, double in (row for row in told.assumed if moves(row[1], row[2], told.unchanged.limit)):
        others += [(f"{of.key} halved (assumed)", half, None), (f"{of.key} doubled (assumed)", double, None)]
    headline = style.wrapped(told.headline, _HEADLINE_LETTERS)
    lines = [(name, style.wrapped(f"{words.rstrip('.')}.", _LETTERS)) for name, words in answer(told)]
    if not any(limit.stiffness_N_m for _, limit, _ in others):
        others = []
    rows = len(told.found.bests) + len(told.formulas) + len(told.published)
    height_in = (len(headline) + sum(len(wrapped) for _, wrapped in lines)) * _LINE_IN
    heights = [rows * _ROW_IN + _BESIDE_IN, height_in, *[len(others) * _ROW_IN + _BESIDE_IN] * bool(others)]
    figure = style.empty_figure(_WIDTH_IN, sum(heights))
    from matplotlib.transforms import blended_transform_factory

    above, between, *below = figure.subplots(len(heights), 1, height_ratios=heights)
    _answer(between, blended_transform_factory(figure.transFigure, between.transData), headline, lines)
    stiffnesses = [_walls(above, told), *(_changes(ax, told, others) for ax in below)]
    for ax in (above, *below):
        ax.set_xlim(*_ends([value / 1e3 for values in stiffnesses for value in values]))
        ax.set_xscale("log")
        style.plain_numbers(ax.xaxis)
        _keep_within(ax)
    return figure


def _answer(ax: Axes, across: Transform, headline: list[str], lines: list[tuple[str, list[str]]]) -> None:
    """Writes the answer across the figure, one line a unit of y: its headline, then every name with its lines."""
    look = {"transform": across, "va": "center", "fontsize": style.TEXT, "in_layout": False}
    row = 0
    for line in headline:
        ax.text(_NAMES_END / 12, row, line, color=style.INK, fontweight="bold", **look)
        row += 1
    for place, (name, wrapped) in enumerate(lines):
        weight, colour = ("normal", style.GREY) if place else ("bold", style.INK)
        ax.text(_NAMES_END, row, name, color=style.INK, ha="right", fontweight=weight, **look)
        for line in wrapped:
            ax.text(_LINES_BEGIN, row, line, color=colour, fontweight=weight, **look)
            row += 1
    ax.set_ylim(row - 0.5, -0.5)
    ax.set_axis_off()


def _walls(ax: Axes, told: Advice) -> list[float]:
    """Marks the loop as described, every corner, and what is known; returns the stiffnesses, N/m."""
    names, marked = [], []
    for row, best in enumerate(told.found.bests):
        nominal, safe = best.nominal.stiffness_N_m, best.safe.stiffness_N_m if best.safe else 0.0
        attacked, withstood = told.found.attacked(best) or (0.0, True)
        ends = [end for end in (attacked, safe, nominal) if end]
        ax.plot([min(ends) / 1e3, max(ends) / 1e3] if ends else [], [row, row] if ends else [], color=style.WALL,
                linewidth=1.0, zorder=2)  # fmt: skip
        _mark(ax, row, nominal, "o", style.WALL, "" if row else "as described", face=_LIGHT)
        _mark(ax, row, safe, "o", style.WALL, "" if row else "in every corner", face=_HALF)
        _mark(ax, row, attacked, "o" if withstood else "<", style.WALL, "" if row else "attacked")
        safe_words = format_limit(best.safe) if best.safe else "–"
        numbers = format_attacked(told, best), safe_words, format_limit(best.nominal)
        _beside(ax, row, numbers, best is told.found.advised)
        names.append(f"{best.family.name}\n{best.family.words(best.values)}" if best.values else best.family.name)
        marked += ends
    formulas = [(f"{row.formula}\n({row.source})", row.stiffness_N_m) for row in told.formulas]
    published = [(f"published: {value.by}", value.stiffness_N_m) for value in told.published]
    for label, known, colour in (("formula", formulas, style.ELEMENTS[0]), ("published", published, style.ELEMENTS[1])):
        for place, (name, stiffness) in enumerate(known):
            drawn = stiffness if stiffness < 1e9 else 0.0
            _mark(ax, len(names), drawn, "D", colour, "" if place else label)
            _beside(ax, len(names), ("", "", format_stiffness(stiffness)))
            names.append(name)
            marked.append(drawn)
    name = textwrap.shorten(told.name, _NAME_LETTERS, placeholder=" ...")
    title = f"{name}: upper bound, not advice" if told.is_ideal else f"{name}: how stiff a wall may be"
    _finish(ax, title, names)
    _beside(ax, -0.85, ("attacked", "every corner", "as described"), bold=True)
    return marked


def _changes(ax: Axes, told: Advice, others: list[tuple[str, Limit, Limit | None]]) -> list[float]:
    """Marks what the loop bears after every change, with a line from what it bears unchanged; returns these, N/m."""
    nominal, seen = told.unchanged.limit.stiffness_N_m, set[str]()
    for row, (_, limit, alone) in enumerate(others):
        stiffness = limit.stiffness_N_m
        size = (stiffness > nominal * WORTH) - (stiffness * WORTH < nominal)
        colour, label = (
            (style.GREY, "equally stiff within a tenth"),
            (style.VERDICTS["steady"], "stiffer"),
            (_SOFTER, "softer"),
        )[size]
        if nominal and stiffness:
            ax.plot([nominal / 1e3, stiffness / 1e3], [row, row], color=colour, linewidth=2.0)
        _mark(ax, row, stiffness, "o", colour, "" if label in seen or not stiffness else label)
        seen |= {label} if stiffness else set()
        _beside(ax, row, ("", format_limit(limit), format_limit(alone) if alone else ""))
    if nominal:
        ax.axvline(nominal / 1e3, color=style.INK, linewidth=1.2, label="unchanged", zorder=1)
    has_element = bool(told.found.advised.values)
    title = "after one change of the device, in the hardest corners" + ", with the element tuned again" * has_element
    _finish(ax, title, [name for name, *_ in others])
    _beside(ax, -0.85, ("", "element", "without") if has_element else ("", "", ""), bold=True)
    return [nominal, *(limit.stiffness_N_m for _, limit, _ in others)]


def _mark(ax: Axes, row: int, stiffness: float, shape: str, colour: str, label: str, face: str = "") -> None:
    """Draws a mark with its entry in the legend; none where there is no such wall."""
    if stiffness or label:
        at = ([stiffness / 1e3], [row]) if stiffness else ([], [])
        look = {"markersize": _DOT, "markerfacecolor": face or colour, "color": colour, "linestyle": "none"}
        ax.plot(*at, shape, label=label or "_", zorder=3, **look)


def _beside(ax: Axes, row: float, numbers: tuple[str, str, str], bold: bool = False) -> None:
    """Writes a row of the table beside the axes."""
    look = {"fontsize": style.SMALL, "color": style.INK, "fontweight": "bold" if bold else "normal", "va": "center"}
    for right, text in zip(_COLUMNS, numbers, strict=True):
        place = {"xycoords": ax.get_yaxis_transform(), "textcoords": "offset points", "annotation_clip": False}
        ax.annotate(text, (1.0, row), (right, 0), ha="right", **place, **look)


def _ends(stiffnesses: list[float]) -> tuple[float, float]:
    """Returns the round numbers around the positive ones, 1, 2 or 5 in a decade, for a logarithmic axis."""
    real = [value for value in stiffnesses if value > 0.0] or [_NO_WALL_N_MM]
    most = max(real) * 1.1
    least = max(min(real) * 0.9, most / _SPAN)
    decades = range(math.floor(math.log10(least)) - 1, math.ceil(math.log10(most)) + 2)
    steps = [digit * 10.0**power for power in decades for digit in _ENDS]
    return max(step for step in steps if step <= least), min(step for step in steps if step >= most)


def _keep_within(ax: Axes) -> None:
    """Moves what lies beyond the soft end of the axis to that end; marks become arrows."""
    end = ax.get_xlim()[0]
    for line in ax.lines:
        at = np.asarray(line.get_xdata(), float).tolist()
        if at and min(at) < end:
            line.set_xdata([max(x, end) for x in at])
            if len(at) == 1:
                line.set(marker="<", clip_on=False)


def _finish(ax: Axes, title: str, names: list[str]) -> None:
    """Names the rows, and puts the legend above the axis."""
    style.dress(ax, "", "wall stiffness, N/mm", "")
    ax.set_title(title, loc="left", pad=22, fontsize=style.TEXT + 1, fontweight="bold", color=style.INK)
    ax.set_yticks(range(len(names)), names, fontsize=style.TEXT)
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    ax.set_xlabel("wall stiffness, N/mm", loc="left", fontsize=style.TEXT, color=style.GREY)
    style.legend(ax, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=5)
