"""``haploop paper``: makes the figures of the paper and the page of its claims; ``make paper``: docs/paper.md."""

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
from haploop.tools.studies.choi2022.claims import ASSUMING, VERDICTS, Finding, claims_of, texts_of, words_of
from haploop.tools.studies.choi2022.figures import figure, numbers
from haploop.tools.studies.choi2022.work import Kept, Work

PAGE = "paper.md"


def paper(wanted: Sequence[int], out: Path, small: bool, workers: int | None) -> None:
    """Makes some figures, all when none is named, and writes the page of what the directory then holds."""
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
    (out / PAGE).write_text(page(made(out)), encoding="utf-8")
    print(out / PAGE)


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
    """Returns the page in Markdown: answers, the finding of every claim, then the figures.

    ``pictures`` is where they lie, seen from the page, with a slash at the end.
    """
    claims = {number: claims_of(number) for number in kept}
    rows = [(number, Finding.from_dict(one, claims[number])) for number in kept for one in kept[number]["findings"]]
    texts = texts_of("page")
    parts = ["# The paper, claim by claim", texts["intro"]]
    parts += [texts["small"]] if any(one["small"] for one in kept.values()) else []
    # The last figures are nearest to a device that is to be built.
    answers = [f"- {one['answer']} ([{number}](#figure-{number}))" for number, one in kept.items() if one.get("answer")]
    parts += ["## What a builder can take from it", "\n".join(reversed(answers))] if answers else []
    parts += ["## Claims", *_tables(rows)]
    if missing := [f"{number} ({len(figure(number).CLAIMS)} claims)" for number in numbers() if number not in kept]:
        parts.append(f"Not made here: figure {', '.join(missing)}.")
    parts.append("## Figures")
    for number, one in kept.items():
        parts += _figure(number, one, pictures)
    return "\n\n".join(parts) + "\n"


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
        is_so = f"**holds assuming** {finding.assumption}" if finding.verdict == ASSUMING else f"**{finding.verdict}**"
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

    Pictures and findings are copied to DOCS/paper, and the page is written. With DOCS/paper itself for RUN only the
    page is written anew, from its findings and the words in ``figures.toml``: in a second.
    """
    if len(sys.argv) != 3:
        leave("Two directories were expected: that of a haploop paper, and where the page goes.", WRONG_USE)
    directory, docs = map(Path, sys.argv[1:])
    kept = made(directory)
    if not kept:
        leave(f"There is no figure in {directory}; make them with haploop paper --out {directory}.", WRONG_USE)
    pictures = docs / "paper"
    if directory.resolve() != pictures.resolve():
        shutil.rmtree(pictures, ignore_errors=True)
        pictures.mkdir(parents=True)
        for number, one in kept.items():
            for name in (f"figure_{number}.json", *(name for name in one["files"] if name.endswith(".png"))):
                shutil.copyfile(directory / name, pictures / name)
    (docs / PAGE).write_text(page(kept, "paper/"), encoding="utf-8")
    print(docs / PAGE)


if __name__ == "__main__":
    main()
