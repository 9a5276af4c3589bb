"""``haploop paper``: makes the figures of the paper and its two pages; ``make paper``: those in docs/."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from haploop.tools.command.options import WRONG_USE, leave, plain_errors
from haploop.tools.figure.data import FigureError
from haploop.tools.render.progress import bars
from haploop.tools.studies.choi2022.answers import Answers
from haploop.tools.studies.choi2022.figures import maker, numbers
from haploop.tools.studies.choi2022.figures.page import made, write_pages
from haploop.tools.studies.choi2022.figures.work import Kept, Work


def paper(wanted: Sequence[int], out: Path, small: bool, workers: int | None) -> None:
    """Makes some figures, all if none is named, and writes the pages from what the directory then holds.

    Earlier calculations by the same program are read back (``answers``).
    """
    there = numbers()
    for number in wanted:
        if number not in there:
            leave(f"There is no figure {number} to make; there are {', '.join(map(str, there))}.", WRONG_USE)
    try:
        Answers(out).folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        leave(f"The directory {out} cannot be used: {error.strerror}.", WRONG_USE)
    with plain_errors(), bars() as stage:
        for number in wanted or there:
            work = Work(out, number, small=small, workers=workers, stage=stage)
            try:
                work.keep(maker(number)(work))
            except FigureError as error:
                leave(str(error), WRONG_USE)
    print(write_pages(made(out), out))


def main() -> None:
    """``python -m haploop.tools.studies.choi2022.command RUN DOCS``: takes a run into the documentation.

    Pictures and findings are copied to DOCS/paper, and the pages are written. If RUN is DOCS/paper
    itself, only the pages are written again, from its findings and the texts of the page, which takes a second.
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
    print(write_pages(kept, docs, "paper/"))


def _taken(kept: Mapping[int, Kept]) -> list[str]:
    """Returns the files of a run that go into the documentation: findings and pictures."""
    shown = [name for one in kept.values() for name in one["files"] if name.endswith(".png")]
    return [*(f"figure_{number}.json" for number in kept), *shown]


if __name__ == "__main__":
    main()
