"""The figure of a run: does it rest, what moves it, and where its energy goes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from haploop.launch.plan.effects import notes
from haploop.protocol.amounts import amount
from haploop.tools.figure import style
from haploop.tools.figure.data import TOGETHER, Book, RunData
from haploop.tools.figure.event_words import event_words
from haploop.tools.figure.loops import draw_force_position, draw_momentum
from haploop.tools.figure.own_columns import draw_own_columns, own_columns
from haploop.tools.figure.time import energy_panel, force_panel, mark_events, position_panel
from haploop.tools.render.report import (
    HELD,
    count_losses,
    displayed_stiffness,
    leak_rows,
    limited,
    noted,
    plant_books,
    swing_words,
)
from haploop.tools.render.terminal import told
from haploop.tools.render.units import parameters, spring

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

# What has room in the table and below the figure; names of books that are longer are set smaller.
_MOST_BOOKS, _NAME_LETTERS, _MOST_LINES, _LINE_LETTERS = 5, 56, 2, 225

# Badge of a run that failed, and how its summary says so.
_FAILED = "failed"
_GAP = "   ·   "

# Books of the plant that belong to a force which is drawn.
_LINES = {"friction_heat_J": "friction", "actuator_J": "actuator"}


def draw(directory: Path, target: Path | None = None) -> Path:
    """Draws the figure of a run, or of the log of one that was killed, into a file, and returns its path.

    Args:
        directory: what ``haploop run`` made.
        target: file of the figure, in the format of its suffix; ``figure.png`` in the directory when None.

    Raises:
        FigureError: matplotlib is missing, there is nothing to draw, or the file cannot be written.
        LogError: the log is no log.
    """
    return style.write_figure(make_figure(RunData.from_directory(directory)), target or directory / "figure.png")


def make_figure(run: RunData) -> Figure:
    """Makes the figure of a run, with all panels; FigureError where matplotlib is missing."""
    rows = 3 + bool(own_columns(run))
    figure = style.empty_figure(15.0, 9.2 + 2.9 * (rows - 3))
    told_below = [failure(run), noted(notes(run.scene))]
    below = [line for words in told_below for line in style.wrapped(words, _LINE_LETTERS - 30)] + event_lines(run)
    heights = 0.085, 1.0, 0.001 + 0.025 * len(below)
    header, body, footer = figure.subfigures(3, 1, squeeze=False, height_ratios=heights)[:, 0]
    grid = body.add_gridspec(rows, 3, width_ratios=(1.9, 1.25, 1.15))
    close_s = run.close_s()
    position, force, energy = (body.add_subplot(grid[row, 0]) for row in range(3))
    position_panel(position, run, run.span_s, "Position")
    force_panel(force, run, run.span_s, "Force by part")
    # The books name every element; beyond the fourth they need no place in the legend.
    later = [span.name for span in run.history.elements[:3:-1]]
    for ax in (position, force):
        style.legend(ax, spare=(*run.plant_forces_N, *later, "total", "wall"))
        ax.axvspan(*close_s, color=style.CLOSE, alpha=0.5, zorder=0.5, linewidth=0)
    books = run.books()
    colours = style.OF_THE_PLANT | {"wall": style.WALL, TOGETHER: style.INK}
    colours |= {span.name: style.element_colour(number) for number, span in enumerate(run.history.elements)}
    energy_panel(energy, run, books, colours)
    mark_events([position, force, energy], run)
    for row, (panel, title) in enumerate(((position_panel, "Position"), (force_panel, "Force by part"))):
        ax = body.add_subplot(grid[row, 1])
        panel(ax, run, close_s, f"{title}, close view")
        style.few_ticks(ax)
    draw_force_position(body.add_subplot(grid[0, 2]), run, close_s)
    draw_momentum(body.add_subplot(grid[1, 2]), run, close_s)
    _draw_books(body.add_subplot(grid[2, 1:]), run, books, colours)
    draw_own_columns(body, grid, 3, run)
    _draw_header(header, run)
    footer.text(0.012, 0.5, "\n".join(below), fontsize=style.SMALL + 0.5, color=style.GREY, va="center", gid="events")
    body.align_ylabels()
    return figure


def _draw_header(figure: Figure | SubFigure, run: RunData) -> None:
    word = badge(run)
    sign = figure.text(
        0.012, 0.66, word, fontsize=style.LARGE, fontweight="bold", color="white", va="center", gid="verdict",
        bbox={"boxstyle": "round,pad=0.35", "facecolor": style.verdict_colour(run.summary), "linewidth": 0},
    )  # fmt: skip
    right = sign.get_window_extent().x1 / figure.bbox.width
    look: dict[str, Any] = {"color": style.INK, "va": "center"}
    title = figure.text(right + 0.018, 0.66, run.scene.title, fontsize=style.LARGE, gid="title", **look)
    style.fit_text(title, figure.bbox.width * (0.97 - right), smallest=1.0)
    words, room_px = key_numbers(run), figure.bbox.width * 0.985
    numbers = figure.text(0.006, 0.16, _GAP.join(words), fontsize=style.TEXT + 1, gid="numbers", **look)
    if numbers.get_window_extent().width > room_px:
        half = (len(words) + 1) // 2
        numbers.set_text(f"{_GAP.join(words[:half])}\n{_GAP.join(words[half:])}")
    style.fit_text(numbers, room_px)


def badge(run: RunData) -> str:
    """Returns the verdict of a run, or that it failed, or that it has no verdict."""
    return _FAILED if failure(run) else told(run.summary) if run.summary else "no verdict"


def failure(run: RunData) -> str:
    """Returns why the run failed, a sentence; "" where it did not."""
    return run.summary["why"] if run.summary and run.summary["ended"] == _FAILED else ""


def key_numbers(run: RunData) -> list[str]:
    """Returns oscillation, stiffness, contact and residual; where nothing was booked, how far the log goes."""
    first, last = run.span_s
    if not run.summary:
        return [f"{'log cut off' if run.cut else 'no summary'}: {last - first:g} s of {run.scene.duration:g} s"]
    if not run.summary["ticks"]:
        return [f"nothing came from the plant: {last - first:g} s as the controller measured and commanded it"]
    window, energy = run.summary["window"], run.summary["energy"]
    # The log of a run that failed may hold more than the window saw.
    from_s, to_s = window["from_s"], run.summary["duration_s"]
    is_end = last - to_s < 1.5 / run.control_rate
    when = f"in the last {last - from_s:.3g} s" if is_end else f"from {from_s:.3g} to {to_s:.3g} s"
    words = [f"{when}: oscillation {amount(window['oscillation_m'], 'm')}"]
    if (swing_N := window.get("force_swing_N")) is not None:
        words[0] += f", commanded force {amount(swing_N, 'N')} peak to peak"
    found = run.summary.get("stability", {})
    words[:0] = [", ".join(found["provisos"])] if found.get("provisos") else []
    if found.get("rate_1_s") is not None:
        words.append(f"held still and pushed, it swings {swing_words(found)}")
    wall = run.wall_table_at(float(run.ticks_s[-1]))
    if wall and run.summary["verdict"] != "no-contact":
        words.append(f"outside the wall {100 * window['outside_fraction']:.0f} %")
        displayed = displayed_stiffness(run.summary)
        wanted = f" of {spring(wall.stiffness)}" if wall.kind in (None, "spring") else ""
        words += (
            [f"displayed stiffness {spring(displayed)}{wanted}{limited(run.summary)}"] if displayed is not None else []
        )
    left = f"residual {amount(energy['residual_J'], 'J')} of " if "unmodelled_work_J" not in energy else ""
    words.append(f"{left}{amount(energy['moved_J'], 'J')} moved")
    words += [energy["balance"].partition(" of the energy")[0]] if "balance" in energy else []
    return words + [f"of a damaged log: {last - first:g} s"] * bool(run.cut)


def _draw_books(ax: Axes, run: RunData, books: list[Book], colours: dict[str, str]) -> None:
    rows = [Row("Books at the end", "true", "sampled", "at work (s)"), *book_rows(run, books)]
    height, size = 1.0 / max(len(rows), 12), style.TEXT * min(1.0, 13.0 / len(rows))
    ax.set_axis_off()
    ax.set(xlim=(0.0, 1.0), ylim=(1.0, 0.0))
    for number, row in enumerate(rows):
        y = (number + 0.5) * height
        if row.book:
            ax.plot([0.03, 0.06], [y, y], color=colours[row.book], linewidth=2.5, solid_capstyle="butt")
        colour, weight = style.INK if row.book or not number else style.GREY, "normal" if number else "bold"
        own = size * min(1.0, _NAME_LETTERS / max(1, len(row.name)))
        ax.text(0.075, y, row.name, ha="left", va="center", fontsize=own, color=colour, fontweight=weight)
        for x, text in ((0.56, row.at_work), (0.72, row.true), (0.88, row.sampled)):
            ax.text(x, y, text, ha="right", va="center", fontsize=size, color=colour, fontweight=weight)


class Row(NamedTuple):
    """A line of the table; ``book`` names the book or force whose colour it has, "" for none."""

    name: str
    true: str
    sampled: str = ""
    at_work: str = ""
    book: str = ""


def book_rows(run: RunData, books: list[Book]) -> list[Row]:
    """Returns the rows of the wall, its leak by cause and the elements, then the books of the plant and the counts."""
    spans = {span.name: span for span in run.history.elements}
    energy = run.summary.get("energy", {}) if run.energy else {}
    rows = []
    together = books[-1:] if len(books) > 1 else []
    shown = books[: len(books) - len(together)]
    for book in [*shown[:_MOST_BOOKS], *together]:
        name, at_work = book.name, ""
        if span := spans.get(book.name):
            told = parameters(span.element.as_dict(), run.units)
            name = f"{book.name} ({told})" if told else book.name
            end_s = min(span.to_tick / run.control_rate, run.span_s[1])
            at_work = f"{span.from_tick / run.control_rate:g}–{end_s:g}"
        true, sampled = (amount(value, "J") for value in book.ends_J)
        rows.append(Row(name, true, sampled, at_work, book.name))
        if book.name == "wall":
            leaks = leak_rows(energy.get("wall", {})).items()
            rows += [Row(f"    {words}", amount(value, "J")) for words, value in leaks if words != HELD or value]
    if len(shown) > _MOST_BOOKS:
        rows.append(Row(f"and {len(shown) - _MOST_BOOKS} more elements in summary.json", ""))
    for key, words in plant_books(energy).items():
        rows.append(Row(words, amount(energy[key], "J"), book=_LINES.get(key, "")))
    return rows + [Row(words, f"{count}") for words, count in count_losses(run.summary).items()]


def event_lines(run: RunData) -> list[str]:
    """Returns the numbered events as lines that fit below the figure."""
    lines = [""]
    for number, event in enumerate(event_words(run), start=1):
        words = f"{number} {event}"
        if lines[-1] and len(lines[-1]) + len(words) + 5 > _LINE_LETTERS:
            if len(lines) == _MOST_LINES:
                lines[-1] += f"     and {len(run.events) - number + 1} more"
                break
            lines.append("")
        lines[-1] += ("     " if lines[-1] else "") + words[:_LINE_LETTERS]
    return [line for line in lines if line]
