"""``haploop attach``: join a running loop with a second logger, or to print what happens."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from haploop.tools.ending import FAILED, WRONG_USE, leave, plain_errors

if TYPE_CHECKING:
    from haploop.launch.run_directory import LiveRun
    from haploop.protocol.member import Member

TARGETS = ("logger", "print")


def attach_to(what: str, out: Path | None, run_id: str | None) -> None:
    """Join the run and stay until it ends or Ctrl-C."""
    if what not in TARGETS:
        leave(f"{' or '.join(TARGETS)} was expected, but {what!r} was given.", WRONG_USE)
    from haploop.launch import run_directory

    with plain_errors():
        run = run_directory.find(run_id)
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        if what == "logger":
            _attach_logger(run, out)
        else:
            _attach_print(run)


def _attach_logger(run: LiveRun, out: Path | None) -> None:
    from haploop.launch.interrupts import interrupts
    from haploop.launch.output import make_output
    from haploop.protocol.member import Member, Refused
    from haploop.protocol.processes import OBSERVER
    from haploop.tools.report import print_summary

    directory = make_output(out, Path(f"attached-{run.id}"))
    context = run.wires()
    try:
        with interrupts(usual_from=2) as received:
            summary = _log(run, Member(context, OBSERVER, run.clock, ""), context, directory, received)
    except Refused as error:
        leave(str(error), WRONG_USE)
    finally:
        context.destroy(linger=500)
    if summary is None:
        leave(f"Run {run.id} ended before anything could be logged.", FAILED)
    print_summary(summary)
    print(directory, file=sys.stderr)
    if summary["ended"] == "failed":
        leave(summary["why"], FAILED)


def _log(run: LiveRun, member: Member, context: Any, directory: Path, received: list[int]) -> dict[str, Any] | None:
    """Log until the run ends or a signal comes; the summary, or None if nothing came."""
    from haploop.launch.output import write_scene
    from haploop.launch.run_directory import is_live
    from haploop.logger.node import LoggerNode
    from haploop.logger.tapes import TelemetryGap
    from haploop.protocol.member import Aborted

    def reason_to_leave() -> str | None:
        if received:
            return ""
        return None if is_live(run) else f"The launcher of run {run.id} has ended without a word."

    node = LoggerNode(member, context, None, reason_to_leave)
    try:
        welcome = member.join({})
        write_scene(welcome["scene"], directory)
        node.start(welcome, directory)
        print(f"logging run {run.id} from tick {node.keeper.logger.tick} on; Ctrl-C leaves", file=sys.stderr)
        tick, summary = node.run()
        member.leave("LEAVE", tick)
        return summary
    except (Aborted, TelemetryGap) as error:
        return node.save(str(error))


def _attach_print(run: LiveRun) -> None:
    """A lossy listener: prints where the run is; whatever it is too slow for, it skips, and says how much."""
    from haploop.launch.control import ask
    from haploop.protocol.telemetry import Subscriber
    from haploop.tools.report import PrintedLine

    _, data = ask(run, "status")
    context = run.wires()
    stream = Subscriber(context, {"logger": data["telemetry"]["logger"]})
    try:
        with PrintedLine(data["title"], data["end"] / data["control_rate"]) as line:
            while True:
                for _, frame in stream.receive(1000):
                    if frame.name == "END":
                        print(f"the run ended at tick {frame.fields[0]}", file=sys.stderr)
                        return
                    line.show(frame.fields[-1], skipped_ticks=stream.gaps["logger"])
    except KeyboardInterrupt:
        return
    finally:
        context.destroy(linger=0)
