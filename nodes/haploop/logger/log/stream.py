"""A log read chunk by chunk: of any length in the memory of one chunk, whole, cut off or still being written."""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Schema
from numpy.typing import NDArray

from haploop.logger.log import LogError
from haploop.logger.log.mcap_file import MAGIC
from haploop.logger.log.recording import Recording, Rows, join, merge_columns
from haploop.logger.log.records import LogChannel, MessageRun, chunk_body, lone_message, parts, records
from haploop.logger.log.table import TableLayout

_DAMAGE = (ValueError, OverflowError, RuntimeError, struct.error, McapError)


class Batch(NamedTuple):
    """Rows that one chunk holds of a topic, in order of log time.

    Attributes:
        topic: such as ``/plant``.
        log_times_ns: simulated time in ns of the message each row came with, shape (rows,).
        rows: float64 arrays of shape (rows,) by column, with their units; for a topic without columns the maps.
    """

    topic: str
    log_times_ns: NDArray[np.uint64]
    rows: Rows


class LogStream:
    """The batches of a log, to be iterated over.

    Batches come in the order of the file, which for this project's logs is the order of time on each topic. Once all
    have come, iterating again goes on with what was written to the file since.

    Attributes:
        units: by topic, unit by column, of every channel met so far, chosen or not; empty for a topic without columns.
        attachments: content of each attached file met so far, by name.
        read_bytes: how much of the file has been gone through.
        until: no byte from here on is gone through.
    """

    def __init__(
        self,
        path: str | Path,
        topics: Collection[str] | None = None,
        columns: Collection[str] | None = None,
        until: int | None = None,
    ) -> None:
        """Looks at how the file begins.

        Args:
            path: a run's directory, or an MCAP file of msgpack maps.
            topics: only these topics, the others are not even unpacked; all when None.
            columns: only these columns, of every topic that has them; a batch has those of them that its channels have,
                which may be none. A topic without columns at all, like ``/events``, is not concerned.
            until: end of what is read, in bytes; the end of the file when None.

        Raises:
            FileNotFoundError: there is no such directory or file, or the directory holds no log.
            LogError: the file is empty, or no MCAP file.
        """
        self.path = _log_file(Path(path))
        self._topics = {topics} if isinstance(topics, str) else topics
        self._columns = {columns} if isinstance(columns, str) else columns
        self.until = until
        self.units: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, bytes] = {}
        self.read_bytes = len(MAGIC)
        self._open_end = "it has no closing summary"
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, LogChannel] = {}
        with self.path.open("rb") as file:
            start = file.read(len(MAGIC))
        if not start:
            raise LogError(f"The log {self.path} is empty: the run ended before anything was written to it.")
        if start != MAGIC:
            raise LogError(f"{self.path} is no MCAP file: it begins with {start!r}, not with {MAGIC!r}.")

    @property
    def cut(self) -> str:
        """Sentence on where the file ends, "" once it was read to the end it should have."""
        if not self._open_end:
            return ""
        where = f"it was read up to byte {self.read_bytes} ({self._open_end})"
        return f"The log {self.path} was cut off or is still being written; {where}."

    def _is_chosen(self, topic: str) -> bool:
        return self._topics is None or topic in self._topics

    def chosen_units(self) -> dict[str, dict[str, str]]:
        """Returns unit by column of the columns asked for, by topic; those met so far that have any, or none at all."""
        chosen = {
            topic: {name: unit for name, unit in units.items() if self._columns is None or name in self._columns}
            for topic, units in self.units.items()
            if self._is_chosen(topic)
        }
        return {topic: units for topic, units in chosen.items() if units or not self.units[topic]}

    def __iter__(self) -> Iterator[Batch]:
        """Yields all batches that have not come yet; raises LogError for messages that belie their schema."""
        with self.path.open("rb") as file:
            file.seek(self.read_bytes)
            try:
                for opcode, content in records(file):
                    if self.until is not None and file.tell() > self.until:
                        return
                    batches = self._take(opcode, content)
                    if opcode == Opcode.FOOTER:
                        if file.read(len(MAGIC)) != MAGIC:
                            return
                        self._open_end = ""
                    self.read_bytes = file.tell()
                    yield from batches
            except _DAMAGE as damage:
                self._open_end = f"what follows is damaged: {damage or type(damage).__name__}"

    def _take(self, opcode: int, content: bytes) -> list[Batch]:
        """Returns the batches in one record of the file; indexes and the summary are passed over."""
        if opcode == Opcode.CHUNK:
            return self._batches(chunk_body(content))
        if opcode == Opcode.MESSAGE:
            return self._batches(lone_message(content))
        self._register(opcode, content)
        return []

    def _batches(self, body: bytes) -> list[Batch]:
        found: dict[str, dict[int, list[MessageRun]]] = {}
        for part in parts(body):
            if not isinstance(part, MessageRun):
                self._register(*part)
            elif part.channel not in self._channels:
                raise ValueError(f"a message of channel {part.channel} came before the channel")
            elif self._is_chosen(topic := self._channels[part.channel].topic):
                found.setdefault(topic, {}).setdefault(part.channel, []).append(part)
        return [
            Batch(topic, *join([self._channels[number].decode(some, self._columns) for number, some in runs.items()]))
            for topic, runs in found.items()
        ]

    def _register(self, opcode: int, content: bytes) -> None:
        stream = ReadDataStream(BytesIO(content))
        if opcode == Opcode.ATTACHMENT:
            attachment = Attachment.read(stream)
            self.attachments[attachment.name] = attachment.data
        elif opcode == Opcode.SCHEMA:
            schema = Schema.read(stream)
            self._schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(stream)
            if channel.message_encoding != "msgpack":
                raise LogError(f"The channel {channel.topic} is {channel.message_encoding}; a run's log is msgpack.")
            schema = self._schemas.get(channel.schema_id)
            layout = TableLayout.from_json_schema(schema.data if schema else b"")
            known = self.units.setdefault(channel.topic, dict(layout.columns))
            if bool(known) != bool(layout.columns):
                raise LogError(f"The topic {channel.topic} mixes messages with and without columns; read them apart.")
            self.units[channel.topic] = merge_columns(known, layout.columns)
            self._channels.setdefault(channel.id, LogChannel(channel.topic, layout))


