"""The machine of a simulated process: virtual time, real files whose writes may be short, slow or refused, children."""

from __future__ import annotations

import contextlib
import errno
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

from haploop.protocol.transport.messages import PROCESSES
from haploop.protocol.transport.node import take_part
from simulation.computer.sockets import SimContext, SimPoller
from simulation.computer.world import Process, World


@dataclass
class Disk:
    """What goes wrong with the files of a run.

    Attributes:
        room: bytes until the disk is full.
        refused: operation ("create", "write", "rename") -> errno that it meets from now on.
        is_slow: whether a write is handed over in pieces, between which its process may lose the processor.
    """

    room: float = float("inf")
    refused: dict[str, int] = field(default_factory=dict)
    is_slow: bool = False

    def check(self, operation: str) -> None:
        if operation in self.refused:
            raise OSError(self.refused[operation], os.strerror(self.refused[operation]))

    def take(self, count: int) -> int:
        """Returns how many of so many bytes find room; raises OSError where none does."""
        self.check("write")
        taken = int(min(count, self.room))
        if not taken and count:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self.room -= taken
        return taken


class _File:
    """A new file; it takes as much of a write as the disk takes, and nothing once its process is dead."""

    def __init__(self, process: Process, path: Path, disk: Disk) -> None:
        self._process, self._disk = process, disk
        self._file = path.open("wb", buffering=0)
        process.on_end.append(self._file.close)

    @property
    def closed(self) -> bool:
        return self._file.closed

    def write(self, data: memoryview) -> int:
        self._process.check()
        count = len(data)
        if self._disk.is_slow and count > 1:
            count = self._process.world.dice.randint(1, count)
            self._process.may_lose_the_processor()
        taken = self._disk.take(count)
        self._file.write(data[:taken])
        return taken

    def seek(self, place: int) -> None:
        self._file.seek(place)

    def truncate(self, size: int) -> None:
        self._process.check()
        self._file.truncate(size)

    def close(self) -> None:
        self._file.close()


class SimMachine:
    """``haploop.protocol.transport.machine.Machine`` in virtual time."""

    def __init__(self, process: Process, watch: Any, disk: Disk) -> None:
        self._process, self._watch, self.disk = process, watch, disk

    def now(self) -> float:
        return self._process.world.now

    def poller(self) -> SimPoller:
        return SimPoller(self._process, self._watch)

    def wait(self, poller: SimPoller, seconds: float) -> dict[Any, int]:
        return dict(poller.poll(1000.0 * seconds))

    def create(self, path: Path) -> _File:
        self.disk.check("create")
        return _File(self._process, path, self.disk)

    def write(self, path: Path, data: bytes) -> None:
        self._process.check()
        self.disk.check("create")
        taken = self.disk.take(len(data))
        path.write_bytes(data[:taken])
        if taken < len(data):
            self.disk.take(1)

    def rename(self, path: Path, target: Path) -> None:
        self._process.check()
        self.disk.check("rename")
        path.replace(target)


class SimChild:
    """A node's process as the launcher sees it, with the methods of ``children.Child``."""

    def __init__(self, run: SimRun, process: Process, role: str) -> None:
        self._run, self._launcher, self.process, self.role = run, run.launcher, process, role
        self.pid = 70_000 + len(run.world.processes)
        self.died = self
        process.on_end.append(run.launcher.nudge)

    def readable(self) -> bool:
        return not self.process.alive

    def exit_description(self) -> str:
        if not self.wait(1.0):
            return "closed its output but still runs"
        return "was killed by SIGKILL" if self.process.status < 0 else f"ended with exit status {self.process.status}"

    def exited(self) -> bool:
        return not self.process.alive and self.process.status >= 0

    def wait(self, timeout_s: float) -> bool:
        return self._launcher.wait(self.readable, timeout_s)

    def let_go(self) -> None:
        self._launcher.check()
        self._run.let_go.add(self.role)
        self.process.nudge()

    def rouse(self) -> None:
        """No element hangs here: a signal by which one would be given up finds nothing to do."""

    show_stack = rouse

    def kill(self) -> None:
        self._launcher.check()
        if self._run.named_at is None:
            self._run.named_at = self._run.world.now
        self.process.kill()


@dataclass
class _Life:
    """What keeps a process that is done, with the methods of ``node.LineOfLife``."""

    run: SimRun
    role: str

    def loosen(self) -> None:
        """A line ends no simulated process."""

    def wait(self) -> None:
        self.run.nodes[self.role].wait(lambda: self.role in self.run.let_go, None)


class SimRun:
    """The launcher of one run and what it starts.

    Attributes:
        nodes: process by role, once started; those in ``let_go`` may end when they are done.
        received: signals that the launcher was sent.
        starts_s: what each takes to start, by role.
        named_at: when the launcher first ended a process, or found that all had ended.
    """

    def __init__(self, world: World, watch: Any, disk: Disk, starts_s: dict[str, float]) -> None:
        self.world, self.watch, self.disk, self.starts_s = world, watch, disk, starts_s
        self.nodes: dict[str, Process] = {}
        self.let_go: set[str] = set()
        self.received: list[int] = []
        self.clock = self.secret = ""
        self.named_at: float | None = None
        self.sockets = Path()
        self.launcher: Process

    def context(self, process: Process, disk: Disk | None = None) -> Any:
        return SimContext(self.world, process, self.watch, SimMachine(process, self.watch, disk or Disk()))

    def launch(self, work: Callable[[SimRun], Any]) -> Process:
        self.launcher = Process(self.world, "launcher", lambda: work(self))
        self.launcher.on_end.append(self._orphan)
        return self.launcher

    def _orphan(self) -> None:
        """A node ends with a launcher that was killed, once it sees that its line of life is cut."""
        if self.launcher.status >= 0 and any(process.alive for process in self.nodes.values()):
            self.watch.fail("a node outlives its run")
        for process in self.nodes.values():
            self.world.after(self.world.dice.expovariate(1e3), process.kill)

    def make_context(self, _transport: Any) -> Any:
        return self.context(self.launcher, self.disk)

    def start_nodes(self, sockets: Path, told_to: Callable[[str], Any], pin: bool, number: int, _programs: Any) -> Any:
        start = told_to("plant")
        self.sockets, self.clock, self.secret = sockets, start["address"], start["secret"]
        for role in PROCESSES:
            self.nodes[role] = Process(self.world, role, self._node(role, sockets, start), self.starts_s[role])
        self.watch.begin(self)
        return {role: SimChild(self, process, role) for role, process in self.nodes.items()}

    def _node(self, role: str, sockets: Path, start: dict[str, Any]) -> Callable[[], int]:
        work = import_module(PROCESSES[role].module).work
        disk = self.disk if role == "logger" else None
        life: Any = _Life(self, role)
        return lambda: take_part(self.context(self.nodes[role], disk), role, work, start, sockets, life=life)

    @contextlib.contextmanager
    def interrupts(self, usual_from: int) -> Iterator[list[int]]:
        yield self.received
