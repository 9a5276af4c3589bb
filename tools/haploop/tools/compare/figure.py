"""The figure of a comparison: what is held with every stabilizer, with intervals, and what it costs, loop by loop."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.compare.bench import Row, family_of
from haploop.tools.compare.comparison import Comparison, OfLoop
from haploop.tools.compare.ranking import best, held
from haploop.tools.compare.report import format_stiffness
from haploop.tools.figure import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_IN, _ROW_IN, _BESIDE_IN = 11.0, 0.3, 1.9
_GREY, _SHOWS = "#999999", 0.5
_FORCES = {
    "ripple_N": ("ripple above 30 Hz, p-p", "|"),
    "extra_N": ("largest own force", "D"),
    "extra_rms_N": ("own force, r.m.s.", "."),
}


def draw(told: Comparison, target: Path) -> Path:
    """Draws into a file, in the format of its suffix; FigureError without matplotlib, or where it cannot be written."""
    return style.write_figure(figure_of([told]), target)


def figure_of(comparisons: list[Comparison]) -> Figure:
    """Makes a row of panels a device: what is held as described under both sets of seeds, what is held on the other
    loops where there are any, and ripple and force of the element.

    Raises FigureError where matplotlib is missing.
    """
    rows = [len(told.loops[0].rows) for told in comparisons]
    heights = [count * _ROW_IN + _BESIDE_IN for count in rows]
    figure = style.empty_figure(_WIDTH_IN, sum(heights))
    has_others = any(told.loops[1:] for told in comparisons)
    widths = (1.25, 1.0, 0.8) if has_others else (1.5, 0.8)
    axes = figure.subplots(len(comparisons), len(widths), squeeze=False, width_ratios=widths, height_ratios=heights)
    for (left, *middle, right), told in zip(axes, comparisons, strict=True):
        _held(left, told, told.loops[0])
        for ax in middle:
            _loops(ax, told.loops[0], told.loops[1:])
        _costs(right, told.loops[0])
        for ax in (*middle, right):
            ax.set_yticklabels([])
    return figure


def _held(ax: Axes, told: Comparison, of: OfLoop) -> None:
    found, tied = best(of)
    for row, kept in enumerate(of.rows):
        colour = style.WALL if kept is found or kept in tied else _GREY
        _interval(ax, kept, row - 0.12, colour, "o", "seeds told" if kept is found else "_")
        if of.again:
            _interval(
                ax, of.again[row], row + 0.18, "#D55E00", "s", "other seeds" if kept is found else "_", small=True
            )
    alone = held(of.rows[0])
    ax.axvspan(max(0.0, alone.low) / 1e3, alone.high / 1e3, color=style.WALL_FILL, alpha=0.5, linewidth=0)
    delay = f", round trip {of.delay_s * 1e3:g} ms" if of.delay_s else ""
    _finish(ax, f"{told.name}{delay}", "held stiffness, N/mm", of)
    names = [
        f"{row.family}\n{family_of(row.family).words(row.values)}" if row.values else row.family for row in of.rows
    ]
    ax.set_yticks(range(len(names)), names, fontsize=6.5)
    if of.again:
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=1, fontsize=6.5, frameon=False, borderpad=0.0)
    seeds, cases = told.effort.seeds, told.effort.of_seed
    blue = f"blue: seed by seed not told from the best, {format_stiffness(held(found).value)}"
    ax.set_xlabel(f"held stiffness, N/mm (95 % over {seeds} seeds of {cases};\n{blue})", fontsize=style.SMALL)


def _loops(ax: Axes, first: OfLoop, others: tuple[OfLoop, ...]) -> None:
    for number, of in enumerate(others):
        for row, kept in enumerate(of.rows):
            place = row + 0.22 * (number - (len(others) - 1) / 2.0)
            _interval(ax, kept, place, style.element_colour(number + 1), "o", "_" if row else of.name, small=True)
    _finish(ax, "", "held stiffness, N/mm", first)
    if others:
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=1, fontsize=6.5, frameon=False, borderpad=0.0)


def _costs(ax: Axes, of: OfLoop) -> None:
    for row, kept in enumerate(of.rows):
        # What hides its wall changes the force by as much as that is stiff, which says nothing of what it costs.
        shown = [each.rendered for each in kept.seeds if each.rendered.held_N_m > _SHOWS * each.wall_N_m]
        if not shown:
            continue
        for place, (name, (_, marker)) in enumerate(_FORCES.items()):
            value = float(np.mean([getattr(each, name) for each in shown]))
            if value > 0.0:
                ax.plot([value], [row], marker, color=style.ELEMENTS[place], markersize=9 if marker == "|" else 5)
    for place, (label, marker) in enumerate(_FORCES.values()):
        ax.plot([], [], marker, color=style.ELEMENTS[place], label=label, markersize=5)
    _finish(ax, "", "force, N", of, zero=False)
    ax.set_xscale("log")
    style.plain_numbers(ax.xaxis)
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=1, fontsize=6.5, frameon=False, borderpad=0.0)


def _interval(ax: Axes, row: Row, place: float, colour: str, marker: str, label: str, small: bool = False) -> None:
    """Draws mean and interval in N/mm, and the seeds one by one below a large one."""
    inside = held(row)
    value, low, high = (max(0.0, end) / 1e3 for end in inside)
    ax.plot([low, high], [place, place], color=colour, linewidth=1.2 if small else 2.0)
    ax.plot([value], [place], marker, color=colour, markersize=3.0 if small else 5.0, label=label)
    if not small:
        seeds = [each.rendered.held_N_m / 1e3 for each in row.seeds]
        ax.plot(seeds, [place] * len(seeds), "|", color=colour, markersize=5.0, alpha=0.5)


def _finish(ax: Axes, title: str, x_label: str, of: OfLoop, zero: bool = True) -> None:
    style.dress(ax, title, x_label, "")
    ax.set_yticks(range(len(of.rows)))
    ax.set_ylim(len(of.rows) - 0.4, -0.6)
    if zero:
        ax.set_xlim(left=0.0)
