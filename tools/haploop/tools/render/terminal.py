"""The terminal: a console, the colours of verdicts, and tables of uniform look; tables in Markdown."""

from __future__ import annotations

import io
from collections.abc import Collection, Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.table import Table
    from rich.text import Text

    from haploop.logger.summary import Summary

VERDICT_STYLES = {
    "steady": "bold green",
    "limit-cycle": "bold yellow",
    "growing": "bold red",
    "diverged": "bold red",
    "no-contact": "bold",
    "undecided": "bold",
}
_WIDTH_OF_A_PIPE = 100


def console(stderr: bool = False) -> Console:
    """Makes the console of a terminal, or of a pipe: then without colours, and 100 columns wide."""
    from rich.console import Console

    made = Console(stderr=stderr, highlight=False)
    if not made.is_terminal:
        made.width = _WIDTH_OF_A_PIPE
    return made


def as_text(shown: RenderableType) -> str:
    """Returns what a terminal would show, without colours and as wide as in a pipe."""
    from rich.console import Console

    written = io.StringIO()
    Console(file=written, width=_WIDTH_OF_A_PIPE, highlight=False, color_system=None).print(shown)
    return written.getvalue().rstrip()


def seen(verdict: str) -> str:
    """Returns the word for what the last half second shows, also for a verdict in a file of an earlier version."""
    from haploop.logger.verdict.measures import OF_WINDOW

    word = OF_WINDOW.get(verdict, verdict)
    return word.replace("-", " ") if word in OF_WINDOW.values() else word


def told(summary: Summary) -> str:
    """Returns the verdict of a run, or the word for what was seen of one that was not judged."""
    from haploop.logger.verdict.measures import WINDOW_S

    if "stability" in summary:
        return summary["verdict"]
    word = seen(summary["verdict"])
    return "too short to see" if word == "no swing seen" and summary["duration_s"] < WINDOW_S else word


def verdict_style(verdict: str) -> str:
    """Returns the style of a verdict; bold for one that has no colour."""
    return VERDICT_STYLES.get(verdict, "bold")


def make_table(
    *heads: str,
    numbers: Collection[str] = (),
    unbroken: Collection[str] = (),
    padding: tuple[int, int, int, int] = (0, 1, 0, 1),
    least_width: int | None = None,
    first_width: int | None = None,
) -> Table:
    """Makes a table with a line below its heads and no other.

    Cells below ``numbers`` are right-aligned and, like those below ``unbroken``, stay on one line. ``least_width`` is
    of the columns of numbers, ``first_width`` of the first one, in letters; ``padding`` is top, right, bottom, left.
    """
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=padding)
    for place, head in enumerate(heads):
        if head in numbers:
            table.add_column(Text(head), justify="right", no_wrap=True, min_width=least_width)
        else:
            width = None if place else first_width
            table.add_column(Text(head), no_wrap=head in unbroken, overflow="fold", min_width=width)
    return table


def make_facts(rows: Iterable[tuple[str, str | Text]], least_width: int | None = None) -> Table:
    """Makes a grid of names, at least ``least_width`` letters wide, and values, without lines or heads."""
    from rich.table import Table

    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="dim", no_wrap=True, min_width=least_width)
    grid.add_column()
    for row in rows:
        grid.add_row(*row)
    return grid


def markdown_table(heads: Sequence[str], rows: Iterable[Sequence[str]], numbers: Collection[int] = ()) -> str:
    """Returns a table in Markdown; ``numbers`` are the places of the right-aligned columns. Bars are escaped."""
    rule = ["---:" if place in numbers else "---" for place in range(len(heads))]
    lines = [[cell.replace("\\|", "|").replace("|", "\\|") for cell in line] for line in (heads, rule, *rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
