"""Progress on the terminal: the line of a run, and bars for work of several stages."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Self

from haploop.protocol.amounts import amount, fixed
from haploop.tools.render.terminal import console, seen, verdict_style

if TYPE_CHECKING:
    from rich.console import Console
    from rich.live import Live
    from rich.text import Text

    from haploop.protocol.transport.wire import Message

# From the name of a stage and its number of parts to a function that is called after each part.
Stage = Callable[[str, int], Callable[[], None]]
_REFRESH_S = 0.1
_JUDGING = "Over; now held still and pushed, to be judged. Ctrl-C leaves it unjudged."
# Lines of a stage where there is no terminal.
_LINES = 10
# Columns that all but the bar need, and the bar's bounds.
_WORDS, _LEAST_BAR, _MOST_BAR = 70, 4, 24


class ProgressLine:
    """One live line while a run goes on, gone when it ends; nothing without a terminal. A context manager.

    Args:
        duration_s: simulated time of the run.
        console: where to show it; stderr when None.
    """

    def __init__(self, title: str, duration_s: float, console: Console | None = None) -> None:
        self._title, self._duration_s = title, duration_s
        self._console = console
        self._live: Live | None = None
        self._run_id = ""
        self._due = 0.0
        self._began: tuple[float, float] | None = None

    def __enter__(self) -> Self:
        if not self._console and sys.stderr and sys.stderr.isatty():
            self._console = console(stderr=True)
        if self._console and self._console.is_terminal:
            from rich.live import Live

            self._live = Live(console=self._console, auto_refresh=False, transient=True)
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live:
            self._live.stop()

    def announce(self, run_id: str) -> None:
        """Names the run, as other terminals may call it."""
        self._run_id = run_id

    def update(self, status: Message) -> None:
        """Takes the logger's status; cheap, and shown a few times a second at most."""
        now = time.monotonic()
        if not status or now < self._due:
            return
        self._due = now + _REFRESH_S
        # Real time counts from the first status on: starting up is not running.
        self._began = self._began or (now, status["t_s"])
        elapsed_s, done_s = now - self._began[0], status["t_s"] - self._began[1]
        if self._live:
            factor = done_s / elapsed_s if elapsed_s > 0 else 0.0
            self._live.update(self.line(status, factor, self._live.console.width), refresh=True)

    def judging(self) -> None:
        """Shows that the run is over and is being judged."""
        if self._live:
            self._live.update(_JUDGING, refresh=True)

    def line(self, status: Message, factor: float, width: int) -> Text:
        """Makes the line for a status of the logger, cut to ``width`` columns.

        ``factor`` is simulated over real time; 0 where unknown.
        """
        from rich.text import Text

        bar = max(_LEAST_BAR, min(_MOST_BAR, width - _WORDS))
        done = round(min(1.0, status["t_s"] / self._duration_s) * bar)
        word = seen(status["verdict"])
        text = Text.assemble(
            (f"{self._run_id} " if self._run_id else "", "bold"),
            ("━" * done, "green"), ("─" * (bar - done), "dim"),
            f" {status['t_s']:.2f}/{self._duration_s:g} s",
            f" {fixed(factor)}×" if factor else "",
            "  ", (word, verdict_style(word)),
            f"  {amount(status['oscillation_m'], 'm')} p-p",
            "" if status["residual_J"] is None else f"  residual {status['residual_J']:.0e} J",
            (f"  {self._title}", "dim"),
        )  # fmt: skip
        text.truncate(width, overflow="ellipsis")
        return text


def silent(_name: str, _count: int) -> Callable[[], None]:
    return lambda: None


@contextmanager
def bars() -> Iterator[Stage]:
    """Shows a bar per stage on a terminal's stderr, and lines elsewhere: ``NAME: 3 of 10``, at most ten per stage.

    They are redrawn only after each part: a thread that drew in between would disturb what is measured.
    """
    from rich import progress

    terminal = console(stderr=True)
    columns = progress.BarColumn(), progress.MofNCompleteColumn(), progress.TimeRemainingColumn()
    shown = terminal.is_terminal
    look = {"console": terminal, "disable": not shown, "auto_refresh": False}
    with progress.Progress("{task.description}", *columns, **look) as drawn:

        def stage(name: str, count: int) -> Callable[[], None]:
            done, task = 0, drawn.add_task(name, total=count)

            def tell() -> None:
                if not shown and done * _LINES // max(count, 1) > (done - 1) * _LINES // max(count, 1):
                    print(f"{name}: {done} of {count}", file=sys.stderr)
                drawn.refresh()

            def advance() -> None:
                nonlocal done
                done += 1
                drawn.advance(task)
                tell()

            tell()

            return advance

        yield stage
