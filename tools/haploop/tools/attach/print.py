"""``haploop attach print``: a running loop as a live table, or into a pipe as a line now and then."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator

from haploop.launch.processes import run_directory
from haploop.protocol.changes import describe
from haploop.protocol.clock_client import Refused
from haploop.tools.attach.following import Following, summary_of
from haploop.tools.attach.live_table import ending, live_line, live_table
from haploop.tools.attach.watched import Watched
from haploop.tools.cli.exit_codes import FAILED, WRONG_USE, leave
from haploop.tools.render.terminal import console

ROLE = "print"
# How often the table is drawn anew, and a line printed into a pipe, in wall time.
_DRAWN_S, _PRINTED_S = 0.12, 1.0

Show = Callable[[Watched], None]


def attach_print(run_id: str | None) -> None:
    """Show a run until it ends or Ctrl-C; lossy: it never holds the run up."""
    try:
        watched = _watch(run_directory.find(run_id))
    except Refused as error:
        leave(str(error), WRONG_USE)
    except KeyboardInterrupt:
        return
    print(ending(watched), file=sys.stderr)
    if watched.ended == "failed":
        raise SystemExit(FAILED)


def _watch(run: run_directory.LiveRun) -> Watched:
    """Show a run to its end; returns what it looked like then."""
    with Following(run, ROLE) as following, _screen() as show:
        observer = following.observer
        watched = Watched(run.id, observer.welcome)
        for frames in following.frames(_DRAWN_S):
            watched.take(frames, time.monotonic())
            for tick, event in observer.take_events():
                watched.note(tick, event)
            watched.skipped_ticks = following.skipped_ticks
            show(watched)
        watched.end(following.failure, summary_of(observer.welcome))
        show(watched)
    return watched


@contextlib.contextmanager
def _screen() -> Iterator[Show]:
    """A table that stays in its place on a terminal and is left there; lines in a pipe."""
    terminal = console()
    if not terminal.is_terminal:
        yield Lines().show
        return
    from rich.live import Live

    with Live(console=terminal, auto_refresh=False) as live:
        yield lambda watched: live.update(live_table(watched), refresh=True)


class Lines:
    """Prints a run into a pipe: a line a second while it moves, one for every change, and one at the end."""

    def __init__(self) -> None:
        self._due = 0.0
        self._tick = -1
        self._told = 0

    def show(self, watched: Watched) -> None:
        """Print what is due."""
        for tick, event in watched.changes[self._told :]:
            print(f"{tick / watched.time.control_rate:.3f} s  {describe(event)}", flush=True)
        self._told = len(watched.changes)
        now = time.monotonic()
        if watched.ended or (watched.tick != self._tick and now >= self._due):
            self._due, self._tick = now + _PRINTED_S, watched.tick
            print(live_line(watched), flush=True)
