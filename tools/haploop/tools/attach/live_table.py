"""``haploop attach print``: a running simulation as a live table, or in a pipe as a line a second."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from haploop.launch.processes import run_directory
from haploop.launch.processes.run_directory import Elsewhere, LiveRun
from haploop.protocol.amounts import amount, fixed
from haploop.protocol.changes import describe
from haploop.protocol.transport.clock_client import Refused
from haploop.tools.attach.live_status import LiveStatus
from haploop.tools.attach.observed_run import ObservedRun, read_summary
from haploop.tools.command.options import FAILED, WRONG_USE, leave
from haploop.tools.render.terminal import console, make_facts, make_table, seen, verdict_style

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table

# The role under which the clock lists the table.
ROLE = "print"
# Intervals at which the table is drawn, and at which a line is printed into a pipe, s of wall time.
_DRAWN_S, _PRINTED_S = 0.12, 1.0
_BAR = 20
_TRUE, _SAMPLED = ".true", ".sampled"
_STATES = {"paused": "bold yellow", "running": "bold green", "waiting": "bold", "failed": "bold red"}


def live_table(run: LiveStatus) -> RenderableType:
    from rich.console import Group
    from rich.text import Text

    head = Text.assemble((run.run_id, "bold"), "  ", run.title, no_wrap=True, overflow="ellipsis")
    state = run.ended or ("paused" if run.paused else "running" if run.factor else "waiting")
    end = run.time.ticks
    done = round(min(1.0, run.tick / end) * _BAR)
    progress = Text.assemble(
        (f"{state:<8}", _STATES.get(state, "bold")), "  ",
        ("━" * done, "green"), ("─" * (_BAR - done), "dim"),
        f"  {run.t_s:.3f} s of {end / run.time.control_rate:g} s, tick {run.tick}",
        f"  {fixed(run.factor)}× real time" if run.factor is not None and not run.paused else "",
        no_wrap=True, overflow="ellipsis",
    )  # fmt: skip
    return Group(head, progress, _figures(run), _books(run))


def _word(run: LiveStatus) -> str:
    verdict = run.figures["verdict"]
    return "being judged" if run.is_awaited else verdict if run.is_judged else seen(verdict)


def live_line(run: LiveStatus) -> str:
    """Returns the state of a run as one line, for a pipe."""
    motion, figures = run.motion(), run.figures
    words = [f"{run.t_s:.3f} s"]
    if motion:
        words += [f"x {amount(motion['x'], 'm')}", f"force {amount(motion['force'], 'N')}"]
    if figures:
        words += [_word(run), f"{amount(figures['oscillation_m'], 'm')} p-p"]
        words.append(figures.get("balance") or f"residual {amount(figures['residual_J'], 'J')}")
    if run.factor is not None:
        words.append(f"{fixed(run.factor)}x real time")
    if run.skipped_ticks:
        words.append(f"skipped {run.skipped_ticks} ticks")
    return "  ".join(words)


def end_sentence(run: LiveStatus) -> str:
    why = f": {run.why.rstrip('.')}" if run.why else ""
    word = "" if run.ended in ("ended", "done") else f" ({run.ended})"
    return f"Run {run.run_id} ended at tick {run.tick}, {run.t_s:g} s{word}{why}."


def _figures(run: LiveStatus) -> Table:
    from rich.text import Text

    grid = make_facts([], least_width=12)
    figures, motion = run.figures, run.motion()
    if figures:
        word, swing = _word(run), f"  oscillation {amount(figures['oscillation_m'], 'm')} peak to peak"
        what = "verdict" if run.is_judged or run.is_awaited else "seen" if run.ended else "so far"
        grid.add_row(what, Text.assemble((word, verdict_style(word)), swing))
    if balance := figures.get("balance"):
        grid.add_row("energy", Text(balance, "yellow"))
    depth_m = run.penetration_m()
    side = "" if depth_m is None else f"  {amount(abs(depth_m), 'm')} {'inside' if depth_m > 0 else 'outside'} the wall"
    grid.add_row("position", amount(motion.get("x"), "m") + side)
    grid.add_row("velocity", amount(motion.get("v"), "m/s"))
    parts = ", ".join(f"{name} {amount(force, 'N')}" for name, force in run.parts().items())
    grid.add_row("force", amount(motion.get("force"), "N") + (f"  commanded: {parts}" if parts else ""))
    grid.add_row("skipped", Text(f"{run.skipped_ticks} ticks", "yellow" if run.skipped_ticks else ""))
    if run.changes:
        tick, event = run.changes[-1]
        grid.add_row("last change", Text(f"{describe(event)}, at {tick / run.time.control_rate:g} s (tick {tick})"))
    return grid


def _books(run: LiveStatus) -> Table:
    numbers = ("true", "sampled")
    table = make_table("energy taken out of the device by", *numbers, numbers=numbers, least_width=9)
    books = run.last("ENERGY_BLOCK")
    for name in (name.removesuffix(_TRUE) for name in books if name.endswith(_TRUE)):
        if name != "wall" or run.penetration_m() is not None:
            table.add_row(name, *(amount(books[name + side], "J") for side in (_TRUE, _SAMPLED)))
    moved = books.get("moved")
    residual = run.figures.get("residual_J")
    share = f", {residual / moved:.1e} of what moved" if residual is not None and moved else ""
    table.add_section()
    table.add_row(f"residual{share}", amount(residual, "J"), "")
    return table


def attach_print(run_id: str | Elsewhere | None) -> None:
    """Shows a run until it ends or Ctrl-C; lossy, so it never holds the run up."""
    try:
        live_run = run_directory.find(run_id)
        with ObservedRun(live_run, ROLE) as observed, _screen() as show:
            observer = observed.observer
            run = LiveStatus(live_run.id, observer.welcome)
            for frames in observed.frames(_DRAWN_S):
                run.ingest(frames, time.monotonic())
                for tick, event in observer.take_events():
                    run.note_event(tick, event)
                run.skipped_ticks = observed.skipped_ticks
                show(run)
            run.end(observed.failure, read_summary(live_run, observer.welcome))
            show(run)
            if run.is_awaited:
                _await_verdict(run, live_run, observed)
                show(run)
    except Refused as error:
        leave(str(error), WRONG_USE)
    except KeyboardInterrupt:
        return
    print(end_sentence(run), file=sys.stderr)
    if run.ended == "failed":
        raise SystemExit(FAILED)


def _await_verdict(run: LiveStatus, live_run: LiveRun, observed: ObservedRun) -> None:
    """Waits until the launcher of an ended run has judged it; if it exits without a verdict, what was seen stands."""
    is_there = True
    while run.is_awaited and is_there:
        time.sleep(_DRAWN_S)
        is_there = run_directory.has_launcher(live_run)
        run.end(observed.failure, read_summary(live_run, observed.observer.welcome))
    run.is_awaited = False


@contextlib.contextmanager
def _screen() -> Iterator[Callable[[LiveStatus], None]]:
    terminal = console()
    if not terminal.is_terminal:
        yield LinePrinter().show
        return
    from rich.live import Live

    with Live(console=terminal, auto_refresh=False) as live:
        yield lambda run: live.update(live_table(run), refresh=True)


class LinePrinter:
    """Prints a run into a pipe: a line a second while it moves, one for every change, and one at the end."""

    def __init__(self) -> None:
        self._due = 0.0
        self._tick = -1
        self._printed = 0

    def show(self, run: LiveStatus) -> None:
        for tick, event in run.changes[self._printed :]:
            print(f"{tick / run.time.control_rate:.3f} s  {describe(event)}", flush=True)
        self._printed = len(run.changes)
        now = time.monotonic()
        if run.ended or (run.tick != self._tick and now >= self._due):
            self._due, self._tick = now + _PRINTED_S, run.tick
            print(live_line(run), flush=True)
