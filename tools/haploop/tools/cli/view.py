"""``haploop view``: the live page in a browser, for runs of this machine, one after the other."""

from __future__ import annotations

import contextlib
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from haploop.tools.cli.options import WRONG_USE, leave, plain_errors
from haploop.tools.cli.which_run import for_a_run

if TYPE_CHECKING:
    import asyncio

    from haploop.launch.processes.run_directory import LiveRun
    from haploop.protocol.scene.scene import Scene
    from haploop.protocol.transport.sockets import SecureContext
    from haploop.protocol.transport.wire import Message
    from haploop.view.serve.guard import Guard

SINCE = ("start", "now")
UntilClosed = Annotated[bool, typer.Option("--until-closed", help="end once the page is closed, not with Ctrl-C")]
_AT = "The page is at {} ({} ends it)"
_ENDS = ("Ctrl-C", "closing it")
# A run waits so long for its viewer.
_HELD_S = 10.0
# A viewer steps back where a run wants the processor.
_NICE = 10
# Recorded runs are looked for here, and so many of them offered.
_RUNS, _MOST_PAST = "runs", 50


@dataclass
class RecordedRun:
    """A run that is over, as a viewer finds it."""

    id: str
    out: Path
    title: str
    told: str
    clock: str = ""
    is_here: bool = True

    @classmethod
    def of_summary(cls, file: Path, ended_s: float) -> RecordedRun:
        """Makes it of its summary, written at a time in s; of one that cannot be read its folder's name is told."""
        from haploop.logger.log import LogError
        from haploop.logger.summary import read

        name, when = file.parent.name, time.strftime("%d %b %H:%M", time.localtime(ended_s))
        try:
            summary = read(file)
            told = [summary["verdict"], *summary.get("stability", {}).get("provisos", ()), when]
            return cls(name, file.parent, summary.get("title") or name, ", ".join(told))
        except (LogError, KeyError):
            return cls(name, file.parent, name, when)

    def scene(self) -> Scene:
        """Reads its resolved scene; raises OSError where there is none."""
        from haploop.launch.runs.run_files import recorded_scene
        from haploop.launch.scene.mistakes import SceneError

        try:
            scene = recorded_scene(self.out, {})
        except SceneError as error:
            raise OSError(str(error)) from error
        if scene is None:
            raise FileNotFoundError(f"There is no scene.toml in {self.out}.")
        return scene

    def units(self, scene: Scene, keys: Iterable[str]) -> dict[str, str]:
        """Returns the units of these keys of a scene, and by kind and parameter; no key that has none."""
        from haploop.tools.figure.scene_units import element_units, unit_at

        kinds = element_units()
        return kinds | {key: unit for key in keys if (unit := unit_at(scene, key, kinds))}

    def make_context(self) -> SecureContext:
        """Raises: nobody is there to connect to."""
        raise OSError(f"Run {self.id} is over.")


class LiveRuns:
    """The live runs of this user, as a viewer finds and steers them; or one run elsewhere alone."""

    def __init__(self, only: LiveRun | None = None) -> None:
        self._only = only
        self._recorded: dict[tuple[Path, float], RecordedRun] = {}

    def live(self) -> Sequence[LiveRun]:
        """Returns the runs that live now, the oldest first."""
        from haploop.launch.processes import run_directory

        return [self._only] if self._only else run_directory.live_runs()

    def past(self) -> Sequence[RecordedRun]:
        """Returns the recorded runs in ./runs that have a summary, the newest first; of a run elsewhere none."""
        if self._only:
            return []
        found = sorted(((file.stat().st_mtime, file) for file in Path(_RUNS).glob("*/summary.json")), reverse=True)
        now = {(file, ended_s) for ended_s, file in found[:_MOST_PAST]}
        self._recorded = {key: run for key, run in self._recorded.items() if key in now}
        for key in now - self._recorded.keys():
            self._recorded[key] = RecordedRun.of_summary(*key)
        return [self._recorded[file, ended_s] for ended_s, file in found[:_MOST_PAST]]

    def stiffness_limit(self, scene: Scene) -> float | str:
        """Returns the largest stiffness with which the linear map of a loop is stable, N/m, or why there is none."""
        from haploop.controller.dissipation.element import ElementError
        from haploop.tools.linear.linearity import why_not_linear
        from haploop.tools.linear.one_tick import NeverStable, OneTickMap

        try:
            if curved := why_not_linear(scene):
                return f"not linear, by {' and '.join(curved)}"
            limit = OneTickMap.from_scene(scene).stiffness_limit()
        except NeverStable:
            return "unstable with the softest wall"
        except (ElementError, ValueError, KeyError, ArithmeticError):
            return "an element that is not known here"
        return limit if math.isfinite(limit) else "stable with any wall"

    def has_launcher(self, run: LiveRun) -> bool:
        """Returns whether the process that started a run is there, which judges it in the end."""
        from haploop.launch.processes import run_directory

        return run_directory.has_launcher(run)

    def ask(self, run: LiveRun, verb: str, arguments: Message) -> tuple[str, Message]:
        """Has a run carry out a command."""
        from haploop.launch.processes.run_directory import CommandRefused, RunNotFound, ask
        from haploop.view.receive.runs import CommandFailed

        try:
            return ask(run, verb, **arguments)
        except (CommandRefused, RunNotFound) as error:
            raise CommandFailed(str(error)) from error
        except (TypeError, ValueError, OverflowError) as error:  # names of its own, numbers no message can carry
            raise CommandFailed(f"The arguments of {verb} cannot be used: {error}.") from error


