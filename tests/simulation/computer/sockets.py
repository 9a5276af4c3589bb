"""Sockets, pollers and contexts with the methods of pyzmq that the nodes use, on the simulated network."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import zmq

from simulation.computer.network import Frames, Lane, Pipe
from simulation.computer.world import Process, World


class SimSocket:
    """A ROUTER, DEALER, XPUB, SUB or XSUB of one process.

    Attributes:
        pipes: its connections by identity.
    """

    def __init__(self, context: SimContext, kind: int) -> None:
        self.context, self.kind = context, kind
        self.process, self._world = context.process, context.world
        self.linger = -1
        self.is_closed = False
        self.pipes: dict[bytes, Pipe] = {}
        self._gone: list[Pipe] = []
        self._full: dict[Pipe, Lane] = {}
        self._requests: deque[Frames] = deque()  # of an XPUB, which outlive who sent them
        self._rest: Frames = []
        self._begun: Frames = []
        self._topics: list[bytes] = []
        self._address = ""
        self._timeout_s: float | None = None
        context.process.sockets.append(self)

    # Options

    def setsockopt(self, option: int, value: int) -> None:
        if option == zmq.RCVTIMEO:
            self._timeout_s = value / 1000.0

    def get(self, option: int) -> int:
        assert option == zmq.EVENTS
        self.process.may_lose_the_processor()
        self._look()
        return (zmq.POLLIN if self.readable() else 0) | zmq.POLLOUT

    def getsockopt(self, option: int) -> bytes:
        assert option == zmq.LAST_ENDPOINT
        return self._address.encode()

    @property
    def rcvmore(self) -> bool:
        return bool(self._rest)

    # Connections

    def bind(self, address: str) -> None:
        self._world.listening[address] = self
        self._address = address
        Path(address.removeprefix("ipc://")).touch(exist_ok=False)

    def connect(self, address: str) -> None:
        pipe = Pipe(self._world, self, address)
        self.pipes[pipe.identity] = pipe

    def subscribe(self, topic: bytes) -> None:
        self._topics.append(topic)
        for pipe in self.pipes.values():
            pipe.there.send([b"\1" + topic])

    def greet(self, pipe: Pipe) -> None:
        """Connected; subscriptions that were made before are on their way already."""

    def lose(self, pipe: Pipe) -> None:
        """Takes note that the other end is gone; what came before it went can still be read."""
        if self.is_closed:
            return
        if self.kind == zmq.ROUTER:
            self._gone.append(pipe)
        elif self.kind == zmq.XPUB:
            self.pipes.pop(pipe.identity, None)
            kept = {topic for other in self.pipes.values() for topic in other.topics}
            self._requests.extend([b"\0" + topic] for topic in sorted(pipe.topics - kept))
            self.process.nudge()
        else:
            pipe.there.to = None

    def close(self, linger: int | None = None) -> None:
        if not self.is_closed:
            self.process.check()
            self._shut((self.linger if linger is None else linger) / 1000.0)
            if self._address:
                Path(self._address.removeprefix("ipc://")).unlink(missing_ok=True)

    def vanish(self) -> None:
        """Ends with its process."""
        self._shut(0.0)

    def _shut(self, linger_s: float) -> None:
        if self.is_closed:
            return
        self.is_closed = True
        self.process.sockets.remove(self)
        if self._world.listening.get(self._address) is self:
            del self._world.listening[self._address]
        for pipe in list(self.pipes.values()):
            pipe.close(self, linger_s)

    def last_word(self) -> float:
        """Returns when the last of what was sent arrives."""
        return max((pipe.lane_from(self).due for pipe in self.pipes.values()), default=0.0)

    # Receiving

    def take(self, pipe: Pipe, lane: Lane, frames: Frames) -> None:
        """Receives what has arrived."""
        if self.is_closed:
            return
        if self.kind == zmq.XPUB:
            mark, topic = frames[0][:1], frames[0][1:]
            if mark == b"\1":
                pipe.topics.add(topic)
            elif mark == b"\0":
                pipe.topics.discard(topic)
            self._requests.append(frames)
        else:
            lane.inbox.append(frames)
            self._full[pipe] = lane
        self.process.nudge()

    def _look(self) -> None:
        """Learns who has gone: what was sent to them before that goes nowhere, afterwards they cannot be reached."""
        while self._gone:
            self.pipes.pop(self._gone.pop().identity, None)

    def readable(self) -> bool:
        return bool(self._rest or self._full or self._requests)

    def _next(self) -> Frames:
        """Returns a whole message from any connection that has one."""
        if self.is_closed:
            raise zmq.ZMQError(zmq.ENOTSOCK)
        if not self.process.wait(self.readable, self._timeout_s):
            raise zmq.Again
        if self._requests:
            return self._requests.popleft()
        self._look()
        pipes = list(self._full)
        pipe = pipes[0] if len(pipes) == 1 else self._world.dice.choice(pipes)
        lane = self._full[pipe]
        frames = lane.inbox.popleft()
        if not lane.inbox:
            del self._full[pipe]
        self.context.watch.received(self, pipe, frames)
        return [pipe.identity, *frames] if self.kind == zmq.ROUTER else frames

    def recv(self) -> bytes:
        frames = self._rest or self._next()
        self._rest = frames[1:]
        return frames[0]

    def recv_multipart(self) -> Frames:
        frames, self._rest = self._rest or self._next(), []
        return frames

    def poll(self, timeout: int | None = None) -> int:
        if not self.readable():
            self.context.watch.at_rest(self.process)
        ready = self.process.wait(self.readable, None if timeout is None else timeout / 1000.0)
        return zmq.POLLIN if ready else 0

    # Sending

    def send(self, data: bytes, flags: int = 0) -> None:
        self.context.watch.step_over()
        if self.is_closed:
            raise zmq.ZMQError(zmq.ENOTSOCK)
        if self.kind == zmq.ROUTER and not self._begun and data not in self.pipes:
            raise zmq.ZMQError(zmq.EHOSTUNREACH)
        self._begun.append(data)
        if not flags & zmq.SNDMORE:
            frames, self._begun = self._begun, []
            self._emit(frames, bool(flags & zmq.DONTWAIT))

    def send_multipart(self, frames: Frames, flags: int = 0) -> None:
        for frame in frames[:-1]:
            self.send(frame, flags | zmq.SNDMORE)
        self.send(frames[-1], flags)

    def _emit(self, frames: Frames, at_once: bool) -> None:
        self.process.may_lose_the_processor()
        if self.kind == zmq.XPUB:
            self.context.watch.sent(self, None, frames)
            for pipe in self.pipes.values():
                if pipe.topics and any(frames[0].startswith(topic) for topic in pipe.topics) and not pipe.back.is_full:
                    pipe.back.send(frames)
            return
        if self.kind == zmq.ROUTER:
            pipe, frames = self.pipes.get(frames[0]), frames[1:]
        else:
            pipe = next(iter(self.pipes.values()))
        if pipe is None:
            raise zmq.ZMQError(zmq.EHOSTUNREACH)
        lane = pipe.lane_from(self)
        while lane.is_full:
            if at_once:
                self.context.watch.lost(self, pipe, frames)
                raise zmq.Again
            self.process.sleep(0.001)
        self.context.watch.sent(self, pipe, frames)
        if pipe not in self._gone:
            lane.send(frames)


class SimPoller:
    """Waits for several sockets, or anything else with ``readable``."""

    def __init__(self, process: Process, watch: Any) -> None:
        self._process, self._watch = process, watch
        self._watched: dict[Any, int] = {}

    def register(self, what: Any, flags: int = zmq.POLLIN) -> None:
        self._watched[what] = flags

    def unregister(self, what: Any) -> None:
        del self._watched[what]

    def poll(self, timeout: float | None = None) -> list[tuple[Any, int]]:
        watched = list(self._watched)
        if not any(what.readable() for what in watched):
            self._watch.at_rest(self._process)
        self._process.wait(
            lambda: any(what.readable() for what in watched), None if timeout is None else timeout / 1000.0
        )
        return [(what, zmq.POLLIN) for what in watched if what.readable()]


class SimContext:
    """The context of one process, with the machine it runs on."""

    def __init__(self, world: World, process: Process, watch: Any, machine: Any) -> None:
        self.world, self.process, self.watch, self.machine = world, process, watch, machine
        self._mine: list[SimSocket] = []

    def socket(self, kind: int) -> SimSocket:
        self.process.check()
        self._mine.append(SimSocket(self, kind))
        return self._mine[-1]

    def destroy(self, linger: int | None = None) -> None:
        """Closes every socket, and waits until what they sent has gone out, at most for the longest linger."""
        linger_s = (linger or 0) / 1000.0
        last = max((socket.last_word() for socket in self._mine), default=0.0)
        for socket in self._mine:
            socket.close(linger)
        if last > self.world.now and linger_s:
            self.process.sleep(min(last - self.world.now, linger_s))


MakeContext = Callable[[Any], SimContext]
