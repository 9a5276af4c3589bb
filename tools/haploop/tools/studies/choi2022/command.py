"""``haploop paper``: makes the figures of the paper and its two pages; ``make paper``: those in docs/."""

from __future__ import annotations

import json
import shutil
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from haploop.tools.cli.options import WRONG_USE, leave, plain_errors
from haploop.tools.figure.data import FigureError
from haploop.tools.render.progress import Stage, bars, silent
from haploop.tools.render.terminal import markdown_table
from haploop.tools.studies.choi2022.claims import (
    ASSUMING,
    HOLDS,
    RARE,
    RARE_BELOW,
    VERDICTS,
    Finding,
    claims_of,
    texts_of,
    words_of,
)
from haploop.tools.studies.choi2022.figures import figure, numbers
from haploop.tools.studies.choi2022.work import Kept, Work

# The page that is read in five minutes, and that with every claim and figure.
PAGE, CLAIMS_PAGE = "paper.md", "paper_claims.md"
# What the first page shows: the ranges of the elements, and which of them wins.
_SHOWN = (10, 14)


def paper(wanted: Sequence[int], out: Path, small: bool, workers: int | None) -> None:
    """Makes some figures, all when none is named, and writes the pages of what the directory then holds."""
    there = numbers()
    for number in wanted:
        if number not in there:
            leave(f"There is no figure {number} to make; there are {', '.join(map(str, there))}.", WRONG_USE)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        leave(f"The directory {out} cannot be used: {error.strerror}.", WRONG_USE)
    with plain_errors(), bars() as stage:
        for number in wanted or there:
            try:
                make_figure(number, out, small=small, workers=workers, stage=stage)
            except FigureError as error:
                leave(str(error), WRONG_USE)
    write_pages(made(out), out)


def write_pages(kept: Mapping[int, Kept], folder: Path, pictures: str = "") -> None:
    """Writes both pages of what was made, and prints where the first is.

    ``pictures`` is where the pictures lie, seen from the pages, with a slash at the end.
    """
    (folder / CLAIMS_PAGE).write_text(claims_page(kept, pictures), encoding="utf-8")
    (folder / PAGE).write_text(page(kept, pictures), encoding="utf-8")
    print(folder / PAGE)


def make_figure(
    number: int, out: Path, *, small: bool = False, workers: int | None = None, stage: Stage = silent
) -> None:
    """Makes one figure: picture, data, scenes and findings go into ``out``.

    Raises FigureError where matplotlib is missing, or a picture cannot be written.
    """
    module, work = figure(number), Work(out, number, small=small, workers=workers, stage=stage)
    work.keep(module.make(work))


def made(directory: Path) -> dict[int, Kept]:
    """Returns what the directory holds, by the number of the figure."""
    files = ((number, directory / f"figure_{number}.json") for number in numbers())
    return {number: json.loads(file.read_text(encoding="utf-8")) for number, file in files if file.exists()}


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
        # The last figures are nearest to a device that is to be built.
        parts += [f"## {heading}", "\n".join(answers if supports else reversed(answers))] if answers else []
    parts += [f"## {texts['sure_title']}", texts["sure"], texts["fair"]]
    for number in _SHOWN:
        if number in kept:
            parts += [f"![{kept[number]['title']}]({pictures}figure_{number}.png)", texts[f"shown_{number}"]]
    return "\n\n".join(parts) + "\n"


def claims_page(kept: Mapping[int, Kept], pictures: str = "") -> str:
    """Returns the page behind it: the finding of every claim, then all figures."""
    texts, rows = texts_of("page"), _rows(kept)
    parts = ["# The paper, claim by claim", texts["claims_intro"], *_trial(kept), "## Claims", *_tables(rows)]
    if missing := [f"{number} ({len(figure(number).CLAIMS)} claims)" for number in numbers() if number not in kept]:
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
    """Returns how many claims there are, and a table for each section of the paper, in its order; within it by figure.

    The section of a claim at ``V.B.2, Fig. 8`` is ``V.B``.
    """
    count = Counter(finding.verdict for _, finding in rows)
    parts = [f"{len(rows)} claims: {'; '.join(f'{verdict}: {count[verdict]}' for verdict in VERDICTS)}."]
    parts.append(texts_of("page")["interpretations"])
    cells: dict[str, list[list[str]]] = {section: [] for section in words_of("page", "sections")}
    for number, finding in rows:
        claim = f"“{finding.claim.quote}” ({finding.claim.place})"
        is_so = {ASSUMING: "**holds assuming**", RARE: "**rare**:"}.get(finding.verdict, f"**{finding.verdict}**")
        is_so = f"{is_so} {finding.assumption}".rstrip()
        section = ".".join(finding.claim.place.partition(",")[0].split(".")[:2])
        cells[section].append([claim, is_so, finding.numbers, f"[{number}](#figure-{number})"])
    for section, title in words_of("page", "sections").items():
        if cells[section]:
            table = markdown_table(["the paper says", "here", "numbers", "figure"], cells[section])
            parts += [f"### {section}. {title}", table]
    return parts


def _figure(number: int, one: Kept, pictures: str) -> list[str]:
    """Returns heading, pictures with what is seen on them, notes, and which files hold data and scenes."""
    shown = [name for name in one["files"] if name.endswith(".png")]
    others = ", ".join(f"`{name}`" for name in one["files"] if name not in shown)
    parts = [f'<a id="figure-{number}"></a>', f"### Figure {number}: {one['title']}"]
    for name in shown:
        parts += [f"![{one['title']}]({pictures}{name})", one.get("seen", {}).get(name, "")]
    parts += [one["caption"], *one["notes"]]
    data = f"Data and scenes, beside the figure after `haploop paper --figure {number}`: {others}."
    return [part for part in [*parts, data] if part]


def main() -> None:
    """``python -m haploop.tools.studies.choi2022.command RUN DOCS``: takes a run into the documentation.

    Pictures and findings are copied to DOCS/paper, and the pages are written. With DOCS/paper itself for RUN only the
    pages are written anew, from its findings and the words in ``figures.toml``: in a second.
    """
    if len(sys.argv) != 3:
        leave("Two directories were expected: that of a haploop paper, and where the page goes.", WRONG_USE)
    directory, docs = map(Path, sys.argv[1:])
    kept = made(directory)
    if not kept:
        leave(f"There is no figure in {directory}; make them with haploop paper --out {directory}.", WRONG_USE)
    pictures = docs / "paper"
    if directory.resolve() != pictures.resolve():
        for name in _taken(made(pictures)):
            (pictures / Path(name).name).unlink(missing_ok=True)
        pictures.mkdir(parents=True, exist_ok=True)
        for name in _taken(kept):
            shutil.copyfile(directory / name, pictures / name)
    write_pages(kept, docs, "paper/")


def _taken(kept: Mapping[int, Kept]) -> list[str]:
    """Returns the files of a run that the documentation takes: findings and pictures."""
    shown = [name for one in kept.values() for name in one["files"] if name.endswith(".png")]
    return [*(f"figure_{number}.json" for number in kept), *shown]


if __name__ == "__main__":
    main()
