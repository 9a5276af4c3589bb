"""``haploop attach``: joins a running simulation with a second logger, a live table, or a node for PlotJuggler."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

from haploop.launch.processes import run_directory
from haploop.launch.processes.children import interrupts
from haploop.launch.processes.run_directory import Elsewhere, LiveRun
from haploop.launch.spec import discard, make_output, write_scene
from haploop.logger.books.buffers import TelemetryGap
from haploop.logger.node import LoggerNode
from haploop.logger.summary import Summary
from haploop.protocol.scene.scene import Scene
from haploop.protocol.transport.clock_client import Aborted, ClockClient, Refused
from haploop.protocol.transport.messages import OBSERVER
from haploop.protocol.transport.sockets import SecureContext
from haploop.tools.attach.live_table import attach_print
from haploop.tools.attach.plotjuggler import PORT, attach_plotjuggler
from haploop.tools.command.options import FAILED, WRONG_USE, leave, plain_errors
from haploop.tools.render.report import print_summary
from haploop.tools.render.scene_units import element_units

TARGETS = ("logger", "print", "plotjuggler")


def attach_to(target: str, out: Path | None, run_id: str | Elsewhere | None, port: int | None) -> None:
    """Joins the run and stays until it ends or Ctrl-C; PlotJuggler's node stays for the runs to come."""
    if target not in TARGETS:
        leave(f"{', '.join(TARGETS[:-1])} or {TARGETS[-1]} was expected, but {target!r} was given.", WRONG_USE)
    for option, value, its in (("--out", out, "logger"), ("--port", port, "plotjuggler")):
        if value is not None and target != its:
            leave(f"{option} belongs to attach {its}, but was given to attach {target}.", WRONG_USE)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with plain_errors():
        match target:
            case "logger":
                attach_logger(run_id, out)
            case "print":
                attach_print(run_id)
            case _:
                attach_plotjuggler(run_id, PORT if port is None else port)


def attach_logger(run_id: str | Elsewhere | None, out: Path | None) -> None:
    """Logs a run from its present tick on, with a log and a summary of its own; lossless, so it may slow the run."""
    run = run_directory.find(run_id)
    is_new = out is None or not out.exists()
    name = "".join(letter if letter.isalnum() or letter in ".-" else "_" for letter in run.id)
    directory = make_output(out, Path(f"attached-{name}"))
    context = run.make_context()
    try:
        with interrupts(usual_from=2) as received:
            summary = _log(run, context, directory, received)
    except Refused as error:
        leave(str(error), WRONG_USE)
    finally:
        context.destroy(linger=500)
        discard(directory, is_new)  # where nothing was logged
    print_summary(summary, (), element_units())
    print(directory)
    if summary["ended"] == "failed":
        leave(summary["why"], FAILED)


def _log(run: LiveRun, context: SecureContext, directory: Path, received: list[int]) -> Summary:
    """Logs until the run ends or a signal comes, and returns the summary; exits if no telemetry came."""

    def reason_to_leave() -> str | None:
        if received:
            return ""
        return None if run_directory.is_live(run) else f"The launcher of run {run.id} has ended without a word."

    client = ClockClient(context, OBSERVER, run.clock, "")
    node = LoggerNode(client, context, None, reason_to_leave)
    try:
        welcome = client.join({})
        write_scene(Scene.from_dict(welcome["scene"]), directory)
        node.start(welcome, directory)
        print(f"logging run {run.id} from tick {node.session.logger.tick} on; Ctrl-C stops logging", file=sys.stderr)
        tick, summary = node.run()
        client.leave("LEAVE", tick)
        return summary
    except (Aborted, TelemetryGap) as error:
        summary = node.save(str(error))
        if summary is None:
            leave(f"Nothing of run {run.id} could be logged. {error}", FAILED)
        return summary
