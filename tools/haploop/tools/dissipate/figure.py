"""The figure of a recorded motion and the energy of every element on it (as Choi et al. 2022, Fig. 8)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.protocol.amounts import prefix_for
from haploop.tools.dissipate.outcome import Outcome
from haploop.tools.dissipate.recording.samples import Floats
from haploop.tools.dissipate.report import buzz_sentence, conclusion, make_row, note_sentences, rows, uneven
from haploop.tools.dissipate.sentences import MOST_SPANS, buzzing
from haploop.tools.figure import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

_COLUMNS = ("", "true", "sampled", "took", "gave back", "largest force")
_AT = (0.04, 0.46, 0.585, 0.71, 0.835, 1.0)
# Elements that are drawn, at most: one per colour.
_MOST = len(style.ELEMENTS)
# Letters of a line, at most.
_LINE_LETTERS = 170
# Heights of a line of the notes and of a line of the answer, and how many lines an answer has at most.
_LINE_IN, _ANSWER_IN, _MOST_ANSWER_LINES = 0.17, 0.22, 4
_CORNER: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (0.0, 1.0), "ncols": 1}


def make_figure(outcome: Outcome) -> Figure:
    """Draws motion and energies, whole and in detail, the table, and notes; FigureError where matplotlib is missing.

    Where neither an element nor a force was named there are no energies, and only the motion is drawn.
    """
    words, answer = _words(outcome), _answer(outcome)
    above_in, below_in = 0.4 + _ANSWER_IN * len(answer), _LINE_IN * len(words)
    body_in = 7.2 if outcome.elements or outcome.force else 3.6
    figure = style.empty_figure(13.0, above_in + body_in + below_in)
    parts = figure.subfigures(3, 1, squeeze=False, height_ratios=(above_in, body_in, below_in))[:, 0]
    header, body, below = parts
    if outcome.elements or outcome.force:
        _draw_energies(body, outcome)
    else:
        _motion(body.add_subplot(), outcome, outcome.trace.lines(), "Recorded motion", whole=True)
    look = {"fontsize": style.SMALL, "color": style.GREY}
    below.text(0.008, 1.0, "\n".join(words), va="top", gid="words", **look)
    title = {"fontsize": style.LARGE, "color": style.INK, "va": "center", "gid": "title"}
    header.text(0.008, 1.0 - 0.2 / above_in, outcome.recording.name, **title)
    told = {"fontsize": style.TEXT + 1, "color": style.INK, "va": "top", "linespacing": 1.4, "gid": "answer"}
    header.text(0.008, 1.0 - 0.42 / above_in, "\n".join(answer), **told)
    body.align_ylabels()
    return figure


def _draw_energies(body: SubFigure, outcome: Outcome) -> None:
    lines, close = outcome.trace.lines(), outcome.trace.close
    lines_of_table = 1 + min(len(rows(outcome)), _MOST)
    heights = (0.8, 1.6, max(0.14 * lines_of_table, 0.55))
    grid = body.add_gridspec(3, 2, width_ratios=(1.4, 1.0), height_ratios=heights)
    motion, energy = body.add_subplot(grid[0, 0]), body.add_subplot(grid[1, 0])
    _motion(motion, outcome, lines, "Recorded motion", whole=True)
    if outcome.elements:
        _energies(energy, outcome, lines, "Energy that would have been taken out of the device (fed to it below 0)")
        near = [body.add_subplot(grid[row, 1]) for row in range(2)]
    else:
        near = []
        _force(energy, outcome, lines)
        _force_energies(body.add_subplot(grid[:2, 1]), outcome, lines)
    if close is None and near:
        for ax in near:
            ax.set_axis_off()
        near[0].text(0.5, 0.5, "No element gave anything back.", ha="center", fontsize=style.TEXT, color=style.GREY)
    elif close is not None:
        _motion(near[0], outcome, close, "Where most was given back", whole=False)
        since = close.copy()
        since[2:] -= close[2:, :1]
        _energies(near[1], outcome, since, "Energy there, since its beginning")
        for ax in (motion, energy):
            ax.axvspan(close[0, 0], close[0, -1], color=style.CLOSE, alpha=0.5, zorder=0.5, linewidth=0, gid="close")
        for ax in near:
            style.few_ticks(ax)
    _table(body.add_subplot(grid[2, :]), outcome, lines_of_table)


def _motion(ax: Axes, outcome: Outcome, lines: Floats, title: str, whole: bool) -> None:
    """Draws position over time, with the wall as far as it is in view; if ``whole``, up to the wall and with buzzes."""
    factor, letter = prefix_for([float(np.abs(lines[1]).max())])
    t, x = lines[0], lines[1] / factor
    low, high = float(x.min()), float(x.max())
    wall = None if outcome.scene.event else outcome.scene.wall
    surface = wall.position / factor if wall else low
    if whole:
        low, high = min(low, surface), max(high, surface)
    margin = 0.06 * (high - low) or 1.0
    if wall:
        far = min(low - margin, surface) if wall.occupies == "below" else max(high + margin, surface)
        ax.axhspan(far, surface, color=style.WALL_FILL, zorder=0, linewidth=0, gid="wall")
        ax.axhline(surface, color=style.WALL, linewidth=1.0, zorder=1)
    ax.plot(t, x, color=style.INK, linewidth=1.0, gid="position")
    ax.set_ylim(low - margin, high + margin)
    if whole:
        _buzzes(ax, outcome)
    _common(ax, outcome, t)
    style.dress(ax, title, "time (s)", f"position ({letter}m)")


def _buzzes(ax: Axes, outcome: Outcome) -> None:
    """Draws a bar above each stretch in which the recording buzzes, with its frequencies."""
    look: dict[str, Any] = {
        "ha": "center",
        "va": "bottom",
        "fontsize": style.SMALL,
        "color": style.BUZZ,
        "gid": "hertz",
    }
    stretches = buzzing(outcome)
    for from_s, to_s, frequency in stretches:
        ax.axvspan(from_s, to_s, ymin=0.96, color=style.BUZZ, linewidth=0, gid="buzz")
        if len(stretches) <= MOST_SPANS:
            ax.text(0.5 * (from_s + to_s), 1.0, frequency, transform=ax.get_xaxis_transform(), **look)


def _energies(ax: Axes, outcome: Outcome, lines: Floats, title: str) -> None:
    """Draws the books of the elements: true ones as solid lines, sampled ones dashed where they differ."""
    count, agree, curves = len(outcome.elements), outcome.books_agree, []
    for index, element in enumerate(outcome.elements[:_MOST]):
        colour, name = style.element_colour(index), element.label
        look = {"color": colour, "linewidth": 1.5, "label": name, "gid": f"{name}.true"}
        dashed = {"color": colour, "linewidth": 1.0, "dashes": (4, 2), "gid": f"{name}.sampled"}
        curves += [(lines[2 + count + index], look), (lines[2 + index], dashed)][: 1 if agree else 2]
    if not agree:
        for label, dashes in (("true", "-"), ("sampled", (0, (4, 2)))):
            ax.plot([], [], color=style.GREY, linestyle=dashes, linewidth=1.3, label=label)
    if outcome.force:
        look = {"color": style.INK, "linewidth": 1.0, "label": "recorded force", "gid": "force.true"}
        curves.append((lines[-2], look))
    _curves(ax, outcome, lines[0], curves, title, "energy", "J")
    if not agree:
        style.legend(ax, only=("true", "sampled"), **_CORNER)


def _force(ax: Axes, outcome: Outcome, lines: Floats) -> None:
    curve = lines[-3], {"color": style.INK, "linewidth": 1.0, "gid": "force"}
    _curves(ax, outcome, lines[0], [curve], "Recorded force on the device", "force", "N")


def _force_energies(ax: Axes, outcome: Outcome, lines: Floats) -> None:
    """Draws the true book of the recorded force beside the sum F v T."""
    true = lines[-2], {"color": style.INK, "linewidth": 1.5, "label": "true", "gid": "force.true"}
    naive = lines[-1], {"color": style.GREY, "dashes": (4, 2), "label": "sum F v T", "gid": "force.naive"}
    title = "Energy that the force took out of the device (fed to it below 0)"
    _curves(ax, outcome, lines[0], [true, naive], title, "energy", "J")
    style.legend(ax, **_CORNER)


def _curves(
    ax: Axes, outcome: Outcome, t: Floats, curves: list[tuple[Floats, dict[str, Any]]], title: str, name: str, unit: str
) -> None:
    """Draws curves over time, each with its look, in a common unit with the prefix that suits them."""
    factor, letter = prefix_for([max(float(np.abs(values).max()) for values, _ in curves)])
    for values, look in curves:
        ax.plot(t, values / factor, **look)
    if unit == "J":
        ax.axhline(0.0, color=style.GREY, linewidth=0.8, zorder=0)
    _common(ax, outcome, t)
    style.dress(ax, title, "time (s)", f"{name} ({letter}{unit})")


def _common(ax: Axes, outcome: Outcome, t: Floats) -> None:
    for from_s, to_s in outcome.recording.notes.gaps_s:
        if from_s < t[-1] and to_s > t[0]:
            ax.axvspan(from_s, to_s, color=style.FAINT, alpha=0.45, zorder=0.4, linewidth=0, gid="gap")
    ax.set_xlim(float(t[0]), float(t[-1]))


def _table(ax: Axes, outcome: Outcome, lines: int) -> None:
    ax.set_axis_off()
    ax.set_xlim(0.0, 1.0)
    ax.set_ylim(max(lines, 4) + 0.2, -0.2)
    shown = rows(outcome)[: lines - 1]
    for number, cells in enumerate([_COLUMNS, *(make_row(element) for element in shown)]):
        y = number + 0.5
        if number:
            colour = style.element_colour(number - 1) if number <= len(outcome.elements) else style.INK
            ax.plot([0.0, 0.025], [y, y], color=colour, linewidth=2.5, solid_capstyle="butt")
        for x, cell, align in zip(_AT, cells, ("left", *["right"] * 5), strict=True):
            weight = "normal" if number else "bold"
            ax.text(x, y, cell, ha=align, va="center", fontsize=style.TEXT, color=style.INK, fontweight=weight)


def _words(outcome: Outcome) -> list[str]:
    """Returns the lines of the notes, as wide as the figure."""
    more = len(outcome.elements) - _MOST
    notes = ([f"Left out here: {more} more element{'s' * (more > 1)}."] if more > 0 else []) + note_sentences(outcome)
    return [line for sentence in notes for line in style.wrapped(sentence, _LINE_LETTERS)]


def _answer(outcome: Outcome) -> list[str]:
    """Returns the lines above the figure: whether the recording buzzes, and what the elements would have done."""
    first = [line for each in (*uneven(outcome), buzz_sentence(outcome)) for line in style.wrapped(each, _LINE_LETTERS)]
    if not (outcome.elements or outcome.force):
        return first
    sentence = conclusion(outcome)
    words = f"{sentence[:1].upper()}{sentence[1:]}"
    room = {"max_lines": _MOST_ANSWER_LINES - 1, "placeholder": " …"}
    return [*first, *style.wrapped(words, _LINE_LETTERS, **room)]
