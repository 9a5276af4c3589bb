"""The picture of the demo: the motion through the swap, and the wall's force against penetration on either side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.tools.demo.story import Part, Story
from haploop.tools.figure import style
from haploop.tools.figure.loops import force_position_loop
from haploop.tools.figure.time import MM, energy_panel, force_panel, mark_events, position_panel

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# How much of either side is drawn as loops of force against penetration, s.
_LOOPS_S = 0.1
# Width of the figure and height of its charts, in; letters in a line above them, and the sizes of title and lines.
_WIDE_IN, _CHARTS_IN = 12.0, 6.9
_LETTERS, _TITLE_IN, _LINE_IN, _MARGIN_IN = 150, 0.42, 0.2, 0.08
_PENETRATION = "penetration (mm); the area is energy given away"


def draw(story: Story, target: Path) -> Path:
    """Draws the story into a file, in the format of its suffix; FigureError where that cannot be done."""
    return style.write_figure(make_figure(story), target)


def make_figure(story: Story) -> Figure:
    """Makes the picture: position, force and energy over time, and two loops; FigureError without matplotlib."""
    data = story.data
    words = [line for sentence in (story.why(), story.outcome()) for line in style.wrapped(sentence, _LETTERS)]
    header_in = _TITLE_IN + len(words) * _LINE_IN + 2.0 * _MARGIN_IN
    figure = style.empty_figure(_WIDE_IN, header_in + _CHARTS_IN)
    header, body = figure.subfigures(2, 1, squeeze=False, height_ratios=(header_in, _CHARTS_IN))[:, 0]
    _draw_header(header, story.data.scene.title, words, header_in)
    grid = body.add_gridspec(6, 2, width_ratios=(1.8, 1.0))
    position, force, energy = (body.add_subplot(grid[row : row + 2, 0]) for row in (0, 2, 4))
    position_panel(position, data, data.span_s, "Position")
    force_panel(force, data, data.span_s, "Force by part")
    colours = {"wall": style.WALL} | {
        span.name: style.element_colour(number) for number, span in enumerate(data.history.elements)
    }
    energy_panel(energy, data, [book for book in data.books() if book.name in colours], colours)
    style.legend(position)
    style.legend(force)
    mark_events([position, force, energy], data)
    _name_parts(position, story)
    sides = (story.before, story.at_s, "before"), (story.after, data.span_s[1], "after")
    for place, (part, end_s, name) in enumerate(sides):
        _draw_loop(body.add_subplot(grid[3 * place : 3 * place + 3, 1]), story, part, end_s, name)
    body.align_ylabels()
    return figure


def _draw_header(header: Any, title: str, words: Sequence[str], high_in: float) -> None:
    look = {"color": style.INK, "va": "top"}
    top, below = 1.0 - _MARGIN_IN / high_in, 1.0 - (_MARGIN_IN + _TITLE_IN) / high_in
    header.text(0.01, top, title, fontsize=style.LARGE - 1, fontweight="bold", gid="title", **look)
    header.text(0.01, below, "\n".join(words), fontsize=style.TEXT + 1.5, linespacing=1.35, gid="words", **look)


def _name_parts(ax: Axes, story: Story) -> None:
    """Writes either verdict over its side of the swap."""
    first, last = story.data.span_s
    share = (story.at_s - first) / (last - first)
    for part, x in ((story.before, 0.5 * share), (story.after, 0.5 + 0.5 * share)):
        colour = style.verdict_colour(part.summary)
        box = {"boxstyle": "round,pad=0.3", "facecolor": colour, "linewidth": 0}
        look = {"color": "white", "fontweight": "bold", "fontsize": style.TEXT + 1, "ha": "center", "va": "top"}
        ax.text(x, 0.95, part.verdict, transform=ax.transAxes, bbox=box, gid="verdict", **look)


def _draw_loop(ax: Axes, story: Story, part: Part, end_s: float, name: str) -> None:
    """Draws the force out of the wall against penetration in the last tenth of a second of a side, and the spring."""
    depth, force = force_position_loop(story.data, (end_s - _LOOPS_S, end_s))
    stiffness = story.data.wall_at(np.array([end_s - _LOOPS_S]))[1][0]
    title = f"Last {_LOOPS_S * 1e3:.0f} ms {name}: {', '.join(_said(part))}"
    style.dress(ax, title, _PENETRATION if part.frequency_Hz else "penetration (mm)", "force out of the wall (N)")
    spring = np.array([0.0, depth.max(initial=0.0)])
    ax.plot(spring * MM, stiffness * spring, color=style.INK, linewidth=1.0, dashes=(4, 2), label="ideal spring")
    ax.plot(depth * MM, force, color=style.verdict_colour(part.summary), linewidth=1.3, label="held force")
    if np.ptp(depth) * MM < 1e-3 and len(depth):
        ax.plot(depth[-1:] * MM, force[-1:], "o", color=style.verdict_colour(part.summary), markersize=7)
    style.corner_legend(ax)


def _said(part: Part) -> list[str]:
    """Returns swing and frequency in short."""
    rows = dict(part.rows())
    return [rows["position swings by"], *([rows["at"]] if part.frequency_Hz else [])]
