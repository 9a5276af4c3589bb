"""What PlotJuggler's ZMQ subscriber takes: two frames, a topic and a msgpack array of samples with their own time.

As PlotJuggler reads them (its plugin DataStreamZMQ and its msgpack parser, from version 3.16 on): each map of the array
is a point of the series ``topic/name`` for every number in it, at the time in the field that its user has named
(``timestamp``, s). One map without that field would put its topic on the time of arrival for good, so every map
has it. A third frame is never sent: it would be one time for the whole message, and 3.16 and 3.17 read such a message
after its memory was given back (PlotJuggler #1416).
"""

from __future__ import annotations

import errno
from collections.abc import Iterator, Mapping
from itertools import groupby
from typing import Any

import msgpack
import numpy as np
import zmq
from numpy.typing import NDArray

from haploop.logger.log.table import Floats, TableLayout
from haploop.protocol.sockets import has_message, open_socket

# Where PlotJuggler looks unless told otherwise.
PORT = 9872
# Samples in one message at most, and messages kept for a viewer that does not read: together they bound the memory.
MOST_SAMPLES = 1000
_KEPT_MESSAGES = 500
# Subscriptions taken at one turn, so that nobody who floods the socket can hold the others up.
_AT_ONCE = 200


class PortTaken(Exception):
    """The port cannot be bound; the message says what to do."""


class Batches:
    """Takes channels as a log file does and hands them out as messages: no events, since those are no numbers."""

    def __init__(self) -> None:
        self._numbers: dict[tuple[str, tuple[str, ...]], int] = {}
        self._channels: list[tuple[str, TableLayout]] = []
        self._rows: list[tuple[int, Floats]] = []

    def channel(
        self, topic: str, columns: Mapping[str, str], *, samples_per_message: int | None = None, title: str
    ) -> int:
        """The number under which rows with these columns are written."""
        key = topic, tuple(columns)
        if key not in self._numbers:
            self._numbers[key] = len(self._channels)
            self._channels.append((topic, TableLayout(columns)))
        return self._numbers[key]

    def write(self, channel: int, log_times_ns: NDArray[np.int64], values: Floats) -> None:
        """Gather rows; shape of values: (..., columns)."""
        self._rows.append((channel, values.reshape(-1, values.shape[-1])))

    def message(self, channel: int, log_time_ns: int, obj: dict[str, Any]) -> None:
        """Events go nowhere."""

    def take(self, wanted: bool = True) -> Iterator[tuple[str, bytes]]:
        """Messages of the rows since the last call, (topic, msgpack): each topic's in the order they were written.

        Nothing when they are not wanted; the rows are gone all the same.
        """
        rows, self._rows = self._rows, []
        if not wanted:
            return
        rows.sort(key=lambda written: self._channels[written[0]][0])
        for number, together in groupby(rows, key=lambda written: written[0]):
            topic, layout = self._channels[number]
            values = np.concatenate([block for _, block in together])
            for start in range(0, len(values), MOST_SAMPLES):
                yield topic, array_of_maps(layout, values[start : start + MOST_SAMPLES])


def array_of_maps(layout: TableLayout, values: Floats) -> bytes:
    """Rows as one msgpack array of maps; ``values`` of shape (rows, columns), ``layout`` that of one map."""
    maps = np.empty(len(values), layout.dtype)
    layout.stamp(maps)
    for view, column in zip(layout.views(maps), values.T, strict=True):
        view[:] = column
    return msgpack.Packer().pack_array_header(len(values)) + maps.tobytes()


class Outlet:
    """The socket that PlotJuggler connects to, on this machine only; a viewer that does not read loses messages.

    Attributes:
        address: where to connect.

    Raises:
        PortTaken: another program has the port.
    """

    def __init__(self, port: int) -> None:
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._socket = open_socket(self._context, zmq.XPUB)
        self._socket.setsockopt(zmq.SNDHWM, _KEPT_MESSAGES)
        self._subscriptions: set[bytes] = set()
        try:
            self._socket.bind(f"tcp://127.0.0.1:{port or '*'}")
        except zmq.ZMQError as error:
            self._context.destroy(linger=0)
            taken = f"Port {port} is taken" if error.errno == errno.EADDRINUSE else f"Port {port} cannot be used"
            raise PortTaken(
                f"{taken} ({error.strerror}); name another one with --port, and the same in PlotJuggler."
            ) from error
        self.address = bytes(self._socket.getsockopt(zmq.LAST_ENDPOINT)).rstrip(b"\0").decode()

    @property
    def is_heard(self) -> bool:
        """Whether anyone listens."""
        return bool(self._subscriptions)

    def listen(self) -> None:
        """Take note of who has come and gone."""
        for _ in range(_AT_ONCE):
            if not has_message(self._socket):
                return
            request = self._socket.recv()
            if request[:1] == b"\x01":
                self._subscriptions.add(request[1:])
            elif request[:1] == b"\x00":
                self._subscriptions.discard(request[1:])

    def send(self, topic: str, payload: bytes) -> None:
        """Send a message to everyone who has room for it; never waits."""
        self._socket.send_multipart([topic.encode(), payload])

    def close(self) -> None:
        """Send what can be sent in half a second, and close."""
        self._context.destroy(linger=500)
