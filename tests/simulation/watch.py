"""Invariants that must hold after every message: those of a run, read off the wire by one who sees all of it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from typing import TYPE_CHECKING

import msgpack
import zmq

from haploop.protocol.changes import Event
from haploop.protocol.transport.messages import BY_CODE, VERSION
from haploop.protocol.transport.wire import decode
from simulation.burden import MOST_CALLS, Holdings, Work
from simulation.computer.world import Process

if TYPE_CHECKING:
    from simulation.computer.machine import SimRun
    from simulation.computer.network import Frames, Pipe
    from simulation.computer.sockets import SimSocket

_TURNS = ("JOIN", "READY", "ENDED", "DONE", "FAILED")
_BLOCKS = ("PLANT_BLOCK", "CONTROLLER_BLOCK", "ENERGY_BLOCK")


def name_of(data: bytes) -> str:
    """Returns the name of the message in a frame, by its first bytes; "" for none."""
    return BY_CODE.get(data[2], "") if len(data) > 2 and data[0] & 0xF0 == 0x90 and data[1] == VERSION else ""


def ints(data: bytes, count: int) -> list[int]:
    """Returns the first integers of a message."""
    items = msgpack.Unpacker()
    items.feed(data[1:64])
    return [items.unpack() for _ in range(count + 2)][2:]


class Watch:
    """Sees every message as it is sent and as it is taken, and raises nothing itself: what is broken is in ``broken``.

    Attributes:
        broken: the first promise that was broken, or "".
        granted: the greatest tick granted.
        lossless: processes that may miss nothing.
        followed: those whose READY the clock has read before any of the run's own was done.
        reported: tick of each of them as the clock has read it, while it takes part.
        reports: (time, tick) of every report of the logger.
        events: (tick, event) as granted.
        holdings: what the run's processes and others that may miss nothing hold, look by look.
    """

    def __init__(self, window: int) -> None:
        self._window = window
        self.broken = ""
        self.granted, self._last = 0, False
        self.reported: dict[Process, int] = {}
        self.lossless: set[Process] = set()
        self.followed: set[Process] = set()
        self._done: set[Process] = set()
        self._told: dict[bytes, int] = {}
        self._owed: defaultdict[Pipe, int] = defaultdict(int)
        self._next: dict[SimSocket, int] = {}
        self._at_grant: list[tuple[int, Callable[[], object]]] = []
        self._run: SimRun | None = None
        self.reports: list[tuple[float, int]] = []
        self.events: list[tuple[int, Event]] = []
        self.holdings = Holdings()
        self._work = Work()

    def begin(self, run: SimRun) -> None:
        """Learns who the clock and the run's own processes are."""
        self._run = run
        self.lossless.add(run.nodes["logger"])
        self.reported[run.nodes["logger"]] = 0

    def when_granted(self, tick: int, call: Callable[[], object]) -> None:
        """Calls something once when this tick has been granted."""
        self._at_grant.append((tick, call))

    def fail(self, promise: str) -> None:
        self.broken = self.broken or promise

    def step_over(self) -> None:
        """Checks what a process has done since it last spoke to others, where that was asked for."""
        if self._work.end():
            self.fail(f"a command held the clock up for {self._work.calls} calls, more than {MOST_CALLS}")

    def sent(self, socket: SimSocket, pipe: Pipe | None, frames: Frames) -> None:
        run, process = self._run, socket.process
        if run is None:
            return
        name = name_of(frames[-1])
        if process is run.launcher:
            if pipe is not None:
                self._clock_says(pipe, name, frames[-1])
        elif self._is_own(process):
            self._node_says(process, name, frames[-1])

    def lost(self, socket: SimSocket, pipe: Pipe, frames: Frames) -> None:
        """Notes an answer for which there was no room: whoever asks and does not read loses it."""
        run = self._run
        if run is not None and socket.process is run.launcher and name_of(frames[-1]) in ("REFUSED", "REPLY"):
            self._owed[pipe] -= 1

    def _is_own(self, process: Process) -> bool:
        return self._run is not None and self._run.nodes.get(process.name) is process

    def _clock_says(self, pipe: Pipe, name: str, data: bytes) -> None:
        to, identity = pipe.near.process, pipe.identity
        if name in ("WELCOME", "REFUSED", "REPLY") and not self._is_own(to):
            if name != "REFUSED" or self._owed[pipe]:
                self._owed[pipe] -= 1
            if self._owed[pipe] < 0:
                self.fail(f"a {name} answers nothing that was asked, or answers it twice")
        if name == "ABORT":
            self.reported.pop(to, None)
        if name != "GRANT":
            return
        until, last = ints(data, 2)
        if self._is_own(to) and to.name == "plant":
            self.events += [(tick, event) for tick, event in decode(data).fields[2]]
        if until < self._told.get(identity, 0) or until < self.granted:
            self.fail(f"a grant went back from {max(self.granted, self._told.get(identity, 0))} to {until}")
        if self._last and (not last or until > self.granted):
            self.fail(f"after the last grant, up to {self.granted}, one up to {until} came")
        for process, tick in self.reported.items():
            if until > max(tick + self._window, self.granted) and process.alive:
                self.fail(f"{until} was granted, more than the window beyond {tick}, the tick of the {process.name}")
        self._told[identity] = until
        self.granted, self._last = until, self._last or bool(last)
        while self._at_grant and (due := [call for tick, call in self._at_grant if tick <= until]):
            self._at_grant = [(tick, call) for tick, call in self._at_grant if tick > until]
            for call in due:
                call()

    def _node_says(self, process: Process, name: str, data: bytes) -> None:
        if name in _TURNS:
            process.world.note(f"{process.name}: {name}")
        if name in ("SAMPLES", "COMMANDS"):
            tick, items = msgpack.unpackb(data)[2:]
            reached = tick + len(items)
        elif name in _BLOCKS:
            first, ticks = ints(data, 2)
            reached = first + ticks
        elif name in ("PROGRESS", "DONE", "READY", "END"):
            (reached,) = ints(data, 1)
            if process.name == "logger" and name == "PROGRESS":
                self.reports.append((process.world.now, reached))
        else:
            return
        if reached > (process.granted if process.name != "logger" else self.granted):
            self.fail(f"the {process.name} sent {name} up to tick {reached}, but only {process.granted} were granted")

    def received(self, socket: SimSocket, pipe: Pipe, frames: Frames) -> None:
        self.step_over()
        run, process, data = self._run, socket.process, frames[-1]
        if run is None:
            return
        name = name_of(data)
        if process is run.launcher:
            if socket.kind == zmq.ROUTER:
                self._clock_hears(pipe, name, data)
                if name == "COMMAND":
                    self._work.begin()
        elif name == "GRANT":
            process.granted = max(process.granted, ints(data, 1)[0])
        elif socket.kind == zmq.SUB and process in self.lossless:
            self._follows(process, socket, name, data)

    def _clock_hears(self, pipe: Pipe, name: str, data: bytes) -> None:
        process = pipe.near.process
        is_own = self._is_own(process)
        if is_own and name == "DONE":
            self._done.add(process)
        elif name == "READY" and process in self.lossless and not self._done:
            self.followed.add(process)
        if process in self.lossless:
            if name in ("READY", "PROGRESS"):
                self.reported[process] = max(self.reported.get(process, 0), ints(data, 1)[0])
            elif name in ("DONE", "LEAVE", "FAILED"):
                self.reported.pop(process, None)
        if is_own or name in ("READY", "PROGRESS", "WAITING", "LEAVE", "DONE", "FAILED", "ENDED"):
            return  # own joins are answered when all are there; reports are answered only where they are refused
        self._owed[pipe] += 1

    def _follows(self, process: Process, socket: SimSocket, name: str, data: bytes) -> None:
        if name == "STATE" and socket not in self._next:
            (self._next[socket],) = ints(data, 1)
        elif name in _BLOCKS and socket in self._next:
            first, ticks = ints(data, 2)
            if first > self._next[socket]:
                self.fail(f"{process.name}, lossless, missed ticks {self._next[socket]} to {first} of {name}")
            self._next[socket] = max(self._next[socket], first + ticks)

    def at_rest(self, process: Process) -> None:
        """Checks what holds whenever a process has nothing left to read: of the clock, that everyone has his answer."""
        self.step_over()
        run = self._run
        if run and self.granted and (process is run.launcher or process in self.lossless or self._is_own(process)):
            self.holdings.look(process, self.granted, len(self.events))
        if run is None or process is not run.launcher:
            return
        for pipe, owed in self._owed.items():
            is_tried = pipe.near.process.name.startswith("reload")  # a plugin, which takes time
            if owed > 0 and not pipe.near.is_closed and not is_tried:
                self.fail(f"{pipe.near.process.name} asked the clock, and {owed} times got no answer")
