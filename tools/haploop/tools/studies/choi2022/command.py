"""``haploop paper``: makes the figures of the paper and the page of its claims."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from haploop.tools.cli.exit_codes import WRONG_USE, leave, plain_errors
from haploop.tools.figure.data import FigureError
from haploop.tools.render.progress import Stage, bars, silent
from haploop.tools.studies.choi2022.figures.registry import figure, numbers
from haploop.tools.studies.choi2022.page import PAGE, write_page
from haploop.tools.studies.choi2022.work import Work


def paper(wanted: Sequence[int], out: Path, small: bool, workers: int | None) -> None:
    """Make some figures, all when none is named, and write the page of what the directory then holds."""
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
    write_page(out)
    print(out / PAGE)


def make_figure(
    number: int, out: Path, *, small: bool = False, workers: int | None = None, stage: Stage = silent
) -> None:
    """Make one figure: picture, data, scenes and findings go into ``out``.

    Raises:
        FigureError: matplotlib is missing, or a picture cannot be written.
    """
    module, work = figure(number), Work(out, number, small=small, workers=workers, stage=stage)
    work.keep(module.TITLE, module.make(work))
