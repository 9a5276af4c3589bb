"""The figure of several runs over one another: position, force and energy, with the differences of their scenes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.launch.plan.effects import notes
from haploop.protocol.amounts import amount, prefix_for
from haploop.tools.figure import style
from haploop.tools.figure.data import Book, FigureError, RunData
from haploop.tools.figure.run_figure import badge, failure, key_numbers
from haploop.tools.figure.run_labels import labels
from haploop.tools.figure.run_names import run_names, shortened
from haploop.tools.figure.time import MM, line
from haploop.tools.render.report import noted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

MOST_RUNS = 6
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#332288")
# Where lines are equal, the one below is seen beside the one above.
_WIDTHS = (2.8, 2.1, 1.6, 1.2, 0.9, 0.6)
# Longer names of files are cut.
_LONGEST_NAME = 150
# Letters in, and height of, a line of the notes below the figure.
_LINE_LETTERS, _LINE_INCHES = 195, 0.2


def draw_overlay(directories: Sequence[Path], target: Path | None = None) -> Path:
    """Draws several runs over one another into a file, and returns that.

    Args:
        directories: of runs, two to ``MOST_RUNS``; for a run that was killed, what its log holds is drawn.
        target: file of the figure; in the first directory when None, named after the others.

    Raises:
        FigureError: matplotlib is missing, there is nothing to draw, there are too many, or the file cannot be written.
        LogError, SceneError: a directory's files cannot be read.
    """
    if len(directories) > MOST_RUNS:
        raise FigureError(
            f"At most {MOST_RUNS} runs can be told apart in one figure, but {len(directories)} were given; draw fewer."
        )
    runs = [RunData.from_directory(directory) for directory in directories]
    others = "_".join(directory.resolve().name for directory in directories[1:])
    figure = make_overlay(runs, shortened(run_names(directories)))
    return style.write_figure(figure, target or directories[0] / f"with_{others[:_LONGEST_NAME]}.png")


def make_overlay(runs: Sequence[RunData], names: Sequence[str]) -> Figure:
    """Makes the figure of several runs and their names; FigureError where matplotlib is missing."""
    below = _notes_below(runs, names)
    figure = style.empty_figure(15.0, 9.0 + 0.25 * len(runs) + _LINE_INCHES * len(below))
    told = labels(runs, names)
    rows = len(runs) + (is_titled := len({run.scene.title for run in runs}) == 1)
    heights = 0.02 + 0.025 * rows, 1.0, 0.001 + 0.022 * len(below)
    header, body, footer = figure.subfigures(3, 1, squeeze=False, height_ratios=heights)[:, 0]
    span_s = min(run.span_s[0] for run in runs), max(run.span_s[1] for run in runs)
    ends_s = min(run.span_s[1] for run in runs)  # where all have something to show
    close_s = max(run.close_s() for run in runs if run.span_s[1] - ends_s < 1.5 / run.control_rate)
    grid = body.add_gridspec(3, 2, width_ratios=(1.9, 1.25))
    for column, (seen_s, more) in enumerate(((span_s, ""), (close_s, ", close view"))):
        _positions(body.add_subplot(grid[0, column]), runs, seen_s, f"Position{more}")
        _forces(body.add_subplot(grid[1, column]), runs, seen_s, f"Force of the controller{more}")
    _energies(body.add_subplot(grid[2, :]), runs, span_s)
    body.align_ylabels()
    if is_titled:
        y, look = 1.0 - 0.5 / rows, {"va": "center", "fontsize": style.TEXT + 1, "color": style.INK}
        title = header.text(0.008, y, runs[0].scene.title, fontweight="bold", gid="title", **look)
        style.fit_text(title, header.bbox.width * 0.98)
    for place, (label, run) in enumerate(zip(told, runs, strict=True)):
        y = 1.0 - (place + is_titled + 0.5) / rows
        _head(header, run, label, y, _COLOURS[place])
    for place, (words, colours) in enumerate(below):
        _note(footer, words, colours, 1.0 - (place + 0.5) / len(below))
    return figure


def _notes_below(runs: Sequence[RunData], names: Sequence[str]) -> list[tuple[str, list[str]]]:
    """Returns the lines on why runs failed and what may be unintended in their scenes, with the colours of the runs.

    What applies to several runs is said once.
    """
    told: dict[str, list[int]] = {}
    for place, run in enumerate(runs):
        for words in filter(None, (failure(run), noted(notes(run.scene)))):
            told.setdefault(words, []).append(place)
    lines: list[tuple[str, list[str]]] = []
    for words, places in told.items():
        whose = "all runs" if len(places) == len(runs) else ", ".join(names[place] for place in places)
        first, *more = style.wrapped(f"{whose}: {words}", _LINE_LETTERS)
        lines += [(first, [_COLOURS[place] for place in places]), *((each, []) for each in more)]
    return lines


def _note(footer: Figure | SubFigure, words: str, colours: Sequence[str], y: float) -> None:
    """Writes a line below the panels, with a stroke in the colour of each run that it is about."""
    from matplotlib.lines import Line2D

    width = 0.02 / max(1, len(colours))
    for place, colour in enumerate(colours):
        ends = [0.008 + place * width, 0.008 + (place + 0.8) * width]
        footer.add_artist(Line2D(ends, [y, y], color=colour, linewidth=3.0))
    footer.text(0.034, y, words, fontsize=style.SMALL + 0.5, color=style.INK, va="center", gid="note")


def _head(header: Figure | SubFigure, run: RunData, label: str, y: float, colour: str) -> None:
    """Writes a run's line of the legend: colour, verdict, name, what differs, numbers."""
    from matplotlib.lines import Line2D

    header.add_artist(Line2D([0.008, 0.028], [y, y], color=colour, linewidth=3.0, gid="run"))
    look: dict[str, Any] = {"va": "center", "fontsize": style.TEXT + 1}
    header.text(0.034, y, badge(run), color=style.verdict_colour(run.summary), fontweight="bold", gid="verdict", **look)
    name = header.text(0.115, y, label, color=style.INK, gid="label", **look)
    style.fit_text(name, header.bbox.width * 0.56)
    numbers = header.text(0.69, y, _numbers(run), color=style.GREY, gid="numbers", **look)
    style.fit_text(numbers, header.bbox.width * 0.3, smallest=0.6)


