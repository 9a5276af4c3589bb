"""Frames that an unknown peer, a broken node or a typing error may send to the sockets of a run.

As a script, ``attacks.py DIRECTORY``: sends junk to all sockets there as fast as they take it, until ended.
"""

from __future__ import annotations

import math
import os
import random
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgpack
import zmq

PUBLISHERS = ("plant", "controller", "logger")
SOCKETS = ("clock", "loop", *PUBLISHERS)
# An XSUB keeps a long subscription as a tree so deep that libzmq cannot free it again; its limit is therefore low.
TOO_LARGE = {zmq.DEALER: 5 * 1024 * 1024, zmq.PUB: 5 * 1024 * 1024, zmq.XSUB: 5 * 1024}
MAX_WHOLE, MIN_WHOLE = 2**64 - 1, -(2**63)
# Time after which a test gives up.
_PATIENCE_MS = 120_000


_packer = msgpack.Packer(autoreset=True)


def pack(*items: Any) -> bytes:
    """A frame."""
    return _packer.pack(items)


def junk(seed: int = 1) -> list[bytes]:
    """Frames that are not messages: garbage, other versions, unknown codes, wrong, missing and surplus fields."""
    dice = random.Random(seed)
    good = [
        pack(1, 6, 5, {}),
        pack(1, 1, "observer", "", 1, {}, True, {}),
        pack(1, 13, "stop", {}),
        pack(1, 22, 0, [1.0]),
    ]
    frames = [b"", b"\0", b"\xc1", b"HELLO", b"GET / HTTP/1.1\r\n\r\n", b"\x80\x04N.", b"\xff" * 1000]
    frames += [dice.randbytes(dice.randint(1, 300)) for _ in range(50)]
    frames += [data[:cut] for data in good for cut in range(1, len(data))]
    versions = (0, 2, -1, 1.0, True, "1", None, [1], {}, math.nan, MAX_WHOLE)
    codes = (0, 99, -1, MAX_WHOLE, 6.0, True, "6", None, [], b"6")
    progress = ((), (1,), ("1", {}), (1.0, {}), (True, {}), (None, {}), (1, []), (1, {}, 2))
    frames += [pack(version, 13, "stop", {}) for version in versions]
    frames += [pack(1, code, 0) for code in codes]
    frames += [pack(1, 6, *fields) for fields in progress]
    frames += [head * depth + b"\x01" for head in (b"\x91", b"\x81\x01") for depth in (1000, 1020, 5000)]
    frames += [b"\x92" + b"\x91" * 1010 + b"\x02\x04", b"\x92\x01" + b"\x91" * 1010 + b"\x01"]
    frames += [b"\xdd\xff\xff\xff\xff", b"\xdf\xff\xff\xff\xff", b"\xc6\xff\xff\xff\xff", b"\x93\x01\x06\xc7\xff\x05"]
    return frames


def out_of_place() -> list[bytes]:
    """Valid messages from a peer that may not send them."""
    return [
        pack(1, 2, "run", {}, {}, {}, 0, {}),
        pack(1, 4, 0),
        pack(1, 5, 10_000, True, []),
        pack(1, 6, 1000, {"refused": 5}),
        pack(1, 7, 0, "you"),
        pack(1, 8, 0, "I say so"),
        pack(1, 9, 0, {}),
        pack(1, 10, 0, "I say so"),
        pack(1, 11, "I say so"),
        pack(1, 12, 0),
        pack(1, 20, ""),
        pack(1, 21, 0, [[0.0]]),
        pack(1, 22, 0, [1e6]),
        pack(1, 23, 0),
        pack(1, 30, 0, {}),
        pack(1, 34, 0, "", None),
    ]


def false_joins() -> list[bytes]:
    """Requests to take part that must not be granted."""
    own = [pack(1, 1, role, "0" * 32, 1, {}, True, {}) for role in PUBLISHERS]
    odd = [pack(1, 1, role, "", 1, {}, True, {}) for role in ("", "x" * 41, "\x1b[2J", "a\nb")]
    return own + odd + [pack(1, 1, "observer", "", 1, binds, True, {}) for binds in ({1: "x"}, {"x": 1}, {"x": [{}]})]


