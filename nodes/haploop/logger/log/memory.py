"""A log that stays in memory, for a run whose results are wanted as arrays and not as a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgpack
import numpy as np
from numpy.typing import NDArray

from haploop.logger.log.recording import Recording, Rows, Table, join, merge_columns
from haploop.logger.log.table import Floats, pack


class MemoryLog:
    """Takes what :class:`haploop.logger.log.writer.Log` takes, and gives what reading its file would, bit for bit."""

    def __init__(self) -> None:
        self._channels: list[tuple[str, dict[str, str]]] = []
        self._units: dict[str, dict[str, str]] = {}
        self._pieces: dict[str, list[tuple[NDArray[np.uint64], Rows]]] = {}
        self._attachments: dict[str, bytes] = {}

    def channel(
        self, topic: str, columns: Mapping[str, str], *, samples_per_message: int | None = None, title: str
    ) -> int:
        """Register a channel, whatever the samples in a message and its title; for one known already, its number."""
        key = topic, dict(columns)
        if key not in self._channels:
            self._channels.append(key)
            self._units[topic] = merge_columns(self._units.get(topic, {}), columns)
            self._pieces.setdefault(topic, [])
        return self._channels.index(key)

    def write(self, channel: int, log_times_ns: NDArray[np.int64], values: Floats) -> None:
        """Add messages: values of shape (messages, columns), or (messages, samples, columns)."""
        topic, units = self._channels[channel]
        rows = values.reshape(-1, len(units))
        times = np.repeat(log_times_ns.astype(np.uint64), values[..., 0].size // max(1, len(values)))
        columns = ((name, np.ascontiguousarray(rows[:, number])) for number, name in enumerate(units))
        self._pieces[topic].append((times, Table(columns, units)))

    def message(self, channel: int, log_time_ns: int, obj: dict[str, Any]) -> None:
        """Add one map, as it would come back from a file."""
        topic, _ = self._channels[channel]
        self._pieces[topic].append((np.array([log_time_ns], np.uint64), [msgpack.unpackb(pack(obj))]))

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Keep a whole file, of any ``media_type``."""
        self._attachments[name] = data

    def flush(self) -> None:
        """Everything is where it can be read already."""

    def close(self) -> None:
        """There is nothing to close."""

    def recording(self) -> Recording:
        """All that was written, once: the log is empty afterwards."""
        topics = {topic: join(self._pieces.pop(topic), units)[1] for topic, units in self._units.items()}
        return Recording(topics, "", self._attachments)
