"""A node's connection to the clock: joins, works no further than granted, reports, leaves."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import zmq

from haploop.protocol.changes import Event
from haploop.protocol.transport.connection import Connection
from haploop.protocol.transport.machine import machine_of
from haploop.protocol.transport.messages import PROCESSES
from haploop.protocol.transport.sockets import (
    SecureContext,
    connect,
    has_message,
    open_socket,
    send_at_once,
    transport_of,
    with_host_of,
)
from haploop.protocol.transport.wire import Frame, Message, WireError, decode, encode

# A node that waits reports it this often, so that the clock can tell who is being waited for.
REPORT_MS = 200
_JOIN_S = 20.0
_LOOK_MS = 250
_GRACE_S = 2.0
_LOST = "Nothing has come from the run at {} for {:g} s: the network connection is cut, or its launcher was ended."
_PROGRAM = {"name": "haploop"}


class Aborted(Exception):
    """Raised where the clock has ended the run because something failed elsewhere; the message says what."""


class Refused(Exception):
    """Raised where the clock does not let this node join; the message says why."""


class ClockClient:
    """Speaks to the clock for one node.

    Args:
        is_watched: whether a local connection is watched too, as one over a network always is.

    Attributes:
        until: ticks before this one may be worked on.
        last: whether no further ticks will be granted.
        events: granted events not yet taken, (tick, event), in order.
        malformed: frames from the clock's address that were no messages.
        refused: the reason of the clock's last REFUSED, "" for none; after joining, it means that the clock has dropped
            this node.
    """

    def __init__(
        self,
        context: zmq.Context[zmq.Socket[bytes]],
        role: str,
        address: str,
        secret: str,
        is_watched: bool = False,
    ) -> None:
        self.role, self._secret = role, secret
        self.socket = open_socket(context, zmq.DEALER)
        self._address = address
        transport = transport_of(context)
        self._connection = None
        if (is_watched or address.startswith("tcp:")) and isinstance(context, SecureContext):
            self._connection = Connection(context, self.socket, address)
        # The run has dropped one of its own processes that is cut off; to any other node the last messages of the run
        # may still be on their way.
        self._grace_s = 0.0 if role in PROCESSES else _GRACE_S
        self._lost = _LOST.format(address.removeprefix("tcp://"), transport.patience_s)
        connect(self.socket, address)
        self._now, self._due = machine_of(context).now, 0.0
        self.until = 0
        self.last = False
        self.events: list[tuple[int, Event]] = []
        self.malformed = 0
        self.refused = ""

    def join(
        self, endpoints: dict[str, str], lossless: bool = True, goes_on: Callable[[], bool] = lambda: True
    ) -> Message:
        """Asks to take part, waits for the WELCOME and returns its fields by name.

        Args:
            goes_on: tells whether the run is still there; called four times a second while nothing comes.

        Raises:
            Refused: the clock refused, could not be reached, sent nothing for 20 s, or the run has ended.
            Aborted: the run failed before it began.
        """
        if any(with_host_of(address, "") != address for address in endpoints.values()):
            from haploop.protocol.transport.addresses import own_address_towards

            mine = own_address_towards(self._address)
            endpoints = {channel: with_host_of(address, mine) for channel, address in endpoints.items()}
        self._say("JOIN", self.role, self._secret, os.getpid(), endpoints, lossless, _PROGRAM)
        for _ in range(int(_JOIN_S * 1000 / _LOOK_MS)):
            if not self.socket.poll(_LOOK_MS):
                if self._connection and (why := self._connection.trouble()):
                    raise Refused(why)
                if self._connection and self._connection.lost_s() > self._grace_s:
                    raise Refused(self._lost)
                if not goes_on():
                    raise Refused("The run has ended.")
                continue
            frame = self._receive()
            if frame and frame.name == "WELCOME":
                welcome = frame.as_dict()
                self.until = welcome["granted"]
                for addresses in welcome["endpoints"].values():
                    addresses |= {name: with_host_of(text, self._address) for name, text in addresses.items()}
                return welcome
            if frame and frame.name == "REFUSED":
                raise Refused(frame.fields[0])
        raise Refused(f"The clock did not answer within {_JOIN_S:g} s; is the run still there?")

    def _say(self, name: str, *fields: Any) -> None:
        """Sends a message, once there is room; if the connection is down, it is lost, and other calls report why."""
        frame = encode(name, *fields)
        self._due = self._now() + REPORT_MS / 1000
        if not send_at_once(self.socket, frame) and not (self._connection and self._connection.is_down()):
            self.socket.send(frame)

    def poll(self) -> None:
        """Takes what the clock has sent, without waiting; raises Aborted if its host can no longer be reached."""
        while has_message(self.socket):
            self._receive()
        if self._connection and self._connection.lost_s() > self._grace_s:
            raise Aborted(self._lost)

    def hears(self, most_ms: int) -> bool:
        """Waits for a message of the clock, and takes all there are; returns False when none came in time."""
        heard = bool(self.socket.poll(most_ms))
        self.poll()
        return heard

    def wait(self, tick: int) -> None:
        """Waits for a message of the clock; after 0.2 s without one, reports WAITING."""
        if not self.hears(REPORT_MS):
            self.waiting(tick, "clock")

    def _receive(self) -> Frame | None:
        try:
            frame = decode(self.socket.recv())
        except WireError:
            self.malformed += 1
            return None
        if frame.name == "GRANT":
            until, self.last, events = frame.fields
            self.until = max(self.until, until)
            self.events += [(tick, event) for tick, event in events]
        elif frame.name == "ABORT":
            raise Aborted(frame.fields[0])
        elif frame.name == "REFUSED":
            self.refused = frame.fields[0]
        return frame

    def take_events(self) -> list[tuple[int, Event]]:
        events, self.events = self.events, []
        return events

    def ready(self, tick: int) -> None:
        """Reports that all connections stand and that work starts at ``tick``."""
        self._say("READY", tick)

    def progress(self, tick: int, status: Message | None = None) -> None:
        """Reports that every tick before ``tick`` is done."""
        self._say("PROGRESS", tick, status or {})

    def waiting(self, tick: int, on: str) -> None:
        """Reports that this node is alive and waits for the process ``on``."""
        self._say("WAITING", tick, on)

    @property
    def is_quiet(self) -> bool:
        """True where nothing has been said for 0.2 s."""
        return self._now() >= self._due

    def keep_in_touch(self, tick: int, on: str) -> None:
        """Reports WAITING, and takes what the clock has sent, if a node at work has been quiet."""
        if self._now() >= self._due:  # checked with every message of the loop
            self.waiting(tick, on)
            self.poll()

    def ended(self, tick: int, reason: str) -> None:
        """Reports that the plant ended the run by itself."""
        self._say("ENDED", tick, reason)

    def leave(self, name: str, *fields: Any) -> None:
        """Sends DONE, FAILED or LEAVE, allows it 1 s to go out, and closes."""
        self._say(name, *fields)
        self.close(linger_ms=1000)

    def leave_at_the_end(self, tick: int, result: Message) -> None:
        """Sends DONE, and closes once the clock has closed: until then what was published may still be on its way.

        Raises Aborted where the run fails meanwhile.
        """
        self._say("DONE", tick, result)
        while self._connection and not self._connection.is_down():
            if self.socket.poll(_LOOK_MS):
                self._receive()
        self.close()

    def close(self, linger_ms: int = 0) -> None:
        """Closes the connection; what was sent last has some time to go out."""
        if self._connection:  # while it closes it must report no events of its connection: it could wait for ever
            self.socket.disable_monitor()
        self.socket.close(linger=linger_ms)
