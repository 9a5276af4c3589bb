"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence


def markdown_table(heads: Sequence[str], rows: Iterable[Sequence[str]], numbers: Collection[int] = ()) -> str:
    """Returns a table.

    Args:
        heads: of the columns.
        rows: cells in the order of the heads; a bar in a cell is escaped.
        numbers: places of the columns that are set to the right, counted from 0.
    """
    rule = ["---:" if place in numbers else "---" for place in range(len(heads))]
    return "\n".join(f"| {' | '.join(_escaped(cell) for cell in line)} |" for line in (heads, rule, *rows))


def _escaped(cell: str) -> str:
    return cell.replace("\\|", "|").replace("|", "\\|")
