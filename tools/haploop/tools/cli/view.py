"""``haploop view``: the live page in a browser, for runs of this machine, one after the other."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from haploop.tools.cli.live_runs import LiveRuns
from haploop.tools.cli.which_run import for_a_run
from haploop.tools.command.options import WRONG_USE, leave, plain_errors

if TYPE_CHECKING:
    import asyncio

    from haploop.view.serve.guard import Guard

SINCE = ("start", "now")
UntilClosed = Annotated[bool, typer.Option("--until-closed", help="end once the page is closed, not with Ctrl-C")]
_AT = "The page is at {} ({} ends it)"
_ENDS = ("Ctrl-C", "closing it")
_STAYS = "The run is over; its page {} until {}."
_UNTIL = ("Ctrl-C ends it here", "it is closed, or Ctrl-C ends it here")
_GONE = "The page is gone; the run continues. If it stands still, haploop resume continues it, Ctrl-C ends it."
# How long a run waits for its viewer.
_HELD_S = 20.0
# A viewer yields the processor to a run.
_NICE = 10


@for_a_run
def view(
    run: Annotated[str | None, typer.Option("--run", metavar="ID", help="which run to show first [the newest]")] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, metavar="PORT", help="port of this machine; 0: any free one")
    ] = 0,
    since: Annotated[
        str, typer.Option(metavar="start|now", help="start: also show what was logged before; now: do not")
    ] = "start",
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="open the page")] = True,
    until_closed: UntilClosed = False,
    led: Annotated[bool, typer.Option("--led", hidden=True)] = False,
) -> None:
    """Show runs in the browser as they go, and steer them. The runs of this machine, or one elsewhere, until Ctrl-C."""
    # With --led, another process started this one: it reads the link on stdout, and closing stdin ends the viewer.
    if since not in SINCE:
        leave(f"--since must be {' or '.join(SINCE)}, but {since!r} was given.", WRONG_USE)
    check_extra()
    import asyncio

    from haploop.launch.processes import run_directory
    from haploop.view.serve.server import PortTaken, listen, serve

    with plain_errors():
        shown = run_directory.find(run) if run else None
    only = shown if shown and not shown.is_here else None
    try:
        listening = listen(port)
    except PortTaken as error:
        leave(str(error), WRONG_USE)

    def serving(guard: Guard) -> None:
        if led:
            print(guard.link, flush=True)
        else:
            print(_AT.format(guard.link, _ENDS[until_closed]), file=sys.stderr, flush=True)
        if browser:
            threading.Thread(target=_open, args=(guard.one_time_link,), daemon=True).start()

    async def main() -> None:
        end = asyncio.Event()
        if led:
            _at_eof(asyncio.get_running_loop(), end.set)
        await serve(
            LiveRuns(only),
            listening,
            first=shown and shown.id,
            from_start=since == "start",
            stays=led,  # with --view the page stays with its run
            on_serving=serving,
            end=end,
            until_closed=until_closed,
        )

    with contextlib.suppress(AttributeError, OSError):  # not available on this system, or not allowed
        os.nice(_NICE)
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(main())


def check_extra() -> None:
    """Exits with a sentence if something the page needs is not installed."""
    from haploop.view.serve.assets import MissingExtra, check_installed

    try:
        check_installed()
    except MissingExtra as error:
        leave(str(error), WRONG_USE)


def _open(address: str) -> None:
    """Opens the page if there is a screen to open it on; a browser in the terminal could not draw it."""
    import webbrowser

    screen = sys.platform == "darwin" or any(name in os.environ for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"))
    if not (screen and webbrowser.open(address)):
        print("No browser could be opened here; open the page by its address.", file=sys.stderr, flush=True)


def _at_eof(loop: asyncio.AbstractEventLoop, act: Callable[[], None]) -> None:
    """Acts once stdin is at its end: the process that started this one has ended."""

    def wait() -> None:
        while os.read(sys.stdin.fileno(), 1 << 10):  # not through its buffer, whose lock would be held as Python ends
            pass
        with contextlib.suppress(RuntimeError):  # the event loop has already ended
            loop.call_soon_threadsafe(act)

    threading.Thread(target=wait, daemon=True).start()


@contextlib.contextmanager
def viewing(wanted: bool, in_process: bool, until_closed: bool) -> Iterator[Viewer]:
    """Shows the run inside the context from its first tick on; then keeps the page until Ctrl-C or until it ends.

    The viewer is a process of its own, and the run does not depend on it.
    """
    if wanted and in_process:
        leave("--view needs the sockets of a run in separate processes; leave out --in-process.", WRONG_USE)
    if until_closed and not wanted:
        leave("--until-closed is for the page of --view, which was not given.", WRONG_USE)
    if wanted:
        check_extra()
    shown = Viewer(wanted, until_closed)
    try:
        yield shown
    finally:
        shown.stay()


class Viewer:
    """The viewer of a run as a process of its own; does nothing if none is wanted."""

    def __init__(self, wanted: bool, until_closed: bool) -> None:
        self._wanted, self._until_closed, self._link = wanted, until_closed, ""
        self._process: subprocess.Popen[str] | None = None
        self._is_over = False

    def on_started(self, run_id: str) -> None:
        """Takes the id by which the run can be found from now on."""
        if not self._wanted:
            return
        words = ["view", "--run", run_id.partition(" ")[0], "--led", *["--until-closed"] * self._until_closed]
        print("The page is starting; its address follows in a few seconds.", file=sys.stderr, flush=True)
        self._since = time.monotonic()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "haploop.tools.cli", *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            process_group=0,  # the first Ctrl-C is for the run alone; the page shows its result
        )
        threading.Thread(target=self._tell, daemon=True).start()

    def may_start(self, ready: set[int]) -> bool:
        """Returns whether the run may begin, given the pids of all nodes that are ready."""
        process = self._process
        is_on_its_way = process is not None and process.pid not in ready and process.poll() is None
        return not is_on_its_way or time.monotonic() - self._since >= _HELD_S

    def _tell(self) -> None:
        assert self._process
        assert self._process.stdout
        self._link = self._process.stdout.readline().strip()
        if self._link:
            print(f"The page is at {self._link}", file=sys.stderr, flush=True)
        self._process.stdout.read()  # until the viewer ends
        if self._link and not self._is_over:
            print(_GONE, file=sys.stderr, flush=True)

    def stay(self) -> None:
        """Keeps the page until Ctrl-C, or until it ends by itself; leaves no process behind. The run is over."""
        self._is_over = True
        if not (process := self._process):
            return
        with contextlib.suppress(KeyboardInterrupt):
            if process.poll() is None:
                where = f"stays at {self._link}" if self._link else "is starting and stays"
                print(_STAYS.format(where, _UNTIL[self._until_closed]), file=sys.stderr, flush=True)
            process.wait()
        assert process.stdin
        with contextlib.suppress(OSError):
            process.stdin.close()
        try:
            process.wait(timeout=3.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