def impossible_commands() -> Iterator[tuple[Any, Any]]:
    """Verb and arguments of commands that cannot be carried out."""
    deep: Any = {}
    for _ in range(400):
        deep = {"kind": [deep]}
    damping = {"kind": "damping", "damping": 0.5}
    odd = (None, "x", math.nan, math.inf, [], deep)
    changes = (*odd, 1, {}, {1: 2}, {None: 1}, {"": 1}, {"kind": deep}, {"kind": None}, {**damping, 5: 6})
    settings = ({"wall.stiffness": None}, {"wall.stiffness": deep}, {"device.mass": 1.0}, {"wall": {"stiffness": 1.0}})
    for verb in ("", "Stop", "x" * 20_000, "__class__", "swap", "set"):
        yield verb, {}
    for key in ("self", "ticks", "", 5, None, b"x", True):
        yield "stop", {key: 1}
    for ticks in (*odd, 0, -1, 1.5, MIN_WHOLE):
        yield "step", {"ticks": ticks}
    for change in changes:
        yield "swap", {"swap": change}
    for value in (*odd, -1.0):
        yield "swap", {"swap": {"kind": "damping", "damping": value}}
    for element in (*odd[1:], -1, 2, 1.5, MAX_WHOLE):
        yield "swap", {"swap": damping, "element": element}
    for at in (*odd[1:], -math.inf, -1, 1e308, MAX_WHOLE):
        yield "swap", {"swap": damping, "at": at}
    yield "swap", {"swap": damping, "reload": True}
    for change in (*odd, 1, *changes[8:], *settings):
        yield "set", {"set": change}


class Stranger:
    """A DEALER that sends to one socket of a run and receives the replies."""

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], path: Path) -> None:
        self.socket = context.socket(zmq.DEALER)
        self.socket.linger = 0
        self.socket.connect(f"ipc://{path}")

    def __enter__(self) -> Stranger:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close(0)

    def ask(self, *frames: bytes) -> list[Any]:
        """Sends one message and returns the answer: its code and fields."""
        self.socket.send_multipart(frames)
        assert self.socket.poll(_PATIENCE_MS), f"no answer to {frames!r:.200}"
        return msgpack.unpackb(self.socket.recv(), strict_map_key=False)[1:]


def send_unasked(context: zmq.Context[zmq.Socket[bytes]], path: Path) -> list[zmq.Socket[bytes]]:
    """Sends junk, messages out of place, oversized ones and bytes that are not ZeroMQ to one socket of a run.

    Returns the sockets, still open, so that the sending continues while the run does.
    """
    topics = (path.stem.encode(), b"", b"junk", b"\xff")
    frames = [pack(1, 20, "0" * 32), *false_joins(), *out_of_place(), *junk(), pack(1, 22, 0, [MAX_WHOLE] * 10_000)]
    frames += [mark + topic for mark in (b"\0", b"\1") for topic in topics]
    opened = []
    for kind in (zmq.XSUB,) if path.stem in PUBLISHERS else (zmq.DEALER, zmq.PUB):
        sender = context.socket(kind)
        sender.linger = 0
        sender.connect(f"ipc://{path}")
        opened.append(sender)
        for message in (*([frame] for frame in frames), [b""] * 20, frames[:50], [b"\x01" + bytes(TOO_LARGE[kind])]):
            _send(sender, message)
    no_zeromq(path)
    return opened


def _send(sender: zmq.Socket[bytes], frames: list[bytes]) -> None:
    with suppress(zmq.Again):  # its queue is full: enough has been sent
        sender.send_multipart(frames, zmq.DONTWAIT)


def no_zeromq(path: Path) -> None:
    """Sends raw bytes instead of a ZeroMQ greeting, a greeting without its end, and nothing at all."""
    greeting = b"\xff" + bytes(8) + b"\x7f\x03\x00NULL" + bytes(48)
    for data in (os.urandom(2000), b"GET / HTTP/1.1\r\n\r\n", greeting[:20], greeting, greeting + os.urandom(500), b""):
        with socket.socket(socket.AF_UNIX) as raw, suppress(OSError):  # not listening yet, or thrown out already
            raw.connect(str(path))
            raw.sendall(data)


def flood(directory: Path) -> None:
    """Sends junk to all sockets without end."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    frames = [*junk(), *out_of_place()]
    senders = []
    for name in SOCKETS:
        sender = context.socket(zmq.XSUB if name in PUBLISHERS else zmq.DEALER)
        sender.connect(f"ipc://{directory / name}.sock")
        senders.append(sender)
    print("flooding", flush=True)
    end = time.monotonic() + 60
    while time.monotonic() < end:
        for sender in senders:
            for frame in frames:
                _send(sender, [frame])


if __name__ == "__main__":
    flood(Path(sys.argv[1]))