def read(path: str | Path, topics: Collection[str] | None = None, columns: Collection[str] | None = None) -> Recording:
    """Returns the log of a run: arrays by topic and column, ``read(run)["/plant"]["x"]``.

    Arguments and errors are those of :class:`LogStream`. A topic that has columns, but none of those asked for, is left
    out. Of a log that was cut off there is everything up to the last whole chunk, and ``truncated`` is set.
    """
    log = LogStream(path, topics, columns)
    batches: dict[str, list[Batch]] = {}
    for batch in log:
        batches.setdefault(batch.topic, []).append(batch)
    rows = {
        topic: join([batch[1:] for batch in batches.pop(topic, [])], units)[1]
        for topic, units in log.chosen_units().items()
    }
    return Recording(rows, log.cut, log.attachments)


def survey(path: str | Path) -> LogStream:
    """Returns a stream that has gone through a whole log without unpacking a message.

    Its ``units`` are those of every channel there is, and its ``read_bytes`` is where the log ended.
    """
    log = LogStream(path, topics=())
    for _ in log:
        pass
    return log


def _log_file(path: Path) -> Path:
    if not path.exists():
        raise FileNotFoundError(f"There is no {path}; give the directory of a run or its log.mcap.")
    log = path / "log.mcap" if path.is_dir() else path
    if not log.exists():
        raise FileNotFoundError(f"The directory {path} holds no log.mcap; it is not the directory of a logged run.")
    return log
