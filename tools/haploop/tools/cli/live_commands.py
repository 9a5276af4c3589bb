"""The commands that watch and steer a running loop."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from haploop.tools.cli.which_run import for_a_run
from haploop.tools.command.options import (
    Json,
    Run,
    parse_assignments,
    parse_pace,
    parse_ticks,
    plain_errors,
    print_json,
)


@for_a_run
def status(run: Run = None, json: Json = False) -> None:
    """Show the live runs and their nodes. Each with its tick, its lag, what it waits for and what it skipped."""
    from haploop.launch.processes import run_directory
    from haploop.launch.processes.run_directory import ask

    answers = {}
    with plain_errors():
        runs = [run_directory.find(run)] if run else run_directory.live_runs()
        for live in runs:
            try:
                answers[live.id] = ask(live, "status")[1]
            except run_directory.RunNotFound as error:  # it ended just now, or its launcher hangs
                print(error, file=sys.stderr)
    if json:
        print_json(answers)
    elif not runs:
        print("No run is live.")
    else:
        from haploop.tools.render.listings import status_table
        from haploop.tools.render.terminal import console

        for identity, data in answers.items():
            console().print(status_table({**data, "run": identity}))


def _ask(run_id: Any, as_json: bool, verb: str, **arguments: Any) -> None:
    """Sends a command to a live run and prints its answer."""
    from haploop.launch.processes import run_directory
    from haploop.launch.processes.run_directory import ask

    with plain_errors():
        text, data = ask(run_directory.find(run_id), verb, **arguments)
    if as_json:
        print_json({"text": text, **data})
    else:
        print(text)


@for_a_run
def pause(run: Run = None, json: Json = False) -> None:
    """Pause at the next possible tick."""
    _ask(run, json, "pause")


@for_a_run
def resume(run: Run = None, json: Json = False) -> None:
    """Continue after a pause."""
    _ask(run, json, "resume")


@for_a_run
def step(
    ticks: Annotated[str, typer.Argument(help="control ticks")] = "1", run: Run = None, json: Json = False
) -> None:
    """Run for some ticks, then pause."""
    _ask(run, json, "step", ticks=parse_ticks(ticks))


@for_a_run
def pace(
    rate: Annotated[str, typer.Argument(help="free, or simulated seconds per second", show_default=False)],
    run: Run = None,
    json: Json = False,
) -> None:
    """Change the pace."""
    _ask(run, json, "pace", pace=parse_pace(rate))


@for_a_run
def stop(run: Run = None, json: Json = False) -> None:
    """End the run properly, with a summary of what ran."""
    _ask(run, json, "stop")


@for_a_run
def swap(
    kind: Annotated[str, typer.Argument(help='kind of element, or "none" to remove', show_default=False)],
    parameters: Annotated[list[str] | None, typer.Argument(metavar="[KEY=VALUE]...", show_default=False)] = None,
    element: Annotated[int, typer.Option(help="which element; one past the end adds one")] = 0,
    at: float | None = None,
    reload: Annotated[bool, typer.Option("--reload", help="load the kind's --plugin file again first")] = False,
    run: Run = None,
    json: Json = False,
) -> None:
    """Replace a dissipation element of a running loop."""
    table = {"kind": kind, **parse_assignments(parameters or [])}
    _ask(run, json, "swap", swap=table, element=element, at=at, reload=reload)


@for_a_run
def set_(
    parameters: Annotated[list[str], typer.Argument(metavar="KEY=VALUE...", show_default=False)],
    at: float | None = None,
    run: Run = None,
    json: Json = False,
) -> None:
    """Change numbers of a running loop. For example wall.stiffness, wall.position, dissipation.0.mass."""
    _ask(run, json, "set", set=parse_assignments(parameters), at=at)


@for_a_run
def undo(run: Run = None, json: Json = False) -> None:
    """Undo the last swap or set of a running loop."""
    _ask(run, json, "undo")


@for_a_run
def attach(
    what: Annotated[str, typer.Argument(help="logger, print or plotjuggler", show_default=False)],
    out: Annotated[Path | None, typer.Option(help="directory of the attached logger [runs/RUN-TIME]")] = None,
    port: Annotated[
        int | None, typer.Option(min=0, max=65535, help="port of this machine, for PlotJuggler; 0: any free one [9872]")
    ] = None,
    run: Run = None,
) -> None:
    """Join a running loop with a logger, a table or PlotJuggler.

    The logger slows the loop down rather than miss anything; the others never slow it, and report what they skipped.
    """
    from haploop.tools.attach.command import attach_to

    attach_to(what, out, run, port)


def keys(
    directory: Annotated[Path, typer.Argument(help="a new directory, or one that lacks some keys", show_default=False)],
) -> None:
    """Make the keys for runs that other hosts can reach. A certificate for each process, and one for clients."""
    from haploop.protocol.transport.keys import make_keys

    with plain_errors():
        made = make_keys(directory)
    print(f"{directory} now has keys for the {', '.join(made)}." if made else f"{directory} already had all keys.")
    print(
        f"Keep it on the host of the run. A host that watches and steers gets {directory / 'clock.key'} and "
        f"{directory / 'client.key_secret'} alone; send them by a way that nobody else can read."
    )
