"""Bars for work of several stages, one a stage, with the time left."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

# Names a stage of so many parts; what it returns is called after each of them.
Stage = Callable[[str, int], Callable[[], None]]


def silent(_name: str, _count: int) -> Callable[[], None]:
    """A stage that shows nothing."""
    return lambda: None


@contextmanager
def bars(*, by_itself: bool = True) -> Iterator[Stage]:
    """Bars on a terminal's stderr; a line a stage elsewhere.

    Args:
        by_itself: whether a thread keeps them moving; without one they move after each part only, so that what is
            measured between is not disturbed.
    """
    from rich import progress

    from haploop.tools.render.report import console

    screen = console(stderr=True)
    shown = screen.is_terminal
    columns = (
        "{task.description}",
        progress.BarColumn(),
        progress.MofNCompleteColumn(),
        progress.TimeRemainingColumn(),
    )
    with progress.Progress(*columns, console=screen, disable=not shown, auto_refresh=by_itself) as drawn:

        def stage(name: str, count: int) -> Callable[[], None]:
            if not shown:
                print(f"{name}: {count}", file=sys.stderr)
            task = drawn.add_task(name, total=count)
            if not by_itself:
                drawn.refresh()

            def advance() -> None:
                drawn.advance(task)
                if not by_itself:
                    drawn.refresh()

            return advance

        yield stage