def _numbers(run: RunData) -> str:
    if not run.summary or not run.summary["ticks"]:
        return key_numbers(run)[0]
    found = run.summary.get("stability", {})
    measured = f"position{run.as_measured}" if run.as_measured else ""
    swing = f"oscillation {amount(run.summary['window']['oscillation_m'], 'm')} at its end"
    pushed = f"pushed, {amount(found['frequency_Hz'], 'Hz')}" if found.get("frequency_Hz") else ""
    return "; ".join(filter(None, [", ".join(found.get("provisos", ())), swing, pushed, measured]))


def _positions(ax: Axes, runs: Sequence[RunData], span_s: tuple[float, float], title: str) -> None:
    for run, colour, width in zip(runs, _COLOURS, _WIDTHS, strict=False):
        inside = (run.t_s >= span_s[0]) & (run.t_s <= span_s[1])
        if inside.any():
            line(ax, run.t_s[inside], run.x_m[inside] * MM, "_", colour, linewidth=width, gid="position")
        if run.history.walls:
            edges = np.array(span_s)
            look: dict[str, Any] = {"linewidth": 0.8, "linestyle": (0, (4, 2)), "zorder": 1, "gid": "wall"}
            ax.plot(edges, run.wall_at(edges)[0] * MM, color=colour, **look)
    _dress(ax, title, "position (mm), walls dashed", span_s)


def _forces(ax: Axes, runs: Sequence[RunData], span_s: tuple[float, float], title: str) -> None:
    for run, colour, width in zip(runs, _COLOURS, _WIDTHS, strict=False):
        inside = (run.ticks_s >= span_s[0]) & (run.ticks_s <= span_s[1])
        if inside.any():
            total = run.controller["total"][inside]
            line(ax, run.ticks_s[inside], total, "_", colour, held=True, linewidth=width, gid="force")
    _dress(ax, title, "force on the device (N)", span_s)


def _energies(ax: Axes, runs: Sequence[RunData], span_s: tuple[float, float]) -> None:
    """Draws the sum of the true books of wall and elements, which is the energy that the controller has taken out."""
    taken: list[Book | None] = [next(iter(run.books()[-1:]), None) for run in runs]
    ends = [np.abs(book.true_J[np.isfinite(book.true_J)]).max(initial=0.0) for book in taken if book]
    factor, letter = prefix_for(ends)
    for book, colour, width in zip(taken, _COLOURS, _WIDTHS, strict=False):
        if book:
            line(ax, book.t_s, book.true_J / factor, "_", colour, linewidth=width, gid="energy")
    ax.axhline(0.0, color=style.GREY, linewidth=0.8, zorder=0)
    title = "Energy that wall and elements take out of the device (given to it below 0)"
    _dress(ax, title, f"energy ({letter}J)", span_s)


def _dress(ax: Axes, title: str, y_label: str, span_s: tuple[float, float]) -> None:
    style.dress(ax, title, "time (s)", y_label)
    ax.set_xlim(*span_s)
