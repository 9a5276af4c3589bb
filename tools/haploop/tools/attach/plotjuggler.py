"""``haploop attach plotjuggler``: publishes every sample of one run after another for PlotJuggler's ZMQ subscriber.

A message is two frames, a topic and a msgpack array of samples with their own time.

PlotJuggler (its plugin DataStreamZMQ and its msgpack parser, from version 3.16 on) reads them as follows: each map of
the array is a point of the series ``topic/name`` for every number in it, at the time in the field that its user has
named (``timestamp``, s). One map without that field would switch its topic to the time of arrival for good, so every
map has it. A third frame is never sent: it would be one time for the whole message, and 3.16 and 3.17 read such a
message after its memory was freed (PlotJuggler #1416).
"""

from __future__ import annotations

import errno
import sys
from collections.abc import Iterator, Mapping
from itertools import groupby

import msgpack
import numpy as np
import zmq
from numpy.typing import NDArray

from haploop.launch.processes.run_directory import Elsewhere, LiveRun, RunNotFound
from haploop.logger.books.buffers import as_float64
from haploop.logger.log.channels import Channels, motion_columns
from haploop.logger.log.table import Floats, TableLayout
from haploop.protocol.changes import Event
from haploop.protocol.ticks import Timebase
from haploop.protocol.transport.clock_client import Refused
from haploop.protocol.transport.sockets import has_message, open_socket
from haploop.protocol.transport.wire import Frame
from haploop.tools.attach.observed_run import ObservedRun, iterate_runs
from haploop.tools.command.options import WRONG_USE, leave

ROLE = "plotjuggler"
# Wall time that goes into one message of each topic.
BATCH_S = 0.015
# The port at which PlotJuggler looks by default.
PORT = 9872
# Samples in one message at most, and messages kept for a viewer that does not read: together they bound the memory.
MOST_SAMPLES = 1000
_KEPT_MESSAGES = 500
# Subscriptions taken per call, so that a peer that floods the socket cannot hold the others up.
_AT_ONCE = 200


class PortTaken(Exception):
    """Raised where the port cannot be bound; the message says what to do."""


class MessageBatches:
    """Gathers the rows of channels, as a log's writer takes them, into messages; events are left out."""

    def __init__(self) -> None:
        self._numbers: dict[tuple[str, tuple[str, ...]], int] = {}
        self._channels: list[tuple[str, TableLayout]] = []
        self._rows: list[tuple[int, Floats]] = []

    def channel(
        self, topic: str, columns: Mapping[str, str], *, samples_per_message: int | None = None, title: str
    ) -> int:
        """Returns the number under which rows with these columns are written."""
        key = topic, tuple(columns)
        if key not in self._numbers:
            self._numbers[key] = len(self._channels)
            self._channels.append((topic, TableLayout(columns)))
        return self._numbers[key]

    def write(self, channel: int, log_times_ns: NDArray[np.int64], values: Floats) -> None:
        """Gathers rows, ``values`` of shape (..., columns)."""
        self._rows.append((channel, values.reshape(-1, values.shape[-1])))

    def message(self, channel: int, log_time_ns: int, obj: Event) -> None:
        """Ignores an event: it is not a number."""

    def take_messages(self, wanted: bool = True) -> Iterator[tuple[str, bytes]]:
        """Yields the rows since the last call as messages, (topic, msgpack), each topic's in the order of writing.

        The rows are dropped where they are not wanted.
        """
        rows, self._rows = self._rows, []
        if not wanted:
            return
        rows.sort(key=lambda written: self._channels[written[0]][0])
        for number, together in groupby(rows, key=lambda written: written[0]):
            topic, layout = self._channels[number]
            values = np.concatenate([block for _, block in together])
            for start in range(0, len(values), MOST_SAMPLES):
                yield topic, pack_array_of_maps(layout, values[start : start + MOST_SAMPLES])


