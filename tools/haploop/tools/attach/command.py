"""``haploop attach``: join a running loop with a second logger, with a live table, or for PlotJuggler."""

from __future__ import annotations

import signal
from pathlib import Path

from haploop.tools.cli.exit_codes import WRONG_USE, leave, plain_errors

TARGETS = ("logger", "print", "plotjuggler")


def attach_to(what: str, out: Path | None, run_id: str | None, port: int | None) -> None:
    """Join the run and stay until it ends or Ctrl-C; PlotJuggler's node stays for the runs to come."""
    if what not in TARGETS:
        leave(f"{', '.join(TARGETS[:-1])} or {TARGETS[-1]} was expected, but {what!r} was given.", WRONG_USE)
    for option, value, its in (("--out", out, "logger"), ("--port", port, "plotjuggler")):
        if value is not None and what != its:
            leave(f"{option} belongs to attach {its}, but was given to attach {what}.", WRONG_USE)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with plain_errors():
        if what == "logger":
            from haploop.tools.attach.logger import attach_logger

            attach_logger(run_id, out)
        elif what == "print":
            from haploop.tools.attach.print import attach_print

            attach_print(run_id)
        else:
            from haploop.tools.attach.plotjuggler import PORT
            from haploop.tools.attach.plotjuggler_node import attach_plotjuggler

            attach_plotjuggler(run_id, PORT if port is None else port)
