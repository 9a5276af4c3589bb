"""The direct connection of plant and controller: every message carries its tick, every answer is checked."""

from __future__ import annotations

import math
from collections.abc import Callable
from reprlib import repr as shortened
from struct import Struct

import msgpack
import zmq

from haploop.protocol.transport.clock_client import REPORT_MS
from haploop.protocol.transport.messages import MESSAGES, VERSION
from haploop.protocol.transport.sockets import bare_send, connect, open_socket
from haploop.protocol.transport.wire import Frame, WireError, decode, encode

_COMMANDS = MESSAGES["COMMANDS"].code
_SAMPLES = MESSAGES["SAMPLES"].code
_LAST = MESSAGES["LAST"].code

# True equals 1, and so does 1.0; the types of received values are checked too.
_NUMBERS = frozenset({int, float})

# Without delay a message holds one number. Its bytes are msgpack's: four entries, version and code; the tick as uint32;
# a list of one sample of one float64, or of one force. Packing and recognising them in one step is three times as fast.
_SAMPLE, _COMMAND = Struct(">4sI3sd"), Struct(">4sI2sd")
_SAMPLE_BEGINS, _COMMAND_BEGINS = (bytes((0x94, VERSION, code, 0xCE)) for code in (_SAMPLES, _COMMANDS))
_SAMPLE_LIST, _COMMAND_LIST = b"\x91\x91\xcb", b"\x91\xcb"
_LATEST = 2**32 - 1
# A plain int, which is faster to pass than zmq's own constant.
_MORE = int(zmq.SNDMORE)

# A controller that gets no samples turns to its other work this often.
IDLE_MS = 20

Idle = Callable[[], None]


class LoopError(RuntimeError):
    """Raised on a gap, a repeat or a wrong tick between plant and controller."""


class PlantEnd:
    """The plant's end of the connection: a ROUTER, so that an unknown peer gets nothing and disturbs nothing.

    ``idle`` is called now and then while an answer is awaited.
    """

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], idle: Idle) -> None:
        self.socket = open_socket(context, zmq.ROUTER)
        self.socket.setsockopt(zmq.RCVTIMEO, REPORT_MS)
        self._idle = idle
        self._partner = b""
        self.unknown_peers = 0
        self._pack = msgpack.Packer(autoreset=True).pack
        self._emit = bare_send(self.socket)

    def greet(self, secret: str) -> None:
        """Waits for the controller, known by the run's secret, and answers its HELLO."""
        while True:
            sender, data = self._receive()
            if _is_hello(data, secret):
                self._partner = sender
                self._send(encode("HELLO", secret))
                return
            self.unknown_peers += 1

    def exchange(self, tick: int, samples: list[tuple[float, ...]]) -> list[float]:
        """Sends the samples of the ticks from ``tick`` on and returns the forces that answer them, N.

        Raises LoopError where the answer is for other ticks.
        """
        emit, partner = self._emit, self._partner
        if len(samples) == 1 and len(samples[0]) == 1 and tick <= _LATEST:
            frame = _SAMPLE.pack(_SAMPLE_BEGINS, tick, _SAMPLE_LIST, samples[0][0])
        else:
            frame = self._pack((VERSION, _SAMPLES, tick, samples))
        try:
            emit(partner, _MORE)
            emit(frame)
        except zmq.ZMQError as error:
            _raise_unless_gone(error)
        sender, data = self._receive()
        while sender != partner:
            self.unknown_peers += 1
            sender, data = self._receive()
        if len(data) == _COMMAND.size and len(samples) == 1:
            begins, of, form, force = _COMMAND.unpack(data)
            if of == tick and begins == _COMMAND_BEGINS and form == _COMMAND_LIST:
                return [force]
        try:
            *head, forces = msgpack.unpackb(data)
            are_whole = head == [VERSION, _COMMANDS, tick] and type(head[0]) is type(head[1]) is type(head[2]) is int
            is_answer = are_whole and type(forces) is list and len(forces) == len(samples)
            if is_answer and _NUMBERS.issuperset(map(type, forces)):
                return forces
        except Exception as error:  # whatever came is no answer
            raise LoopError(_mismatch("commands", tick, len(samples), data)) from error
        raise LoopError(_mismatch("commands", tick, len(samples), data))

    def close(self, tick: int) -> None:
        """Tells the controller that the run ends at ``tick``."""
        self._send(encode("LAST", tick))

    def _send(self, data: bytes) -> None:
        try:
            self._emit(self._partner, _MORE)
            self._emit(data)
        except zmq.ZMQError as error:
            _raise_unless_gone(error)

    def _receive(self) -> tuple[bytes, bytes]:
        while True:
            try:
                sender = self.socket.recv()
            except zmq.Again:
                self._idle()
                continue
            data = b"" if sender != self._partner else self.socket.recv()
            if not data:  # an unknown peer may have sent any number of frames; the controller sends one
                while self.socket.rcvmore:
                    data = self.socket.recv()
            return sender, data


