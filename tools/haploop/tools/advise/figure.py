"""The figure of an advice: the stiffest wall with each element, beside what is known, and what a change would gain."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

from haploop.tools.advise.advice import Advice
from haploop.tools.advise.report import format_limit, format_stiffness, moves, sentences
from haploop.tools.figure import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_IN, _ROW_IN, _BESIDE_IN = 11.0, 0.36, 1.5
_BAR = 0.62
_LETTERS = 118


def draw(told: Advice, target: Path) -> Path:
    """Draws into a file, in the format of its suffix; FigureError without matplotlib, or where it cannot be written."""
    return style.write_figure(figure_of(told), target)


def figure_of(told: Advice) -> Figure:
    """Makes two panels: the limits of every element with formulas and published values, and those of changed devices.

    Raises FigureError where matplotlib is missing.
    """
    changed = (*told.changed, *told.without)
    others = [(row.words, row.limit.stiffness_N_m, format_limit(row.limit)) for row in changed]
    for of, half, double in (row for row in told.assumed if moves(row[1], row[2], told.described)):
        others += [(f"{of.key} halved (assumed)", half.stiffness_N_m, format_limit(half))]
        others += [(f"{of.key} doubled (assumed)", double.stiffness_N_m, format_limit(double))]
    lines = [line for sentence in sentences(told) for line in textwrap.wrap(sentence, _LETTERS)]
    heights = [
        (len(told.found.bests) + len(told.formulas) + len(told.published)) * _ROW_IN + _BESIDE_IN + 0.2 * len(lines),
        len(others) * _ROW_IN + _BESIDE_IN,
    ]
    figure = style.empty_figure(_WIDTH_IN, sum(heights))
    above, below = figure.subplots(2, 1, height_ratios=heights)
    _walls(above, told, lines)
    _changes(below, told, others)
    return figure


def _walls(ax: Axes, told: Advice, lines: list[str]) -> None:
    """Draws a light bar for the loop as described, a dark one for every corner, a mark for what is known."""
    found, names = told.found, []
    ends = [end for best in found.bests for end in (best.nominal.stiffness_N_m, found.stiffness_N_m)]
    for row, best in enumerate(found.bests):
        is_advised = best is found.advised
        safe = found.stiffness_N_m if is_advised else best.safe.stiffness_N_m if best.safe else 0.0
        safe = min([safe, *(below for fallen, below in found.fell if fallen.family is best.family)])
        labels = ("_", "_") if row else ("as described", "in every corner")
        end = best.nominal.stiffness_N_m
        ax.barh(row, end / 1e3, _BAR, color=style.WALL_FILL, edgecolor=style.WALL, linewidth=0.8, label=labels[0])
        ax.barh(row, safe / 1e3, _BAR, color=style.WALL, label=labels[1])
        words = f"{format_limit(best.nominal)} {best.family.words(best.values) if best.values else ''}"
        if is_advised:
            words += f"   {'at most' if told.is_ideal else 'safe'}: {format_stiffness(safe)}"
        _beside(ax, max(end, safe), row, words, is_advised)
        names.append(best.family.name)
    known = [(f"{row.formula} ({row.source})", row.stiffness_N_m) for row in told.formulas]
    known += [(f"published: {value.by}", value.stiffness_N_m) for value in told.published]
    for row, (name, stiffness) in enumerate(known, len(found.bests)):
        colour = style.ELEMENTS[0] if row < len(found.bests) + len(told.formulas) else style.ELEMENTS[1]
        names.append(name)
        if 0.0 < stiffness < 1e9:
            ends.append(stiffness)
            ax.plot([stiffness / 1e3], [row], "D", color=colour, markersize=6)
        _beside(ax, stiffness if stiffness < 1e9 else 0.0, row, format_stiffness(stiffness))
    title = f"{told.name}: upper bound, not advice" if told.is_ideal else f"{told.name}: how stiff a wall may be"
    _finish(ax, title, names, ends, lines)
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, fontsize=style.SMALL, frameon=False)


def _changes(ax: Axes, told: Advice, others: list[tuple[str, float, str]]) -> None:
    nominal = told.described.stiffness_N_m
    for row, (_, stiffness, words) in enumerate(others):
        colour = style.VERDICTS["steady"] if stiffness > nominal else "#D9B08C"
        ax.barh(row, stiffness / 1e3, _BAR, color=colour)
        _beside(ax, max(stiffness, nominal), row, words)  # no word on the line of the described device
    if nominal:
        ax.axvline(nominal / 1e3, color=style.INK, linewidth=1.2)
    title = "the same wall as described, with one change of the device"
    _finish(ax, title, [name for name, _, _ in others], [nominal, *(stiffness for _, stiffness, _ in others)], [])


def _beside(ax: Axes, right: float, row: int, words: str, bold: bool = False) -> None:
    ax.annotate(
        words, (right / 1e3, row) if right else (0.0, row), (6, 0),
        xycoords="data" if right else ax.get_yaxis_transform(), textcoords="offset points",
        va="center", fontsize=style.SMALL, color=style.INK, fontweight="bold" if bold else "normal",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.85},
    )  # fmt: skip


def _finish(ax: Axes, title: str, names: list[str], stiffnesses: list[float], lines: list[str]) -> None:
    """Names the rows; the logarithmic axis leaves room for the words beside the longest bar."""
    style.dress(ax, title, "wall stiffness, N/mm", "")
    ax.set_yticks(range(len(names)), names, fontsize=style.TEXT)
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    real = [value / 1e3 for value in stiffnesses if value > 0.0] or [1e-3, 1.0]
    low, high = min(real) / 2.0, max(real)
    ax.set_xscale("log")
    ax.set_xlim(low, high * (high / low) ** 0.5)
    style.plain_numbers(ax.xaxis)
    text = "\n".join(["wall stiffness, N/mm", *lines])
    ax.set_xlabel(text, loc="left", fontsize=style.TEXT, color=style.GREY, linespacing=1.5)
