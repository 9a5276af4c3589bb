"""The command that runs a scene to its end; it imports what it works with when it is called."""

from __future__ import annotations

import math
import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import Annotated

import typer

from haploop.tools.cli.view import UntilClosed
from haploop.tools.command.given import print_notes
from haploop.tools.command.interrupt import LeavingAtOnce
from haploop.tools.command.options import (
    FAILED,
    WRONG_USE,
    Json,
    Plugin,
    SceneFile,
    Set,
    leave,
    parse_pace,
    parse_seconds,
    plain_errors,
    print_json,
    what_was_logged,
)


def run(
    context: typer.Context,
    scene: SceneFile,
    set: Set = None,
    out: Annotated[Path | None, typer.Option(help="directory to write to, new or empty [runs/SCENE-TIME]")] = None,
    in_process: Annotated[bool, typer.Option("--in-process", help="all in one process, with the same bits")] = False,
    pace: Annotated[
        str | None, typer.Option(help="free, or simulated seconds per second [free; 1 with --view]", show_default=False)
    ] = None,
    clock: Annotated[
        str, typer.Option(metavar="OWNER", help="who owns the time: run, or plant, a device that runs on its own")
    ] = "run",
    view: Annotated[bool, typer.Option("--view", help="show the run in the browser, where it can be steered")] = False,
    until_closed: UntilClosed = False,
    name: Annotated[
        str | None, typer.Option(metavar="NAME", help="run's name in status, summary and figures [the scene's title]")
    ] = None,
    plugin: Plugin = None,
    tcp: Annotated[
        str | None, typer.Option(metavar="ADDRESS[:PORT]", help="use TCP, as at 127.0.0.1; other addresses need keys")
    ] = None,
    keys: Annotated[Path | None, typer.Option(metavar="DIR", help="keys for TCP, as haploop keys makes them")] = None,
    node: Annotated[
        list[str] | None,
        typer.Option("--node", metavar="ROLE=COMMAND", help="your own program as plant or controller"),
    ] = None,
    external: Annotated[
        list[str] | None, typer.Option("--external", metavar="ROLE", help="wait for a program to join in this role")
    ] = None,
    wait: Annotated[str | None, typer.Option("--wait", metavar="TIME", help="how long to wait for it [60 s]")] = None,
    json: Json = False,
) -> None:
    """Run a scene to its end. Other terminals can watch and steer it meanwhile. The last line names its directory."""
    early = (context.obj or {}).get("early", {})
    with LeavingAtOnce(early):
        from haploop.launch.foreign import ProgramError, check_wait, read_programs
        from haploop.launch.runs import start
        from haploop.launch.scene.toml_writer import inline
        from haploop.launch.spec import SCENE, RunFailed, discard
        from haploop.protocol.transport.addresses import TransportError
        from haploop.protocol.transport.keys import KeysError
        from haploop.protocol.transport.sockets import Transport
        from haploop.tools.cli.view import viewing
        from haploop.tools.render.progress import ProgressLine
        from haploop.tools.render.report import print_summary
        from haploop.tools.render.scene_units import units_of

    with viewing(view, in_process, until_closed) as viewer, plain_errors():
        rate = parse_pace(pace or ("1" if view and clock == "run" else "free"))
        if rate != "free" and in_process:
            leave("--pace needs the clock of a run in separate processes; leave out --in-process.", WRONG_USE)
        if tcp and in_process:
            leave("--tcp needs the sockets of a run in separate processes; leave out --in-process.", WRONG_USE)
        if clock not in ("run", "plant"):
            leave(f"--clock must be run or plant, but {clock!r} was given.", WRONG_USE)
        if (node or external or clock == "plant") and in_process:
            leave("--node, --external and --clock need a run in separate processes; leave out --in-process.", WRONG_USE)
        if wait is not None and not external:
            leave("--wait is for --external, which was not given.", WRONG_USE)
        try:
            transport = Transport.from_options(tcp, keys)
            programs = read_programs(node or [], external or [])
            wait_s = check_wait(parse_seconds(wait, "--wait"))
        except (TransportError, KeysError, ProgramError) as error:
            leave(str(error), WRONG_USE)
        named = [f"title={inline(name)}"] if name else []
        prepared = start.prepare(scene, [*(set or []), *named], plugin or [], out, any_hand="plant" in programs)
        try:
            noted = print_notes(prepared.scene, prepared.kinds, scene, set or [])
            # What an element prints is not part of the answer.
            with ProgressLine(prepared.scene.title, prepared.scene.duration) as line, redirect_stdout(sys.stderr):

                def told(run_id: str) -> None:
                    line.announce(run_id)
                    viewer.on_started(run_id)

                summary = start.run(
                    prepared,
                    in_process=in_process,
                    early=early,
                    pace=math.inf if rate == "free" else rate,
                    clock=clock,
                    transport=transport,
                    programs=programs,
                    wait_s=wait_s,
                    on_progress=line.update,
                    on_started=told,
                    on_judging=line.judging,
                    start_gate=viewer.may_start,
                )
        except RunFailed as error:
            leave(f"{error}\n{what_was_logged(prepared.out)}", FAILED)
        except KeyboardInterrupt:
            discard(prepared.out, prepared.is_new)  # if the run never began
            begun = (prepared.out / SCENE).exists()
            leave(
                f"Interrupted at once; what was logged is in {prepared.out}."
                if begun
                else "Interrupted before the run began; nothing is left of it.",
                FAILED,
            )
        if json:
            print_json({**summary, "directory": str(prepared.out), "notes": noted})
        else:
            print_summary(summary, noted, units_of(prepared.kinds))
            print(prepared.out)
        if summary["ended"] == "failed":
            leave(f"The run failed: {summary['why']}.", FAILED)