class ControllerEnd:
    """The controller's end of the connection: a DEALER that knows only the plant.

    ``plant`` holds its ``loop`` address and, where there are keys, its public ``key``; ``idle`` is called every 20 ms
    while samples are awaited.
    """

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], plant: dict[str, str], idle: Idle) -> None:
        self._idle = idle
        self.socket = open_socket(context, zmq.DEALER)
        self.socket.setsockopt(zmq.RCVTIMEO, IDLE_MS)
        connect(self.socket, plant["loop"], plant.get("key"))
        self._pack = msgpack.Packer(autoreset=True, default=float).pack  # an element may give a number of another type
        self._emit = bare_send(self.socket)

    def greet(self, secret: str) -> None:
        """Sends HELLO with the run's secret and waits for the plant's answer."""
        self.socket.send(encode("HELLO", secret))
        if not _is_hello(self._receive(), secret):
            raise LoopError("The plant's greeting did not carry the secret of this run.")

    def samples(self, tick: int) -> list[list[float]] | None:
        """Waits for the next samples, which must start at ``tick``; returns None when the run ends there.

        Raises LoopError where samples of other ticks came, or none will come although some are missing.
        """
        data = self._receive()
        if len(data) == _SAMPLE.size:
            begins, of, form, x = _SAMPLE.unpack(data)
            if of == tick and begins == _SAMPLE_BEGINS and form == _SAMPLE_LIST:
                return [[x]]
        try:
            *head, samples = msgpack.unpackb(data)
            are_whole = type(head[0]) is type(head[1]) is type(head[-1]) is int
            if are_whole and head == [VERSION, _SAMPLES, tick] and type(samples) is list:
                return samples
            if are_whole and head == [VERSION, _LAST] and type(samples) is int and samples <= tick:
                return None
        except Exception as error:  # whatever came is no sample
            raise LoopError(_mismatch("samples", tick, None, data)) from error
        raise LoopError(_mismatch("samples", tick, None, data))

    def answer(self, tick: int, forces: list[float]) -> None:
        """Sends the forces of the ticks from ``tick`` on, N."""
        if len(forces) == 1 and forces[0].__class__ is float and tick <= _LATEST:
            self._emit(_COMMAND.pack(_COMMAND_BEGINS, tick, _COMMAND_LIST, forces[0]))
        else:
            self._emit(self._pack((VERSION, _COMMANDS, tick, forces)))

    def _receive(self) -> bytes:
        while True:
            try:
                return self.socket.recv()
            except zmq.Again:
                self._idle()


def check_samples(tick: int, samples: list[list[float]], values: int) -> None:
    """Raises LoopError where a sample of a foreign plant is not a list of ``values`` finite numbers."""
    for at, sample in enumerate(samples, tick):
        is_list = type(sample) is list and len(sample) == values
        if not is_list or not all(type(value) in (int, float) and math.isfinite(value) for value in sample):
            raise LoopError(
                f"The plant's sample of tick {at} must be a list of {values} finite number{'s' * (values > 1)}, "
                f"but {shortened(sample)[:80]} was received."
            )


def _raise_unless_gone(error: zmq.ZMQError) -> None:
    """Ignores that the controller has gone, which the clock notices too and deals with; raises any other error."""
    if error.errno != zmq.EHOSTUNREACH:
        raise error


def _is_hello(data: bytes, secret: str) -> bool:
    try:
        return decode(data) == Frame("HELLO", [secret])
    except WireError:
        return False


def _mismatch(what: str, tick: int, count: int | None, data: bytes) -> str:
    expected = f"{what} from tick {tick}" + (f", {count} of them," if count else "")
    try:
        name, fields = decode(data)
        came = f"{name} of tick {fields[0]} with {shortened(fields[1:])[:80]}"
    except WireError as error:
        came = f"something else ({str(error).rstrip('.')})"
    return f"In the loop, {expected} were expected, but {came} was received."
