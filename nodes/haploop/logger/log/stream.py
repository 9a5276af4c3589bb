"""A log of any length, read chunk by chunk in the memory of one: complete, cut off or still being written."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Collection, Iterator
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, DataEnd, Header, Schema
from numpy.typing import NDArray

from haploop.logger.log import LogError
from haploop.logger.log.mcap_file import LIBRARY, MAGIC
from haploop.logger.log.recording import Recording, Rows, join, merge_columns
from haploop.logger.log.records import (
    LogChannel,
    MessageRun,
    chunk_body,
    demand_index,
    frame,
    lone_message,
    parts,
    records,
)
from haploop.logger.log.table import TableLayout
from haploop.protocol.files import demand_regular

_DAMAGE = (ValueError, OverflowError, RuntimeError, MemoryError, struct.error, McapError)
_CRC_BYTES = 4
# Records that may stand in the data and say nothing about it; from ``_PRIVATE`` on they belong to other programs.
_PASSED_OVER, _PRIVATE = (Opcode.METADATA, Opcode.FOOTER), 0x80


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

    Batches come in the order of the file, which for this project's logs is the order of time on each topic. After the
    last one, iterating again continues with what has been written to the file since.

    Attributes:
        units: by topic, unit by column, of every channel met so far, chosen or not; empty for a topic without columns.
        attachments: content of each attached file met so far, by name.
        read_bytes: how much of the file has been processed.
        until: no byte from here on is processed.
    """

    def __init__(
        self,
        path: str | Path,
        topics: Collection[str] | None = None,
        columns: Collection[str] | None = None,
        until: int | None = None,
    ) -> None:
        """Checks the beginning of the file.

        Args:
            path: a run's directory, or an MCAP file of msgpack maps.
            topics: only these topics, the others are not even unpacked; all when None.
            columns: only these columns, of every topic that has them; a batch has those of them that its channels have,
                which may be none. A topic without columns at all, like ``/events``, is not affected.
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
        self._open_end, self._flaw = "it has no closing summary", ""
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, LogChannel] = {}
        # Messages counted by channel; None in a log of another program, which need not number its messages.
        self._counts: dict[int, int] | None = None
        self._crc, self._is_over = zlib.crc32(MAGIC), False
        try:
            with self.path.open("rb") as file:
                start = file.read(len(MAGIC))
        except OSError as error:
            raise LogError(f"The log {self.path} cannot be read: {error.strerror}.") from error
        if not start:
            raise LogError(
                f"The log {self.path} is empty: its run has only just begun, or ended before it wrote anything."
            )
        if start != MAGIC:
            begins = f"it begins with {start!r}, not with {MAGIC!r}"
            raise LogError(f"{self.path} is not an MCAP file: {begins}. Give a run's directory or log.")

    @property
    def cut(self) -> str:
        """Sentence on where the file ends or what in it is damaged, "" for one read to its proper end."""
        if not self._open_end:
            return self._flaw
        where = f"it was read up to byte {self.read_bytes} ({self._open_end})"
        return f"The log {self.path} was cut off or is still being written; {where}. {self._flaw}".rstrip()

    def _is_chosen(self, topic: str) -> bool:
        return self._topics is None or topic in self._topics

    def chosen_units(self) -> dict[str, dict[str, str]]:
        """Returns unit by column of the columns asked for, by topic met so far, if it has any of them or no columns."""
        chosen = {
            topic: {name: unit for name, unit in units.items() if self._columns is None or name in self._columns}
            for topic, units in self.units.items()
            if self._is_chosen(topic)
        }
        return {topic: units for topic, units in chosen.items() if units or not self.units[topic]}

    def __iter__(self) -> Iterator[Batch]:
        """Yields all batches that have not come yet; raises LogError for messages that contradict their schema."""
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
                    self._crc = zlib.crc32(content, zlib.crc32(frame(opcode, len(content)), self._crc))
                    yield from batches
            except _DAMAGE as damage:
                self._open_end = f"what follows is damaged: {damage or type(damage).__name__}"

    def _take(self, opcode: int, content: bytes) -> list[Batch]:
        """Returns the batches in one record of the file; indexes and the summary are skipped."""
        if self._is_over:
            return []
        if opcode == Opcode.CHUNK:
            return self._batches(chunk_body(content))
        if opcode == Opcode.MESSAGE:
            return self._batches(lone_message(content))
        if opcode == Opcode.ATTACHMENT:
            self._attach(content)
        elif opcode == Opcode.HEADER:
            self._counts = {} if Header.read(ReadDataStream(BytesIO(content))).library == LIBRARY else None
        elif opcode == Opcode.DATA_END:
            self._is_over = True
            told = DataEnd.read(ReadDataStream(BytesIO(content))).data_section_crc
            if told and told != self._crc:
                self._blame("its bytes do not match the checksum at its end")
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self._register(opcode, content)
        elif opcode == Opcode.MESSAGE_INDEX:
            demand_index(content)
        elif opcode not in _PASSED_OVER and (self._counts is not None or opcode < _PRIVATE):
            raise ValueError(f"a record of kind {opcode} does not belong in a log")
        return []

    def _blame(self, what: str) -> None:
        self._flaw = self._flaw or f"The log {self.path} is damaged: {what}."

    def _attach(self, content: bytes) -> None:
        told = int.from_bytes(content[-_CRC_BYTES:], "little")
        if told and told != zlib.crc32(content[:-_CRC_BYTES]):
            self._blame(f"the file attached at byte {self.read_bytes} does not match its checksum and was left out")
            return
        attachment = Attachment.read(ReadDataStream(BytesIO(content)))
        self.attachments[attachment.name] = attachment.data

    def _batches(self, body: bytes) -> list[Batch]:
        found: dict[str, dict[int, list[MessageRun]]] = {}
        for part in parts(body):
            if not isinstance(part, MessageRun):
                self._register(*part)
                continue
            if part.channel not in self._channels:
                raise ValueError(f"a message of channel {part.channel} came before its channel")
            topic = self._channels[part.channel].topic
            if self._counts is not None:
                self._count(part, topic)
            if self._is_chosen(topic):
                found.setdefault(topic, {}).setdefault(part.channel, []).append(part)
        return [
            Batch(topic, *join([self._channels[number].decode(some, self._columns) for number, some in runs.items()]))
            for topic, runs in found.items()
        ]

    def _count(self, run: MessageRun, topic: str) -> None:
        """Checks the sequence numbers of the messages; raises ValueError where some are missing."""
        assert self._counts is not None
        before = self._counts.get(run.channel, 0)
        if run.sequence != before & 0xFFFFFFFF:
            raise ValueError(f"message {before} of {topic} was expected, but message {run.sequence} came")
        self._counts[run.channel] = before + len(run.log_times_ns)

    def _register(self, opcode: int, content: bytes) -> None:
        """Registers a schema or a channel; one inside a chunk, under its checksum, replaces one outside.

        Raises LogError for channels that do not belong to a run's log.
        """
        stream = ReadDataStream(BytesIO(content))
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(stream)
            self._schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(stream)
            if channel.message_encoding != "msgpack":
                raise LogError(f"The channel {channel.topic} is {channel.message_encoding}; a run's log is msgpack.")
            schema = self._schemas.get(channel.schema_id)
            layout = TableLayout.from_json_schema(schema.data if schema else b"")
            self._channels[channel.id] = LogChannel(channel.topic, layout)
            self.units = {}
            for topic, columns in ((known.topic, known.layout.columns) for known in self._channels.values()):
                known = self.units.setdefault(topic, columns)
                if bool(known) != bool(columns):
                    raise LogError(f"The topic {topic} mixes messages with and without columns; read them separately.")
                self.units[topic] = merge_columns(known, columns)


def read(path: str | Path, topics: Collection[str] | None = None, columns: Collection[str] | None = None) -> Recording:
    """Returns the log of a run: arrays by topic and column, ``read(run)["/plant"]["x"]``.

    Arguments and errors are those of ``LogStream``. A topic that has columns, but none of those asked for, is left
    out. If the log was cut off, the result holds everything up to the last whole chunk, and ``truncated`` is set.
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

    Its ``units`` are those of every channel in the log, and its ``read_bytes`` is where the log ended.
    """
    log = LogStream(path, topics=())
    for _ in log:
        pass
    return log


def _log_file(path: Path) -> Path:
    log = path
    try:
        if path.is_dir():
            log = path / "log.mcap"
        demand_regular(log)
    except FileNotFoundError:
        what = f"There is no {path}; give the directory of a run or its log.mcap."
        if log != path:
            what = f"The directory {path} holds no log.mcap; it is not the directory of a logged run."
        raise FileNotFoundError(what) from None
    except OSError as error:
        raise LogError(f"The log {log} cannot be read: {error.strerror}.") from error
    return log
