"""The log file of a run: MCAP, written a block of ticks at a time, readable up to its last chunk whatever happens.

The frame of the file is made of the ``mcap`` library's own records. What is written a thousand times a second, the
message records inside a chunk and their index, is composed by NumPy (``haploop.logger.log.chunk``), since the
library's writer needs a Python call, and some microseconds, for every message.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import Self

import numpy as np
from mcap.records import Attachment, AttachmentIndex, Channel, Schema
from numpy.typing import NDArray

from haploop.logger.log.chunk import Compression, FreeRows, TableRows, chunk
from haploop.logger.log.mcap_file import McapFile, bytes_of
from haploop.logger.log.table import Floats, TableLayout, pack
from haploop.protocol.changes import Event
from haploop.protocol.transport.machine import MACHINE, Machine

# Bytes of messages after which a chunk is closed: the least that a reader must unpack to reach one message.
_CHUNK_BYTES = 1 << 20


class Log:
    """One MCAP file; methods that write to it raise LogError where the operating system refuses.

    Messages gather in a chunk, which reaches the operating system when it passes 1 MB or at ``flush``; from then
    on nothing of it is lost when this process ends. Inside a chunk messages stand channel by channel; readers
    put them in the order of log time. Log time and publish time are the simulated time in ns.
    """

    def __init__(self, path: str | Path, *, compression: Compression = "lz4", machine: Machine = MACHINE) -> None:
        """Begins the file, and overwrites any file of that name."""
        self._compression: Compression = compression
        self._tables: dict[int, TableLayout] = {}
        self._known: dict[Hashable, int] = {}
        self._rows: dict[int, TableRows | FreeRows] = {}
        self._file = McapFile(path, machine)
        # Number of channels that are described in a chunk, too, not only outside of any.
        self._described = 0

    def channel(
        self, topic: str, columns: Mapping[str, str], *, samples_per_message: int | None = None, title: str
    ) -> int:
        """Registers a channel and returns its number; if it is registered already, the number it has.

        The same topic may be registered again with other columns: ``haploop.logger.read`` joins its channels.

        Args:
            topic: such as ``/plant``.
            columns: unit by column name ("" for a pure number); empty for free maps, see ``message``.
            samples_per_message: None for messages that are one map; else a message is an array of this many maps, 1 at
                least (ValueError).
            title: what the channel holds, for human readers; also the name of its schema.
        """
        key = (topic, tuple(columns.items()), samples_per_message, title)
        if key in self._known:
            return self._known[key]
        layout = TableLayout(columns, samples_per_message)
        number = len(self._known) + 1
        schema = Schema(id=number, data=layout.json_schema(title), encoding="jsonschema", name=title)
        channel = Channel(id=number, topic=topic, message_encoding="msgpack", metadata={}, schema_id=number)
        self._file.append(bytes_of(schema, channel))
        self._file.schemas.append(schema)
        self._file.channels.append(channel)
        self._file.message_counts[number] = 0
        if columns:
            self._tables[number] = layout
        self._known[key] = number
        return number

    def write(self, channel: int, log_times_ns: NDArray[np.int64], values: Floats) -> None:
        """Adds messages to a channel with columns.

        Args:
            channel: its number.
            log_times_ns: simulated time in ns, from 0 up, shape (messages,).
            values: shape (messages, columns), or (messages, samples, columns) where the channel has samples.

        Raises:
            ValueError: a channel without columns, a wrong shape, or a time before 0.
        """
        layout, messages = self._tables.get(channel), len(log_times_ns)
        if layout is None:
            raise ValueError(f"Channel {channel} has no columns: its messages come through message().")
        shape = (messages, *(() if layout.samples is None else (layout.samples,)), len(layout.columns))
        if values.shape != shape:
            raise ValueError(f"Values of shape {shape} were expected on channel {channel}, but came as {values.shape}.")
        if not messages:
            return
        if log_times_ns.min() < 0:
            raise ValueError(f"A log time must be 0 or later, but {log_times_ns.min()} ns came on channel {channel}.")
        if not isinstance(rows := self._rows.get(channel), TableRows):
            rows = self._rows[channel] = TableRows(channel, layout)
        rows.append(self._file.message_counts[channel] + rows.count, log_times_ns, values)
        self._close_full_chunk()

    def message(self, channel: int, log_time_ns: int, obj: Event) -> None:
        """Adds one map to a channel without columns (ValueError for another); ``obj`` holds what msgpack can carry."""
        if channel in self._tables:
            raise ValueError(f"Channel {channel} has columns: its messages come through write().")
        if not isinstance(rows := self._rows.get(channel), FreeRows):
            rows = self._rows[channel] = FreeRows(channel)
        rows.append(self._file.message_counts[channel] + rows.count, log_time_ns, pack(obj))
        self._close_full_chunk()

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Puts a whole file, such as the scene, into the log."""
        start = self._file.size
        self._file.append(bytes_of(Attachment(create_time=0, log_time=0, name=name, media_type=media_type, data=data)))
        self._file.attachments.append(
            AttachmentIndex(start, self._file.size - start, 0, 0, len(data), name=name, media_type=media_type)
        )

    def _close_full_chunk(self) -> None:
        if sum(rows.size for rows in self._rows.values()) >= _CHUNK_BYTES:
            self.flush()

    def flush(self) -> None:
        """Closes the chunk and hands it to the operating system: every message up to now can be read from the file."""
        held = [rows for rows in self._rows.values() if rows.count]
        if not held:
            return
        # Outside of a chunk no checksum protects the descriptions of the numbers, so they are repeated inside.
        new = range(self._described, len(self._file.channels))
        described = bytes_of(*(one for at in new for one in (self._file.schemas[at], self._file.channels[at])))
        piece, index = chunk(held, self._file.size, self._compression, described)
        self._file.append_chunk(piece, index)
        self._described = new.stop
        # A channel that was silent in this chunk (replaced at a swap, say) frees its memory.
        self._rows = {rows.channel: rows for rows in held}
        for rows in held:
            self._file.message_counts[rows.channel] += rows.count
            rows.clear()

    def close(self) -> None:
        """Closes the chunk, adds the summary and closes the file; does no more after a LogError or an earlier close."""
        try:
            if self._file.writable:
                self.flush()
                self._file.append_summary()
        finally:
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
