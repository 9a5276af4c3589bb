"""Telemetry: blocks from a publisher to any number of subscribers, none of which can hold the loop up."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import zmq

from haploop.protocol.transport.machine import machine_of
from haploop.protocol.transport.sockets import connect, has_message, open_socket
from haploop.protocol.transport.wire import Frame, Message, WireError, decode, encode

# A block of telemetry: from_tick, ticks, columns and what its sender adds (messages.py).
Block = Message
# Most requests taken at one block boundary, so that flooding a publisher cannot hold its node up.
_AT_ONCE = 200


class Publisher:
    """Publishes a node's stream of blocks.

    Each message is two frames: the publisher's role as topic, then the message. A new subscription is answered, at
    the next block boundary, with STATE; from its tick on the stream has no gap for whoever keeps up.

    Attributes:
        unknown_peers: frames that were no subscriptions to this stream.
    """

    def __init__(
        self, context: zmq.Context[zmq.Socket[bytes]], role: str, state: Callable[[], tuple[int, Message]]
    ) -> None:
        self.socket = open_socket(context, zmq.XPUB)
        self._topic = role.encode()
        self._state = state
        self.subscribed = False
        self.unknown_peers = 0

    def publish(self, name: str, *fields: Any) -> None:
        self.socket.send_multipart([self._topic, encode(name, *fields)])

    def serve(self) -> None:
        """Answers new subscriptions; to be called at block boundaries only, where the state is that of a tick."""
        new = False
        for _ in range(_AT_ONCE):
            if not has_message(self.socket):
                break
            request = self.socket.recv()
            if request[:1] == b"\x01" and self._topic.startswith(request[1:]):
                new = True
            elif request[:1] != b"\x00":
                self.unknown_peers += 1
        if new:
            self.subscribed = True
            self.publish("STATE", *self._state())

    def await_subscriber(self, idle: Callable[[], None]) -> None:
        """Waits for the first subscriber, calling ``idle`` now and then."""
        while not self.subscribed:
            if not self.socket.poll(100):
                idle()
            self.serve()


class Subscriber:
    """Receives from several publishers over one socket each; detects gaps by the ticks of the blocks.

    Args:
        endpoints: role -> its ``telemetry`` address and, where there are keys, its public ``key``.

    Attributes:
        gaps: number of ticks that never came, by role.
        malformed: frames that were no messages.
    """

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], endpoints: dict[str, dict[str, str]]) -> None:
        self._machine = machine_of(context)
        self._sockets: dict[zmq.Socket[bytes], str] = {}
        for role, of in endpoints.items():
            socket = open_socket(context, zmq.SUB)
            connect(socket, of["telemetry"], of.get("key"))
            socket.subscribe(role.encode())
            self._sockets[socket] = role
        self._next_tick: dict[str, int] = {}
        self.gaps = dict.fromkeys(endpoints, 0)
        self.malformed = 0

    @property
    def tick(self) -> int:
        """Returns the tick before which everything has come from every publisher, or never will."""
        return min(self._next_tick.values(), default=0) if len(self._next_tick) == len(self.gaps) else 0

    @property
    def slowest(self) -> str:
        """The publisher from which the least has arrived."""
        return min(self.gaps, key=lambda role: self._next_tick.get(role, -1))

    def register(self, poller: zmq.Poller) -> None:
        for socket in self._sockets:
            poller.register(socket, zmq.POLLIN)

    def receive(self, timeout_ms: int) -> list[tuple[str, Frame]]:
        """Waits at most ``timeout_ms`` for a message; returns all there are, (role, message)."""
        poller = self._machine.poller()
        self.register(poller)
        poller.poll(timeout_ms)
        return self.drain()

    def drain(self) -> list[tuple[str, Frame]]:
        """Returns the messages there are, (role, message), without those from before the publisher's STATE."""
        messages = []
        for socket, role in self._sockets.items():
            while has_message(socket):
                frame = self._read(socket)
                if frame and self._follows(role, frame):
                    messages.append((role, frame))
        return messages

    def _read(self, socket: zmq.Socket[bytes]) -> Frame | None:
        try:
            return decode(socket.recv_multipart()[-1])
        except WireError:
            self.malformed += 1
            return None

    def _follows(self, role: str, frame: Frame) -> bool:
        tick = frame.fields[0]
        if frame.name == "STATE":
            if role in self._next_tick:  # the answer to another subscriber
                return False
            self._next_tick[role] = tick
            return True
        if role not in self._next_tick or tick < self._next_tick[role]:
            return False
        self.gaps[role] += tick - self._next_tick[role]
        if frame.name != "END":
            self._next_tick[role] = tick + frame.fields[1]
        return True

    def close(self) -> None:
        for socket in self._sockets:
            socket.close(0)