@for_a_run
def view(
    run: Annotated[str | None, typer.Option("--run", metavar="ID", help="which run to show first [the newest]")] = None,
    port: Annotated[int, typer.Option(min=0, max=65535, metavar="PORT", help="of this machine; 0: any free one")] = 0,
    since: Annotated[str, typer.Option(metavar="start|now", help="with what was logged before, or without")] = "start",
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="open the page")] = True,
    until_closed: UntilClosed = False,
    led: Annotated[bool, typer.Option("--led", hidden=True)] = False,
) -> None:
    """Show runs in the browser as they go, and steer them. Those of this machine or one elsewhere, until Ctrl-C."""
    # One led by another process gives it the link on stdout and ends with stdin.
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
            stays=led,  # with --view the page is that of its run
            on_serving=serving,
            end=end,
            until_closed=until_closed,
        )

    with contextlib.suppress(AttributeError, OSError):  # no such thing on this system, or not allowed
        os.nice(_NICE)
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(main())


def check_extra() -> None:
    """Leaves with a sentence where something the page needs is not installed."""
    from haploop.view.serve.assets import MissingExtra, check_installed

    try:
        check_installed()
    except MissingExtra as error:
        leave(str(error), WRONG_USE)


def _open(address: str) -> None:
    """Opens the page where there is a screen to open it on; a browser in the terminal could not draw it."""
    import webbrowser

    screen = sys.platform == "darwin" or any(name in os.environ for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"))
    if not (screen and webbrowser.open(address)):
        print("No browser could be opened here; open the page by its address.", file=sys.stderr, flush=True)


def _at_eof(loop: asyncio.AbstractEventLoop, act: Callable[[], None]) -> None:
    """Acts once nothing can come from stdin any more: whoever started this process has ended."""

    def wait() -> None:
        sys.stdin.buffer.read()
        with contextlib.suppress(RuntimeError):  # the loop has ended by itself
            loop.call_soon_threadsafe(act)

    threading.Thread(target=wait, daemon=True).start()


@contextlib.contextmanager
def viewing(wanted: bool, in_process: bool, until_closed: bool) -> Iterator[Viewer]:
    """Shows what is run meanwhile from its first tick on; when it is over, keeps the page until Ctrl-C or its end.

    The viewer is a process of its own; what becomes of it is no matter to the run.
    """
    if wanted and in_process:
        leave("--view needs the sockets of a run as processes; leave out --in-process.", WRONG_USE)
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
    """The viewer of a run as a process of its own; does nothing where nobody looks."""

    def __init__(self, wanted: bool, until_closed: bool) -> None:
        self._wanted, self._until_closed, self._link = wanted, until_closed, ""
        self._process: subprocess.Popen[str] | None = None

    def on_started(self, run_id: str) -> None:
        """Takes the id by which the run can be found from now on."""
        if not self._wanted:
            return
        words = ["view", "--run", run_id.partition(" ")[0], "--led", *["--until-closed"] * self._until_closed]
        print("The page is on its way; its address comes in a few seconds.", file=sys.stderr, flush=True)
        self._since = time.monotonic()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "haploop.tools.cli", *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            process_group=0,  # the first Ctrl-C is for the run alone; the page shows what came of it
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

    def stay(self) -> None:
        """Keeps the page until Ctrl-C, or until it ends by itself; leaves no process behind."""
        if not (process := self._process):
            return
        with contextlib.suppress(KeyboardInterrupt):
            if self._link and process.poll() is None:
                print(_AT.format(self._link, _ENDS[self._until_closed]), file=sys.stderr, flush=True)
            process.wait()
        assert process.stdin
        with contextlib.suppress(OSError):
            process.stdin.close()
        try:
            process.wait(timeout=3.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
