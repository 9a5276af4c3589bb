"""The page for builders, and the page with every claim and figure behind it, from the results of the figures."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from haploop.tools.render.terminal import markdown_table
from haploop.tools.studies.choi2022.figures import numbers
from haploop.tools.studies.choi2022.figures.claims import (
    ASSUMING,
    HOLDS,
    RARE,
    RARE_BELOW,
    VERDICTS,
    Finding,
    claims_of,
    texts_of,
)
from haploop.tools.studies.choi2022.figures.work import Kept

# The page that is read in five minutes, and the one with every claim and figure.
PAGE, CLAIMS_PAGE = "paper.md", "paper_claims.md"
# Figures on the first page: the ranges of the elements, and which of them wins.
_SHOWN = (10, 14)


def made(directory: Path) -> dict[int, Kept]:
    """Returns the figures that the directory holds, by number."""
    files = ((number, directory / f"figure_{number}.json") for number in numbers())
    return {number: json.loads(file.read_text(encoding="utf-8")) for number, file in files if file.exists()}


def write_pages(kept: Mapping[int, Kept], folder: Path, pictures: str = "") -> Path:
    """Writes both pages from the figures that were made, and returns the first.

    ``pictures`` is the path from the pages to the pictures, with a slash at the end.
    """
    (folder / CLAIMS_PAGE).write_text(claims_page(kept, pictures), encoding="utf-8")
    (folder / PAGE).write_text(page(kept, pictures), encoding="utf-8")
    return folder / PAGE


def page(kept: Mapping[int, Kept], pictures: str = "") -> str:
    """Returns the first page in Markdown: how many claims hold, what a builder can take from it, and how sure it is."""
    texts, rows = texts_of("page"), _rows(kept)
    count = Counter(finding.verdict for _, finding in rows)
    words = {verdict.split()[-1]: count[verdict] for verdict in VERDICTS}
    mathematics = [finding.verdict for _, finding in rows if finding.claim.place.startswith(("II", "IV"))]
    parts = ["# Choi et al. 2022 for builders of haptic devices", texts["intro"], *_trial(kept)]
    parts.append(texts["count"].format(claims=len(rows), rare_below=f"{100 * RARE_BELOW:g} %", **words))
    parts.append(
        texts["mathematics"].format(all=len(mathematics), so=sum(one in (HOLDS, ASSUMING) for one in mathematics))
    )
    for supports, heading in ((True, texts["holds"]), (False, texts["hangs"])):
        answers = [
            f"- {one['answer']} ([{number}]({CLAIMS_PAGE}#figure-{number}))"
            for number, one in sorted(kept.items())
            if one["answer"] and one["supports"] == supports
        ]
        # The last figures are closest to a device that is to be built.
        parts += [f"## {heading}", "\n".join(answers if supports else reversed(answers))] if answers else []
    parts += [f"## {texts['sure_title']}", texts["sure"], texts["fair"]]
    for number in _SHOWN:
        if number in kept:
            parts += [f"![{kept[number]['title']}]({pictures}figure_{number}.png)", texts[f"shown_{number}"]]
    return "\n\n".join(parts) + "\n"


def claims_page(kept: Mapping[int, Kept], pictures: str = "") -> str:
    """Returns the page behind the first: the finding of every claim, then all figures."""
    texts, rows = texts_of("page"), _rows(kept)
    parts = ["# The paper, claim by claim", texts["claims_intro"], *_trial(kept), "## Claims", *_tables(rows)]
    if missing := [f"{number} ({len(claims_of(number))} claims)" for number in numbers() if number not in kept]:
        parts.append(f"Not made here: figure {', '.join(missing)}.")
    parts.append("## Figures")
    for number, one in kept.items():
        parts += _figure(number, one, pictures)
    return "\n\n".join(parts) + "\n"


def _rows(kept: Mapping[int, Kept]) -> list[tuple[int, Finding]]:
    claims = {number: claims_of(number) for number in kept}
    return [(number, Finding.from_dict(one, claims[number])) for number in kept for one in kept[number]["findings"]]


def _trial(kept: Mapping[int, Kept]) -> list[str]:
    return [texts_of("page")["small"]] if any(one["small"] for one in kept.values()) else []


def _tables(rows: list[tuple[int, Finding]]) -> list[str]:
    """Returns the number of claims, and a table for each section of the paper, in its order; each ordered by figure.

    The section of a claim at ``V.B.2, Fig. 8`` is ``V.B``.
    """
    count = Counter(finding.verdict for _, finding in rows)
    parts = [f"{len(rows)} claims: {'; '.join(f'{verdict}: {count[verdict]}' for verdict in VERDICTS)}."]
    parts.append(texts_of("page")["interpretations"])
    cells: dict[str, list[list[str]]] = {section: [] for section in texts_of("page")["sections"]}
    for number, finding in rows:
        claim = f"“{finding.claim.quote}” ({finding.claim.place})"
        is_so = {ASSUMING: "**holds assuming**", RARE: "**rare**:"}.get(finding.verdict, f"**{finding.verdict}**")
        is_so = f"{is_so} {finding.assumption}".rstrip()
        section = ".".join(finding.claim.place.partition(",")[0].split(".")[:2])
        cells[section].append([claim, is_so, finding.numbers, f"[{number}](#figure-{number})"])
    for section, title in texts_of("page")["sections"].items():
        if cells[section]:
            table = markdown_table(["the paper says", "here", "numbers", "figure"], cells[section])
            parts += [f"### {section}. {title}", table]
    return parts


def _figure(number: int, one: Kept, pictures: str) -> list[str]:
    """Returns heading, pictures with what they show, notes, and the names of the files with data and scenes."""
    shown = [name for name in one["files"] if name.endswith(".png")]
    others = ", ".join(f"`{name}`" for name in one["files"] if name not in shown)
    parts = [f'<a id="figure-{number}"></a>', f"### Figure {number}: {one['title']}"]
    for name in shown:
        parts += [f"![{one['title']}]({pictures}{name})", one.get("seen", {}).get(name, "")]
    parts += [one["caption"], *one["notes"]]
    data = f"Data and scenes, beside the figure after `haploop paper --figure {number}`: {others}."
    return [part for part in [*parts, data] if part]
