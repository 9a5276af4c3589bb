"""The live runs: the private directory of each, in which other terminals find it, and the commands they send it."""

from __future__ import annotations

import json
import os
import secrets
import shutil
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import zmq

from haploop.protocol.transport.sockets import SecureContext, Transport, open_socket
from haploop.protocol.transport.wire import Message, WireError, decode, encode

# A socket's path must stay below the kernel's 107 bytes; this leaves room for the run and the socket's name.
_LONGEST_BASE = 70
# A directory that is older and tells of no run belonged to a launcher that was killed as it started.
_ANNOUNCED_WITHIN_S = 60.0
_ANSWER_MS = 5000
_LOOK_MS = 250


class RunNotFound(Exception):
    """No run, or not one run, to talk to; the message lists those there are."""


class CommandRefused(Exception):
    """The run did not do what was asked; the message says why."""


def base_directory() -> Path:
    """Returns the user's directory of live runs, mode 0700, below XDG_RUNTIME_DIR or the temporary directory.

    Raises PermissionError where a directory of that name belongs to somebody else.
    """
    candidate = Path(os.environ.get("XDG_RUNTIME_DIR") or "/nonexistent") / "haploop"
    if not candidate.parent.is_dir() or len(os.fsencode(candidate)) > _LONGEST_BASE:
        candidate = Path(tempfile.gettempdir()) / f"haploop-{os.getuid()}"
    if len(os.fsencode(candidate)) > _LONGEST_BASE:
        candidate = Path("/tmp") / f"haploop-{os.getuid()}"
    candidate.mkdir(mode=0o700, exist_ok=True)
    status = candidate.stat()
    if status.st_uid != os.getuid() or status.st_mode & 0o077:
        raise PermissionError(
            f"{candidate} must belong to you alone (mode 0700), but it belongs to user {status.st_uid} with mode "
            f"{status.st_mode & 0o777:o}; remove it or set XDG_RUNTIME_DIR."
        )
    return candidate


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


def create() -> Path:
    """Makes a directory of sockets, named by the run's id; clears away what dead runs left."""
    live_runs()
    while True:
        path = base_directory() / secrets.token_hex(3)
        try:
            path.mkdir(mode=0o700)
            return path
        except FileExistsError:
            continue


def announce(sockets: Path, clock: str, title: str, out: str, keys: str | None = None) -> None:
    """Writes the entry by which other terminals find the run."""
    entry = {"pid": os.getpid(), "clock": clock, "title": title, "out": out, "keys": keys}
    temporary = sockets / "run.part"
    temporary.write_text(json.dumps(entry), encoding="utf-8")
    temporary.replace(sockets / "run.json")


def remove(sockets: Path) -> None:
    shutil.rmtree(sockets, ignore_errors=True)


def live_runs() -> list[LiveRun]:
    """Returns all runs of this user, oldest first; the directories of dead ones are cleared away."""
    runs = []
    for path in sorted(base_directory().iterdir(), key=_made):
        run = _read(path)
        if run and _is_alive(run.pid):
            runs.append(run)
        elif run or time.time() - _made(path) > _ANNOUNCED_WITHIN_S:
            remove(path)
    return runs


def is_live(run: LiveRun) -> bool:
    return _is_alive(run.pid)


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
        for _ in range(_ANSWER_MS // _LOOK_MS):
            if socket.poll(_LOOK_MS):
                break
            if not is_live(run):
                raise RunNotFound(f"Run {run.id} ({run.title}) has ended.")
        else:
            raise RunNotFound(f"Run {run.id} ({run.title}) has not answered for {_ANSWER_MS // 1000} s.")
        frame = decode(socket.recv())
    except WireError as error:
        raise RunNotFound(f"Run {run.id} answered with something else: {error}") from error
    finally:
        context.destroy(linger=0)
    if frame.name == "REFUSED":
        raise CommandRefused(frame.fields[0])
    ok, text, data = frame.fields
    if not ok:
        raise CommandRefused(text)
    return text, data


def _made(path: Path) -> float:
    """Returns the time at which a run's directory was made; 0 for one that its run has just removed."""
    try:
        return path.stat().st_mtime
    except FileNotFoundError:
        return 0.0


def _read(path: Path) -> LiveRun | None:
    try:
        return LiveRun(path.name, path, **json.loads((path / "run.json").read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):  # not announced yet, removed, or no entry of ours
        return None


def _is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
