"""The text of a run's figure: title, verdict and key numbers above, the table of books, the events below."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from haploop.logger.summary import Summary
from haploop.protocol.changes import describe
from haploop.tools.figure.data import Book, RunData
from haploop.tools.figure.style import GREY, INK, LARGE, SMALL, TEXT, VERDICTS, fit_text
from haploop.tools.render.report import LEAK_CAUSES, count_losses, plant_books
from haploop.tools.render.units import amount, parameters, spring

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

# What has room in the table and below the figure.
_MOST_BOOKS, _MOST_LINES, _LINE_LETTERS = 7, 2, 225

# Books of the plant that belong to a force which is drawn.
_LINES = {"friction_heat_J": "friction", "actuator_J": "actuator"}


def draw_header(figure: Figure | SubFigure, run: RunData) -> None:
    """Writes the verdict as a coloured sign, the title, and the key numbers."""
    word = run.summary.get("verdict", "no verdict")
    sign = figure.text(
        0.012, 0.66, word, fontsize=LARGE, fontweight="bold", color="white", va="center", gid="verdict",
        bbox={"boxstyle": "round,pad=0.35", "facecolor": VERDICTS.get(word, GREY), "linewidth": 0},
    )  # fmt: skip
    right = sign.get_window_extent().x1 / figure.bbox.width
    title = figure.text(right + 0.018, 0.66, run.scene.title, fontsize=LARGE, color=INK, va="center", gid="title")
    fit_text(title, figure.bbox.width * (0.97 - right), smallest=1.0)
    figure.text(0.006, 0.16, "   ·   ".join(key_numbers(run)), fontsize=TEXT + 1, color=INK, va="center", gid="numbers")


def key_numbers(run: RunData) -> list[str]:
    """Returns oscillation, stiffness, contact and residual; of a run without a summary, how far its log goes."""
    if not run.summary:
        first, last = run.span_s
        why = "log cut off" if run.cut else "no summary"
        return [f"{why}: {last - first:g} s of {run.scene.duration:g} s"]
    window, energy = run.summary["window"], run.summary["energy"]
    last_s = run.span_s[1] - window["from_s"]
    words = [f"in the last {last_s:.3g} s: oscillation {amount(window['oscillation_m'], 'm')}"]
    if run.history.walls and run.summary["verdict"] != "no-contact":
        words.append(f"outside the wall {100 * window['outside_fraction']:.0f} %")
        displayed, wanted = window["displayed_stiffness_N_m"], run.history.walls[-1].wall.stiffness
        words += [f"displayed stiffness {spring(displayed)} of {spring(wanted)}"] if displayed is not None else []
    words.append(f"residual {amount(energy['residual_J'], 'J')} of {amount(energy['moved_J'], 'J')} moved")
    return words


def draw_books(ax: Axes, run: RunData, books: list[Book], colours: dict[str, str]) -> None:
    """Draws the table of the books at the end, in the colours of their lines."""
    ax.set_axis_off()
    ax.set_xlim(0, 1)
    rows = book_rows(run, books)
    height = 1.0 / max(len(rows) + 1, 12)
    size = TEXT * min(1.0, 13.0 / (len(rows) + 1))
    ax.set_ylim(1.0, 0.0)
    _write(ax, height / 2, ("Books at the end", "at work (s)", "true", "sampled"), size, fontweight="bold", color=INK)
    for number, row in enumerate(rows, start=1):
        y = (number + 0.5) * height
        if row.book:
            ax.plot([0.03, 0.06], [y, y], color=colours[row.book], linewidth=2.5, solid_capstyle="butt")
        _write(ax, y, (row.name, row.at_work, row.true, row.sampled), size, color=INK if row.book else GREY)


def _write(ax: Axes, y: float, cells: tuple[str, ...], size: float, **look: Any) -> None:
    for x, text, align in zip((0.075, 0.56, 0.72, 0.88), cells, ("left", "right", "right", "right"), strict=True):
        ax.text(x, y, text, ha=align, va="center", fontsize=size, **look)


@dataclass(frozen=True)
class Row:
    """A line of the table; ``book`` names the book or force whose colour it has, "" for none."""

    name: str
    true: str
    sampled: str = ""
    at_work: str = ""
    book: str = ""


def book_rows(run: RunData, books: list[Book]) -> list[Row]:
    """Returns wall, its leak by cause, elements, then the books of the plant and the counts."""
    spans = {span.name: span for span in run.history.elements}
    energy = run.summary.get("energy", {})
    rows = []
    together = books[-1:] if len(books) > 1 else []
    shown = books[: len(books) - len(together)]
    for book in [*shown[:_MOST_BOOKS], *together]:
        name, at_work = book.name, ""
        if span := spans.get(book.name):
            name = f"{book.name} ({parameters(span.element.as_dict())})"
            end_s = min(span.to_tick / run.control_rate, run.span_s[1])
            at_work = f"{span.from_tick / run.control_rate:g}–{end_s:g}"
        true, sampled = (amount(value, "J") for value in book.ends_J)
        rows.append(Row(name, true, sampled, at_work, book.name))
        if book.name == "wall":
            rows += _leak_rows(energy.get("wall", {}))
    if len(shown) > _MOST_BOOKS:
        rows.append(Row(f"and {len(shown) - _MOST_BOOKS} more elements in summary.json", ""))
    for key, words in plant_books(energy).items():
        rows.append(Row(words, amount(energy[key], "J"), book=_LINES.get(key, "")))
    return rows + [Row(words, f"{count}") for words, count in count_losses(run.summary).items()]


def _leak_rows(wall: Summary) -> list[Row]:
    if "leak" not in wall:
        return []
    rows = [Row(f"    leak by {words}", amount(wall["leak"][key], "J")) for key, words in LEAK_CAUSES.items()]
    ideal = wall["ideal_J"] or 0.0
    held = abs(ideal) > 1e-9 * abs(wall["true_J"] or 0.0)
    return rows + ([Row("    held by an ideal spring", amount(ideal, "J"))] if held else [])


def event_lines(run: RunData) -> list[str]:
    """Returns the numbered events as lines that fit below the figure."""
    lines = [""]
    for number, event in enumerate(run.events, start=1):
        words = f"{number} at {event['timestamp']:g} s: {describe(event)}"
        if lines[-1] and len(lines[-1]) + len(words) + 5 > _LINE_LETTERS:
            if len(lines) == _MOST_LINES:
                lines[-1] += f"     and {len(run.events) - number + 1} more"
                break
            lines.append("")
        lines[-1] += ("     " if lines[-1] else "") + words[:_LINE_LETTERS]
    return [line for line in lines if line]


def draw_events(figure: Figure | SubFigure, lines: list[str]) -> None:
    """Writes the events below the panels."""
    figure.text(0.012, 0.5, "\n".join(lines), fontsize=SMALL + 0.5, color=GREY, va="center", gid="events")
