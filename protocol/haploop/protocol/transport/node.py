"""The process of a node: its start, the watch on its parent, and the report to the clock of how it ended."""

from __future__ import annotations

import contextlib
import fcntl
import gc
import json
import os
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TextIO

import zmq

from haploop.protocol.plugin_file import PluginError, raised_in_file
from haploop.protocol.transport.clock_client import Aborted, ClockClient, Refused
from haploop.protocol.transport.loop import LoopError
from haploop.protocol.transport.messages import PROCESSES
from haploop.protocol.transport.prints import keep_prints
from haploop.protocol.transport.sockets import BindError, SecureContext, Transport, transport_of
from haploop.protocol.transport.wire import Message

# work(client, context, directory of sockets) -> (tick reached, result for the clock)
Work = Callable[[ClockClient, "zmq.Context[zmq.Socket[bytes]]", Path], tuple[int, Message]]


class NodeError(Exception):
    """Raised for a failure that a user can mend; its full sentence is reported without a traceback."""


def run_node(role: str, work: Work) -> None:
    """Runs a node as a process, ``python -m module``, and exits with status 0 after DONE, else 1.

    Stdin brings one line of JSON: directory of the sockets, address of the clock, secret and transport of the run, the
    file for what is printed, and the cores to stay on, null for any.

    Stdin stays open as long as the launcher lives; when it closes, this process ends at once, whatever it is doing.
    After DONE one more line comes: the lossless listeners have received what was published, and this process may end.
    """
    line = sys.stdin.readline()
    if not line:
        sys.exit(1)  # the launcher is gone already
    start = json.loads(line)
    keep_prints(role, Path(start["prints"]))
    if start["cores"]:
        stay_on(start["cores"], takes_turns=PROCESSES[role].on_loop_core)
    life = LineOfLife(sys.stdin)
    sys.stdin = open(os.devnull)  # noqa: SIM115, PTH123 (code that asks for input gets none)
    gc.freeze()
    context = SecureContext.from_transport(Transport.from_dict(start["transport"]))
    status = take_part(context, role, work, start, Path(start["directory"]), life=life)
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(status)  # a thread that a plugin has left behind would keep the process


def stay_on(cores: list[int], takes_turns: bool) -> None:
    """Keeps this process on some cores, as far as the system lets it.

    Args:
        takes_turns: whether it shares its core with a partner, and each works while the other waits. Interruption by
            every thread that a message wakes then gains nothing and costs two switches, so it is scheduled as a batch.
    """
    with contextlib.suppress(OSError):
        os.sched_setaffinity(0, cores)
        if takes_turns and os.sched_getscheduler(0) == os.SCHED_OTHER:
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


class LineOfLife:
    """A pipe from the launcher: when it closes, this process ends at once; a line on it lets this process end."""

    def __init__(self, pipe: TextIO) -> None:
        self._pipe, self._may_go = pipe, threading.Event()
        with contextlib.suppress(OSError):  # if compiled code lets no thread run, the kernel ends this process
            fcntl.fcntl(pipe, fcntl.F_SETOWN, os.getpid())
            self._alarm(fcntl.FASYNC)
        threading.Thread(target=self._heed, daemon=True).start()

    def _alarm(self, flag: int) -> None:
        fcntl.fcntl(self._pipe, fcntl.F_SETFL, (fcntl.fcntl(self._pipe, fcntl.F_GETFL) & ~fcntl.FASYNC) | flag)

    def _heed(self) -> None:
        if self._pipe.read(1):
            self._may_go.set()
            self._pipe.read()
        os._exit(1)

    def loosen(self) -> None:
        """Allows the line to come; before this call, while work is not done, it would end this process."""
        with contextlib.suppress(OSError):
            self._alarm(0)

    def wait(self) -> None:
        """Waits for the line."""
        self._may_go.wait()


def take_part(
    context: zmq.Context[zmq.Socket[bytes]],
    role: str,
    work: Work,
    start: Message,
    directory: Path,
    tell: Callable[[str], None] = lambda why: None,
    life: LineOfLife | None = None,
) -> int:
    """Works, reports to the clock how that ended, ends the context, and returns the exit status: 0 after DONE, else 1.

    Args:
        start: address of the clock and secret of the run.
        tell: is told why it did not end with DONE.
        life: pipe by which the launcher, if there is one, keeps what is published here until it has been received;
            without one the connection to the clock does so, which lasts as long as the run.
    """
    client = ClockClient(context, role, start["address"], start["secret"], is_watched=life is None)
    try:
        tick, result = work(client, context, directory)
        if life:
            life.loosen()
            client.leave("DONE", tick, result)
            life.wait()
        else:
            client.leave_at_the_end(tick, result)
        status = 0
    except Aborted as error:
        tell(str(error))
        status = 1
    except (Refused, NodeError, LoopError, BindError, PluginError) as error:
        client.leave("FAILED", -1, str(error))
        tell(str(error))
        status = 1
    except Exception as error:
        if not (why := raised_in_file(error)):
            import traceback

            traceback.print_exc()
        client.leave("FAILED", -1, why or f"{type(error).__name__}: {error}")
        status = 1
    context.destroy(linger=int(1000 * transport_of(context).linger_s))
    return status
