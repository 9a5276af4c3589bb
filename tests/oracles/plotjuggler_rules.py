"""A subscriber that follows PlotJuggler's rules: its ZMQ plugin and msgpack parser, version 3.16, in Python."""

from __future__ import annotations

import math
import time
from collections import defaultdict
from typing import Any, Self

import msgpack
import numpy as np
import zmq

STAMP = "timestamp"


class Parser:
    """Series of one topic: every number of every map, at the map's own time as long as every map had one.

    Attributes:
        series: name -> points (time in s, value).
        samples: the maps received, in order.
    """

    def __init__(self, topic: str) -> None:
        self._topic = topic
        self._use_stamp = True
        self.series: dict[str, list[tuple[float, float]]] = defaultdict(list)
        self.samples: list[dict[str, float]] = []

    def parse(self, message: Any, t: float) -> float:
        """Takes a message that arrived at time ``t``; returns the time of its last sample.

        A sample without a time gets that of the one before it in the message, and from then on no time is looked for.
        """
        if isinstance(message, list):
            for element in message:
                t = self.parse(element, t)
            return t
        assert isinstance(message, dict)
        self.samples.append(message)
        if self._use_stamp:
            stamp = message.get(STAMP)
            self._use_stamp = isinstance(stamp, int | float)
            t = stamp if isinstance(stamp, int | float) else t
        self._flatten(self._topic, message, t)
        return t

    def _flatten(self, prefix: str, value: Any, t: float) -> None:
        if isinstance(value, dict):
            for key, inner in value.items():
                self._flatten(f"{prefix}/{key}", inner, t)
        elif isinstance(value, list):
            for index, inner in enumerate(value):
                self._flatten(f"{prefix}[{index}]", inner, t)
        elif isinstance(value, bool | int | float) and math.isfinite(value):
            self.series[prefix].append((t, float(value)))

    def column(self, name: str) -> np.ndarray:
        """One number of every sample, NaN where it had none, shape (samples,)."""
        return np.array([sample.get(name, math.nan) for sample in self.samples])


class Viewer:
    """The subscriber; attributes: ``parsers`` by topic."""

    def __init__(self, address: str, kept_messages: int = 1000) -> None:
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._socket = self._context.socket(zmq.SUB)
        self._socket.setsockopt(zmq.RCVHWM, kept_messages)
        self._socket.connect(address)
        self._socket.subscribe(b"")
        self.parsers: dict[str, Parser] = {}

    def read(self, timeout_ms: int) -> str | None:
        """Takes one message; returns its topic, or None when none came."""
        if not self._socket.poll(timeout_ms):
            return None
        frames = self._socket.recv_multipart()
        assert len(frames) == 2, "with a third frame PlotJuggler reads the message from memory it gave back"
        topic = frames[0].decode()
        self.parsers.setdefault(topic, Parser(topic)).parse(msgpack.unpackb(frames[1]), time.time())
        return topic

    def read_to(self, topic: str) -> None:
        """Reads until a message of this topic comes."""
        while True:
            came = self.read(120_000)
            assert came is not None, f"nothing more came, not even {topic}"
            if came == topic:
                return

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._context.destroy(linger=0)
