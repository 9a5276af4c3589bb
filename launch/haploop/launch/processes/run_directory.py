"""The live runs: the entry by which other terminals find each, and the commands they send it."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import zmq

from haploop.launch.processes.private_directory import (
    ENTRY,
    PART,
    clear_dead,
    directories,
    is_held,
    read_entry,
)
from haploop.launch.spec import OutputError
from haploop.protocol.transport.sockets import SecureContext, Transport, open_socket
from haploop.protocol.transport.wire import Message, WireError, decode, encode

# A swap may try a plugin first.
_ANSWER_MS, _SWAP_MS = 5000, 30_000
_LOOK_MS = 250


class RunNotFound(Exception):
    """No run, or not one run, to talk to; the message lists those there are."""


class CommandRefused(Exception):
    """The run did not do what was asked; the message says why."""


@dataclass(frozen=True)
class LiveRun:
    """A run as other terminals see it: its sockets, the launcher's process, the clock's address and keys."""

    id: str
    sockets: Path
    pid: int
    clock: str
    title: str
    out: str
    keys: str | None = None

    def make_context(self) -> SecureContext:
        return SecureContext.from_transport(Transport(keys=Path(self.keys) if self.keys else None))


def announce(sockets: Path, clock: str, title: str, out: str, keys: str | None = None) -> None:
    """Writes the entry by which other terminals find the run; raises OutputError where that fails."""
    entry = {"pid": os.getpid(), "clock": clock, "title": title, "out": out, "keys": keys}
    temporary = sockets / PART
    try:
        temporary.write_text(json.dumps(entry), encoding="utf-8")
        temporary.replace(sockets / ENTRY)
    except OSError as error:
        raise OutputError(f"{temporary} cannot be written: {error.strerror}.") from error


def live_runs() -> list[LiveRun]:
    """Returns all runs of this user, oldest first; the directories of dead ones are cleared away."""
    runs = []
    for path in directories():
        run = _read(path)
        if not is_held(path):
            clear_dead(path)
        elif run:
            runs.append(run)
    return runs


def is_live(run: LiveRun) -> bool:
    return is_held(run.sockets)


def has_launcher(run: LiveRun) -> bool:
    """Tells whether the process that leads a run is there: when the run is live no more, it judges it."""
    try:
        os.kill(run.pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass
    return True


def find(run_id: str | None) -> LiveRun:
    """Returns the run with this id (or its beginning), or the only one there is; RunNotFound where not one fits."""
    runs = live_runs()
    fitting = [run for run in runs if run_id is None or run.id.startswith(run_id)]
    if len(fitting) == 1:
        return fitting[0]
    listing = "\n".join(f"  {run.id}  {run.title}" for run in runs)
    if not runs:
        raise RunNotFound("No run is live; start one with haploop run SCENE.")
    if not fitting:
        raise RunNotFound(f"No live run has the id {run_id}; these are live:\n{listing}")
    raise RunNotFound(f"{len(fitting)} runs are live; name one with --run ID:\n{listing}")


def ask(run: LiveRun, verb: str, **arguments: Any) -> tuple[str, Message]:
    """Sends a command to a live run; returns its answer, a sentence and data.

    Raises:
        CommandRefused: it was refused; nothing has changed.
        RunNotFound: the run does not answer, or has ended.
    """
    context = run.make_context()
    socket = open_socket(context, zmq.DEALER)
    try:
        socket.connect(run.clock)
        socket.send(encode("COMMAND", verb, arguments))
        answer_ms = _SWAP_MS if verb == "swap" else _ANSWER_MS
        for _ in range(answer_ms // _LOOK_MS):
            if socket.poll(_LOOK_MS):
                break
            if not is_live(run):
                raise RunNotFound(f"Run {run.id} ({run.title}) has ended.")
        else:
            raise RunNotFound(f"Run {run.id} ({run.title}) has not answered for {answer_ms // 1000} s.")
        frame = decode(socket.recv())
    except WireError as error:
        raise RunNotFound(f"Run {run.id} answered with something else: {error}") from error
    except zmq.ZMQError as error:
        raise RunNotFound(f"Run {run.id} cannot be reached at {run.clock}: {error.strerror}.") from error
    finally:
        context.destroy(linger=0)
    if frame.name == "REFUSED":
        raise CommandRefused(frame.fields[0])
    ok, text, data = frame.fields
    if not ok:
        raise CommandRefused(text)
    return text, data


def _read(path: Path) -> LiveRun | None:
    try:
        entry = json.loads(read_entry(path))
        run = LiveRun(path.name, path, **entry)
    except (OSError, ValueError, TypeError, RecursionError):  # not announced yet, removed, or no entry of ours
        return None
    texts = (run.clock, run.title, run.out, run.keys or "")
    return run if isinstance(run.pid, int) and all(isinstance(text, str) for text in texts) else None
