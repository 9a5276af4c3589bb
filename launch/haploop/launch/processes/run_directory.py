"""The live runs: the entry by which other terminals find a run, and the commands that they send to it."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

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
from haploop.protocol.transport.connection import Connection
from haploop.protocol.transport.keys import CLIENT, KeysError, read_keys
from haploop.protocol.transport.sockets import SecureContext, Transport, connect, open_socket, send_at_once
from haploop.protocol.transport.wire import Message, WireError, decode, encode

# A swap may try a plugin first.
_ANSWER_MS, _SWAP_MS = 5000, 30_000
_LOOK_MS = 250


class RunNotFound(Exception):
    """No run to talk to, or more than one; the message lists those there are."""


class CommandRefused(Exception):
    """The run did not do what was asked; the message says why."""


@dataclass(frozen=True)
class LiveRun:
    """A run as other terminals see it: its sockets, the launcher's process, the clock's address and keys.

    Attributes:
        sockets: its private directory; None for a run elsewhere.
        pid_namespace: the numbering of processes (namespace) that ``pid`` belongs to.
    """

    id: str
    sockets: Path | None
    pid: int
    clock: str
    title: str
    out: str
    keys: str | None = None
    pid_namespace: str = ""

    @property
    def is_here(self) -> bool:
        """Tells whether the run is on this machine, where its files can be read."""
        return self.sockets is not None

    def make_context(self) -> SecureContext:
        """Makes a context whose sockets may connect to the run; raises RunNotFound if its keys are unusable."""
        try:
            keys = read_keys(Path(self.keys), CLIENT) if self.keys else None
        except KeysError as error:
            raise RunNotFound(f"Run {self.id} cannot be reached: {error}") from error
        return SecureContext.from_transport(Transport(keys=keys))


class Elsewhere(NamedTuple):
    """A run on another host, or in another container: the address of its clock, and a copy of its keys."""

    clock: str
    keys: Path | None


def announce(sockets: Path, clock: str, title: str, out: str, keys: str | None = None) -> None:
    """Writes the entry by which other terminals find the run; raises OutputError if that fails."""
    entry = {"pid": os.getpid(), "clock": clock, "title": title, "out": out, "keys": keys}
    entry["pid_namespace"] = _pid_namespace()
    temporary = sockets / PART
    try:
        temporary.write_text(json.dumps(entry), encoding="utf-8")
        temporary.replace(sockets / ENTRY)
    except OSError as error:
        raise OutputError(f"{temporary} cannot be written: {error.strerror}.") from error


def live_runs() -> list[LiveRun]:
    """Returns all runs of this user, oldest first; the directories of dead runs are cleared away."""
    runs = []
    for path in directories():
        run = _read(path)
        if not is_held(path):
            clear_dead(path)
        elif run:
            runs.append(run)
    return runs


def is_live(run: LiveRun) -> bool:
    """Tells whether a launcher holds a run; for one elsewhere, only the connection to its clock can tell."""
    return run.sockets is None or is_held(run.sockets)


def has_launcher(run: LiveRun) -> bool:
    """Tells whether the process that leads a run is there: after the run has ended, that process judges it.

    A process in another container, which cannot be seen from here, is taken to be there.
    """
    if run.sockets is None or run.pid_namespace != _pid_namespace():
        return True
    try:
        os.kill(run.pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass
    return True


def find(which: str | Elsewhere | None) -> LiveRun:
    """Returns the run with this id (or its beginning) or name, for None the only one, or the one reached elsewhere.

    Raises RunNotFound unless exactly one fits, or if the one elsewhere cannot be reached.
    """
    if isinstance(which, Elsewhere):
        return _reach(which)
    run_id, runs = which, live_runs()
    fitting = [run for run in runs if run_id is None or run.id.startswith(run_id) or run.title == run_id]
    if len(fitting) == 1:
        return fitting[0]
    listing = "\n".join(f"  {run.id}  {run.title}" for run in runs)
    if not runs:
        raise RunNotFound("No run is live; start one with haploop run SCENE.")
    if not fitting:
        raise RunNotFound(f"No live run has the id or the name {run_id}; these are live:\n{listing}")
    raise RunNotFound(f"{len(fitting)} runs are live; name one with --run ID, or in Python with attach(ID):\n{listing}")


def ask(run: LiveRun, verb: str, **arguments: Any) -> tuple[str, Message]:
    """Sends a command to a live run; returns its answer, a sentence and data.

    Raises:
        CommandRefused: it was refused; nothing has changed.
        RunNotFound: the run does not answer, or has ended.
    """
    context = run.make_context()
    socket = open_socket(context, zmq.DEALER)
    is_tcp = run.clock.startswith("tcp:")
    connection = Connection(context, socket, run.clock) if is_tcp else None
    try:
        connect(socket, run.clock)
        send_at_once(socket, encode("COMMAND", verb, arguments))  # if it cannot, the connection says why
        answer_ms = _SWAP_MS if verb == "swap" else _ANSWER_MS
        for _ in range(answer_ms // _LOOK_MS):
            if socket.poll(_LOOK_MS):
                break
            if not is_live(run):
                raise RunNotFound(f"Run {_named(run)} has ended.")
            if connection and (why := connection.trouble()):
                is_known = "" if run.sockets is None else f"Run {_named(run)} is live but cannot be reached from here. "
                raise RunNotFound(is_known + why)
        else:
            raise RunNotFound(f"Run {_named(run)} has not answered for {answer_ms // 1000} s.")
        frame = decode(socket.recv())
    except WireError as error:
        raise RunNotFound(f"Run {run.id} gave an unexpected answer: {error}") from error
    except (OverflowError, ValueError) as error:  # what msgpack refuses to carry
        why = "an integer does not fit into 64 bits" if isinstance(error, OverflowError) else str(error)
        raise CommandRefused(f"A message cannot carry this command: {why}.") from error
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


def _named(run: LiveRun) -> str:
    return f"{run.id} ({run.title})" if run.title else run.id


def _reach(place: Elsewhere) -> LiveRun:
    """Asks the run at an address for its title; raises RunNotFound, with the reason, if none answers."""
    keys = str(place.keys) if place.keys else None
    run = LiveRun(place.clock.removeprefix("tcp://"), None, 0, place.clock, "", "", keys)
    try:
        data = ask(run, "status")[1]
        return replace(run, title=str(data["title"]), out=str(data["out"]))
    except (CommandRefused, LookupError) as error:
        raise RunNotFound(f"What answers at {run.id} is not a run of this version of haploop: {error}") from error


def _pid_namespace() -> str:
    """Returns what distinguishes this numbering of processes from that of other containers; "" if there is nothing."""
    try:
        return os.readlink("/proc/self/ns/pid")  # noqa: PTH115 (no file that is there)
    except OSError:
        return ""


def _read(path: Path) -> LiveRun | None:
    try:
        entry = json.loads(read_entry(path))
        run = LiveRun(path.name, path, **entry)
    except (OSError, ValueError, TypeError, RecursionError):  # not announced yet, removed, or no entry of ours
        return None
    texts = (run.clock, run.title, run.out, run.keys or "", run.pid_namespace)
    return run if isinstance(run.pid, int) and all(isinstance(text, str) for text in texts) else None
