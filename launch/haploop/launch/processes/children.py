"""The processes of a run, started together, watched and never left behind; and the signals that end a run."""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import signal
import subprocess
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from pathlib import Path
from typing import Any

from haploop.launch.foreign import Program
from haploop.launch.one_thread import ask_for_one_thread
from haploop.launch.processes.early import Started, start_node, start_process
from haploop.launch.spec import OutputError
from haploop.protocol.transport.messages import PROCESSES
from haploop.protocol.transport.wire import Message

# Time, s, that a foreign program is given after the end of its stdin to bring its device to rest.
_TO_REST_S = 0.5
MARK = "HAPLOOP_SEAT"
# Time, s, that the search for processes that have left the group may take.
_GUARD_S = 5.0
_GUARD = 'read now || sleep {0}; kill -9 $(grep -lsz "{1}" /proc/[0-9]*/environ | tr -dc "0-9\\n"); kill -9 0'
_NAMED = {int(number) for number in signal.Signals}


class Child:
    """One node's process.

    Its stdin is a lifeline: the process ends at once when the launcher is gone. What it prints before it redirects its
    prints to their file goes to the launcher's stderr, never to its stdout.

    A foreign program writes its prints to that file from the start, and ends together with all processes that it has
    started. One of the run's own processes may have been started ``early``.

    Attributes:
        died: a file descriptor that becomes readable, without polling, when the process has ended.
    """

    def __init__(
        self, role: str, sockets: Path, start: Message, program: Program | None = None, early: Started | None = None
    ) -> None:
        self.role, self._group = role, None
        try:
            self._process, self.died = early or (self._start(program, sockets, start) if program else start_node(role))
        except OSError as error:
            if self._group:
                self._group.kill()
            label = program.label if program else role
            raise OutputError(f"The {label} cannot be started: {error.strerror}.") from error
        if program and start["cores"]:
            with contextlib.suppress(OSError):
                os.sched_setaffinity(self._process.pid, start["cores"])
        assert self._process.stdin
        told = start if program else {**start, "directory": str(sockets)}
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write(json.dumps(told).encode() + b"\n")
            self._process.stdin.flush()

    def _start(self, program: Program, sockets: Path, start: Message) -> Started:
        environment = {**os.environ}
        ask_for_one_thread(environment)
        self._group = _Group(environment)
        prints = os.open(start["prints"], os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
        try:
            return start_process([*program.words, str(sockets)], environment, prints, self._group.id)
        finally:
            os.close(prints)

    @property
    def pid(self) -> int:
        return self._process.pid

    def exit_description(self) -> str:
        try:
            code = self._process.wait(timeout=1.0)
        except subprocess.TimeoutExpired:
            return "closed the pipe that shows it is alive but still runs"
        if code < 0:
            return f"was killed by {signal.Signals(-code).name if -code in _NAMED else f'signal {-code}'}"
        return f"ended with exit status {code}"

    def exited(self) -> bool:
        """Tells whether the process ended by itself, so that it may have left a last message."""
        code = self._process.poll()
        return code is not None and code >= 0

    def rouse(self) -> None:
        """Makes a controller that hangs in an element's code give that up and say where it was."""
        self._process.send_signal(signal.SIGUSR1)

    def show_stack(self) -> None:
        """Makes a controller in compiled code, which ``rouse`` cannot reach, show where it is."""
        self._process.send_signal(signal.SIGUSR2)

    def let_go(self) -> None:
        """Lets a process that has said DONE end; a foreign program ends by itself."""
        if self._process.stdin and not self._group:
            with contextlib.suppress(OSError):
                self._process.stdin.write(b"\n")
                self._process.stdin.flush()

    def wait(self, timeout_s: float) -> bool:
        """Gives the process some time to end by itself; returns whether it did."""
        try:
            self._process.wait(timeout=timeout_s)
        except subprocess.TimeoutExpired:
            return False
        return True

    def kill(self) -> None:
        """Ends the process, stopped or not, and reaps it; a second call does nothing.

        One of the run's own ends now, a foreign program 0.5 s after the end of its stdin.
        """
        if self.died < 0:  # its descriptor's number may have another owner by now, such as a ZeroMQ connection
            return
        if self._process.stdin:
            with contextlib.suppress(OSError):
                self._process.stdin.close()
        if self._group:
            self.wait(_TO_REST_S)
        with contextlib.suppress(ProcessLookupError):
            self._process.kill()
        if self._group:
            self._group.kill()
        self._process.wait()
        os.close(self.died)
        self.died = -1


class _Group:
    """A process group for a foreign program: all of it ends with the launcher, whatever the program does.

    The first process of the group waits for a word on its stdin, which the launcher holds open, or until 0.5 s after
    the end of stdin. It then kills the group and, where there is /proc, also the processes that have left the group but
    kept a mark in their environment.

    Args:
        environment: environment of the program; the mark is added to it.

    Attributes:
        id: number of the group, which no other group can have before ``kill``.
    """

    def __init__(self, environment: dict[str, str]) -> None:
        mark = secrets.token_hex(16)
        guard = ["/bin/sh", "-c", _GUARD.format(_TO_REST_S, f"^{MARK}={mark}$")]
        environment[MARK] = mark
        nowhere = subprocess.DEVNULL
        self._guard = subprocess.Popen(guard, stdin=subprocess.PIPE, stdout=nowhere, stderr=nowhere, process_group=0)
        self.id = self._guard.pid

    def kill(self) -> None:
        with contextlib.suppress(subprocess.TimeoutExpired):
            if self._guard.poll() is None:
                self._guard.communicate(b"now\n", timeout=_GUARD_S)
                return
        with contextlib.suppress(ProcessLookupError):  # the program has killed the guard, or the guard is held up
            os.killpg(self.id, signal.SIGKILL)
        self._guard.communicate()


def start_children(
    sockets: Path,
    start: Callable[[str], Message],
    pin: bool,
    run_number: int,
    programs: Mapping[str, Program],
    early: MutableMapping[str, Started] | None = None,
) -> dict[str, Child]:
    """Starts every process of the table except those that somebody else starts.

    Args:
        start: returns what the process of a role is told at its start.
        programs: foreign programs that take the place of the table's, by role.
        early: processes already started that wait to be told, by role; those used are removed.

    Plant and controller wait for each other at every tick: two cores would gain nothing and cost the wake-up from one
    to the other. They therefore share a core, and the others get the rest. Concurrent runs take different cores. A
    process moves to its cores when it has imported what it needs; all of them import in parallel.

    Raises OutputError if one cannot be started; then none is left.
    """
    loop_cores, other_cores = share_cores(run_number) if pin else (None, None)
    children: dict[str, Child] = {}
    try:
        for role, process in PROCESSES.items():
            program = programs.get(role)
            if program and program.is_external:
                continue
            cores = loop_cores if process.on_loop_core else other_cores
            started = early.pop(role, None) if early else None
            children[role] = Child(role, sockets, {**start(role), "cores": cores}, program, started)
    except BaseException:
        for child in children.values():
            child.kill()
        raise
    return children


def share_cores(run_number: int) -> tuple[list[int] | None, list[int] | None]:
    """Returns (core of plant and controller, cores of the others); (None, None) where nothing can be gained."""
    if not hasattr(os, "sched_getaffinity"):
        return None, None
    cores = sorted(os.sched_getaffinity(0))
    if len(cores) < 2:
        return None, None
    shared = cores[run_number % len(cores)]
    return [shared], [core for core in cores if core != shared]


@contextlib.contextmanager
def interrupts(usual_from: int, patience_s: float = 0.0) -> Iterator[list[int]]:
    """Collects SIGINT and SIGTERM in a list; from the one with number ``usual_from``, counted from 1, on they raise
    KeyboardInterrupt.

    So does SIGALRM, which comes ``patience_s`` after the first, if that is not 0, unless ``heeded`` is called before.
    """
    received: list[int] = []

    def note(number: int, _frame: Any) -> None:
        received.append(number)
        if len(received) >= usual_from or number == signal.SIGALRM:
            raise KeyboardInterrupt
        signal.setitimer(signal.ITIMER_REAL, patience_s)

    try:
        before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM)}
    except ValueError:  # not in the main thread: signals are handled elsewhere
        yield received
        return
    try:
        yield received
    finally:
        heeded()
        for number, handler in before.items():
            signal.signal(number, handler)


def heeded() -> None:
    """Cancels the SIGALRM of ``interrupts``: the signal before it has been heeded."""
    signal.setitimer(signal.ITIMER_REAL, 0.0)
