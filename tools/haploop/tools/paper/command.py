"""``haploop paper``: makes the figures of the paper and the page of its claims."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from haploop.tools.ending import WRONG_USE, leave, plain_errors
from haploop.tools.figure_data import FigureError
from haploop.tools.paper.figures import figure, numbers
from haploop.tools.paper.page import PAGE, write_page
from haploop.tools.paper.work import Stage, Work, silent


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
    with plain_errors(), _progress() as stage:
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


@contextmanager
def _progress() -> Iterator[Stage]:
    """Bars on a terminal, one a stage, with the time left; a line a stage elsewhere."""
    from rich import progress

    from haploop.tools.report import console

    screen = console(stderr=True)
    columns = (
        "{task.description}",
        progress.BarColumn(),
        progress.MofNCompleteColumn(),
        progress.TimeRemainingColumn(),
    )
    shown = screen.is_terminal
    with progress.Progress(*columns, console=screen, disable=not shown) as bars:

        def stage(name: str, count: int) -> Callable[[], None]:
            if not shown:
                print(f"{name}: {count}", file=sys.stderr)
            task = bars.add_task(name, total=count)
            return lambda: bars.advance(task)

        yield stage
