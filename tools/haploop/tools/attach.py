"""``haploop attach``: join a running loop with a second logger, or to print what happens."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from typing import Any

from haploop.tools.ending import WRONG_USE, leave, plain_errors

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


def _attach_logger(run: Any, out: Path | None) -> None:
    import zmq

    from haploop.launch.output import make_output, write_scene
    from haploop.logger.node import LoggerNode
    from haploop.protocol.member import Aborted, Member, Refused
    from haploop.protocol.processes import OBSERVER
    from haploop.tools.report import print_summary

    directory = make_output(out, Path(f"attached-{run.id}"))
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    member = Member(context, OBSERVER, run.clock, "")
    try:
        welcome = member.join({})
        write_scene(welcome["scene"], directory)
        node = LoggerNode(member, context, None)
        node.start(welcome, directory)
        print(f"logging run {run.id} from tick {node.keeper.logger.tick} on; Ctrl-C leaves", file=sys.stderr)
        try:
            tick, summary = node.run()
            member.leave("DONE", tick, {})
        except KeyboardInterrupt:
            tick, summary = node.finish("")
            member.leave("LEAVE", tick)
        except Aborted as error:
            tick, summary = node.finish(str(error))
    except Refused as error:
        leave(str(error), WRONG_USE)
    finally:
        context.destroy(linger=500)
    print_summary(summary)
    print(directory, file=sys.stderr)


def _attach_print(run: Any) -> None:
    """A lossy listener: prints where the run is; whatever it is too slow for, it skips, and says how much."""
    import zmq

    from haploop.launch.control import ask
    from haploop.protocol.telemetry import Subscriber
    from haploop.tools.report import PrintedLine

    _, data = ask(run, "status")
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
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
