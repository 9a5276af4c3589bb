"""The commands that watch and steer a running loop."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from haploop.tools.cli.options import (
    At,
    Json,
    Run,
    parse_assignments,
    parse_pace,
    parse_seconds,
    plain_errors,
    print_json,
)


def status(run: Run = None, json: Json = False) -> None:
    """Show the live runs: every node, its tick, its lag, whom it waits for, what it skipped."""
    from haploop.launch.processes import run_directory
    from haploop.launch.processes.run_directory import ask

    answers = {}
    with plain_errors():
        for live in [run_directory.find(run)] if run else run_directory.live_runs():
            try:
                answers[live.id] = ask(live, "status")[1]
            except run_directory.RunNotFound as error:  # it ended just now, or its launcher hangs
                print(error, file=sys.stderr)
    if json:
        print_json(answers)
    elif not answers:
        print("No run is live.")
    else:
        from haploop.tools.render.report import status_table
        from haploop.tools.render.terminal import console

        for identity, data in answers.items():
            console().print(status_table({**data, "run": identity}))


def _ask(run_id: str | None, as_json: bool, verb: str, **arguments: Any) -> None:
    """Has a live run do something and prints its answer."""
    from haploop.launch.processes import run_directory
    from haploop.launch.processes.run_directory import ask

    with plain_errors():
        text, data = ask(run_directory.find(run_id), verb, **arguments)
    if as_json:
        print_json({"text": text, **data})
    else:
        print(text)


def pause(run: Run = None, json: Json = False) -> None:
    """Stand still at the next tick that can."""
    _ask(run, json, "pause")


def resume(run: Run = None, json: Json = False) -> None:
    """Go on after a pause."""
    _ask(run, json, "resume")


def step(ticks: Annotated[int, typer.Argument(help="control ticks")] = 1, run: Run = None, json: Json = False) -> None:
    """Go on for some ticks, then stand still."""
    _ask(run, json, "step", ticks=ticks)


def pace(
    rate: Annotated[str, typer.Argument(help="free, or simulated seconds per second", show_default=False)],
    run: Run = None,
    json: Json = False,
) -> None:
    """Go on at another pace."""
    _ask(run, json, "pace", pace=parse_pace(rate))


def stop(run: Run = None, json: Json = False) -> None:
    """End the run in order, with a summary of what ran."""
    _ask(run, json, "stop")


def swap(
    kind: Annotated[str, typer.Argument(help='kind of element, or "none" to remove', show_default=False)],
    parameters: Annotated[list[str] | None, typer.Argument(metavar="[KEY=VALUE]...", show_default=False)] = None,
    element: Annotated[int, typer.Option(help="which element; one past the end adds one")] = 0,
    at: At = None,
    reload: Annotated[bool, typer.Option("--reload", help="load the kind's --plugin file anew first")] = False,
    run: Run = None,
    json: Json = False,
) -> None:
    """Replace a dissipation element of a running loop."""
    table = {"kind": kind, **parse_assignments(parameters or [])}
    _ask(run, json, "swap", swap=table, element=element, at=parse_seconds(at), reload=reload)


def set_(
    parameters: Annotated[list[str], typer.Argument(metavar="KEY=VALUE...", show_default=False)],
    at: At = None,
    run: Run = None,
    json: Json = False,
) -> None:
    """Change numbers of a running loop: wall.stiffness, wall.position, dissipation.0.mass ..."""
    _ask(run, json, "set", set=parse_assignments(parameters), at=parse_seconds(at))


def undo(run: Run = None, json: Json = False) -> None:
    """Take back the last swap or set of a running loop that a command made."""
    _ask(run, json, "undo")


def attach(
    what: Annotated[str, typer.Argument(help="logger, print or plotjuggler", show_default=False)],
    out: Annotated[Path | None, typer.Option(help="directory of the attached logger [runs/RUN-TIME]")] = None,
    port: Annotated[
        int | None, typer.Option(min=0, max=65535, help="of this machine, for PlotJuggler; 0: any free one [9872]")
    ] = None,
    run: Run = None,
) -> None:
    """Join a running loop: with a second logger, to show it as a live table, or to pass it on to PlotJuggler.

    The logger holds the loop up rather than miss anything; the others never do, and say what they skipped.
    """
    from haploop.tools.attach.command import attach_to

    attach_to(what, out, run, port)
