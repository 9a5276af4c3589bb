"""docs/paper.md, written from the figures that ``haploop paper`` made: ``make paper``."""

from __future__ import annotations

import json
import shutil
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from haploop.tools.ending import WRONG_USE, leave
from haploop.tools.paper.claims import VERDICTS, Finding
from haploop.tools.paper.figures import figure, numbers

PAGE = "paper.md"
_INTRO = """\
What sections II to V of Choi et al. 2022 ("Virtual Inertia as an Energy Dissipation Element for Haptic Interfaces",
IEEE Robotics and Automation Letters) say, and what this program finds of it. Every number here was computed by
`haploop paper` and written by `make paper`; none was typed. A claim *holds*, *holds under a stated assumption*, or
*does not hold here*."""
_SMALL = "**Made with `--small`, with few runs: the numbers are those of a trial.**"
_SECTIONS = ("II", "III", "IV", "V.A", "V.B")


def write_page(directory: Path, target: Path | None = None, pictures: str = "") -> Path:
    """Write the page of the figures in a directory; returns its file.

    Args:
        directory: what ``haploop paper`` made, wholly or in part.
        target: the page; ``paper.md`` in the directory when None.
        pictures: where the pictures lie, seen from the page, with a slash at the end.
    """
    target = target or directory / PAGE
    target.write_text(page(made(directory), pictures), encoding="utf-8")
    return target


def made(directory: Path) -> dict[int, dict[str, Any]]:
    """What the directory holds, by the number of the figure."""
    files = ((number, directory / f"figure_{number}.json") for number in numbers())
    return {number: json.loads(file.read_text(encoding="utf-8")) for number, file in files if file.exists()}


def page(kept: dict[int, dict[str, Any]], pictures: str = "") -> str:
    """The page in Markdown: what came of the claims, then the figures."""
    rows = [(number, Finding.of(entry)) for number, one in kept.items() for entry in one["findings"]]
    rows.sort(key=lambda row: _section(row[1].claim.place))  # stable: within a section, by figure
    parts = ["# The paper, claim by claim", _INTRO]
    parts += [_SMALL] if any(one["small"] for one in kept.values()) else []
    parts += [_count(rows), "## Claims", _table(rows), *_missing(kept), "## Figures"]
    for number, one in kept.items():
        parts += _figure(number, one, pictures)
    return "\n\n".join(parts) + "\n"


def _section(place: str) -> int:
    section = place.partition(",")[0]
    return _SECTIONS.index(section) if section in _SECTIONS else len(_SECTIONS)


def _count(rows: list[tuple[int, Finding]]) -> str:
    count = Counter(finding.verdict for _, finding in rows)
    return f"{len(rows)} claims: {'; '.join(f'{verdict}: {count[verdict]}' for verdict in VERDICTS)}."


def _table(rows: list[tuple[int, Finding]]) -> str:
    lines = ["| where | what the paper says | here | numbers | our figure |", "|---|---|---|---|---|"]
    for number, finding in rows:
        verdict = f"**{finding.verdict}**" + (f": {finding.assumption}" if finding.assumption else "")
        cells = (
            finding.claim.place,
            f"“{finding.claim.quote}”",
            verdict,
            finding.numbers,
            f"[{number}](#figure-{number})",
        )
        lines.append(f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |")
    return "\n".join(lines)


def _missing(kept: dict[int, dict[str, Any]]) -> list[str]:
    """The figures that were not made, and how many claims they would test."""
    missing = [f"{number} ({len(figure(number).CLAIMS)} claims)" for number in numbers() if number not in kept]
    return [f"Not made here: figure {', '.join(missing)}."] if missing else []


def _figure(number: int, one: dict[str, Any], pictures: str) -> list[str]:
    """Heading, pictures, caption, notes, and which files hold data and scenes."""
    shown = [name for name in one["files"] if name.endswith(".png")]
    others = ", ".join(f"`{name}`" for name in one["files"] if name not in shown)
    return [
        f'<a id="figure-{number}"></a>',
        f"### Figure {number}: {one['title']}",
        *(f"![{one['title']}]({pictures}{name})" for name in shown),
        one["caption"],
        *one["notes"],
        f"Data and scenes, beside the figure after `haploop paper --figure {number}`: {others}.",
    ]


def main() -> None:
    """``python -m haploop.tools.paper.page DIRECTORY DOCS``: the page and its pictures into the documentation."""
    if len(sys.argv) != 3:
        leave("Two directories were expected: that of a haploop paper, and where the page goes.", WRONG_USE)
    directory, docs = map(Path, sys.argv[1:])
    kept = made(directory)
    if not kept:
        leave(f"There is no figure in {directory}; make them with haploop paper --out {directory}.", WRONG_USE)
    pictures = docs / "paper"
    pictures.mkdir(parents=True, exist_ok=True)
    for old in pictures.glob("*.png"):
        old.unlink()
    for one in kept.values():
        for name in one["files"]:
            if name.endswith(".png"):
                shutil.copyfile(directory / name, pictures / name)
    print(write_page(directory, docs / PAGE, "paper/"))


if __name__ == "__main__":
    main()