def pack_array_of_maps(layout: TableLayout, values: Floats) -> bytes:
    """Returns rows as one msgpack array of maps; ``values`` of shape (rows, columns), ``layout`` that of one map."""
    maps = np.empty(len(values), layout.dtype)
    layout.stamp(maps)
    for view, column in zip(layout.views(maps), values.T, strict=True):
        view[:] = column
    return msgpack.Packer().pack_array_header(len(values)) + maps.tobytes()


class Outlet:
    """The socket that PlotJuggler connects to, on this machine only; a viewer that does not read loses messages.

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
            hint = "name another one with --port, and the same in PlotJuggler"
            raise PortTaken(f"{taken} ({error.strerror}); {hint}.") from error
        self.address = bytes(self._socket.getsockopt(zmq.LAST_ENDPOINT)).rstrip(b"\0").decode()

    @property
    def has_subscribers(self) -> bool:
        return bool(self._subscriptions)

    def take_subscriptions(self) -> None:
        for _ in range(_AT_ONCE):
            if not has_message(self._socket):
                return
            request = self._socket.recv()
            if request[:1] == b"\x01":
                self._subscriptions.add(request[1:])
            elif request[:1] == b"\x00":
                self._subscriptions.discard(request[1:])

    def send(self, topic: str, payload: bytes) -> None:
        """Sends a message to every subscriber who has room for it; never waits."""
        self._socket.send_multipart([topic.encode(), payload])

    def close(self) -> None:
        """Closes after at most half a second in which waiting messages are sent."""
        self._context.destroy(linger=500)


def attach_plotjuggler(run_id: str | Elsewhere | None, port: int) -> None:
    """Publishes runs until Ctrl-C; a run that was named, until it ends."""
    try:
        outlet = Outlet(port)
    except PortTaken as error:
        leave(str(error), WRONG_USE)
    print(f"publishing on {outlet.address}, for PlotJuggler's ZMQ Subscriber; Ctrl-C ends", file=sys.stderr)
    try:
        for run in iterate_runs(run_id):
            try:
                publish(run, outlet)
            except (RunNotFound, Refused) as error:
                print(error, file=sys.stderr)
    except KeyboardInterrupt:
        return
    finally:
        outlet.close()


def publish(run: LiveRun, outlet: Outlet) -> None:
    """Publishes a run from its present tick to its end; raises RunNotFound after that, Refused if no node may join."""
    with ObservedRun(run, ROLE) as observed:
        print(f"run {run.id}: {run.title}", file=sys.stderr)
        stream = SampleStream(Timebase(**observed.observer.welcome["timebase"]))
        try:
            for frames in observed.frames(BATCH_S):
                for role, frame in frames:
                    stream.ingest(role, frame)
                outlet.take_subscriptions()
                for topic, payload in stream.batches.take_messages(outlet.has_subscribers):
                    outlet.send(topic, payload)
        finally:
            print(f"run {run.id}: {observed.skipped_ticks} ticks skipped", file=sys.stderr)
    print(f"run {run.id} is over" + (f": {observed.failure}" if observed.failure else ""), file=sys.stderr)


class SampleStream:
    """Turns telemetry into the samples of the log, under the log's names; the state between two blocks comes once."""

    def __init__(self, time: Timebase) -> None:
        self.batches = MessageBatches()
        self._channels = Channels(self.batches, time, every_step=True)
        self._reached: tuple[int, dict[str, np.ndarray]] | None = None

    def ingest(self, role: str, frame: Frame) -> None:
        block = frame.as_dict()
        if frame.name == "PLANT_BLOCK":
            motion = motion_columns({name: as_float64(data) for name, data in block["columns"].items()})
            first, ticks = block["from_tick"], block["ticks"]
            self._channels.plant(first, ticks, motion)
            self._reached = first + ticks, {name: column[-1:] for name, column in motion.items()}
        elif frame.name == "CONTROLLER_BLOCK":
            self._channels.controller(block, 0)
        elif frame.name == "ENERGY_BLOCK":
            books = {name: as_float64(data) for name, data in block["columns"].items()}
            self._channels.energy(block["from_tick"], books)
        elif frame.name == "END" and role == "plant" and self._reached and self._reached[0] == block["tick"]:
            self._channels.plant_end(*self._reached)
