"""Reads a run's log, a whole one as well as one that was cut off anywhere or is still being written.

The frame of the file is read by the ``mcap`` library's own records; the messages in a chunk are gathered channel by
channel and taken apart by NumPy all at once.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import IO

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Schema
from mcap.stream_reader import get_chunk_data_stream

from haploop.logger.log_error import LogError
from haploop.logger.mcap_summary import MAGIC
from haploop.logger.msgpack_table import TableLayout
from haploop.logger.recording import Recording, Run, Source, join

_PREFIX = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")


def read(path: str | Path) -> Recording:
    """Read the log of a run.

    Args:
        path: a run's directory, or an MCAP file of msgpack maps.

    Returns:
        Arrays by topic and column, ``read(run)["/plant"]["x"]``; of a log that was cut off, everything up to the last
        whole chunk, with ``truncated`` set.

    Raises:
        FileNotFoundError: there is no such directory or file, or the directory holds no log.
        LogError: the file is empty, is no MCAP file, or holds messages other than msgpack maps.
    """
    log = _log_file(Path(path))
    with log.open("rb") as file:
        start = file.read(len(MAGIC))
        if not start:
            raise LogError(f"The log {log} is empty: the run ended before anything was written to it.")
        if start != MAGIC:
            raise LogError(f"{log} is no MCAP file: it begins with {start!r}, not with {MAGIC!r}.")
        contents = _Contents()
        whole, reason = len(MAGIC), "it has no closing summary"
        try:
            for opcode, content in _records(file):
                contents.take(opcode, content)
                whole = file.tell()
                if opcode == Opcode.FOOTER and file.read(len(MAGIC)) == MAGIC:
                    reason = ""
        except (ValueError, OverflowError, RuntimeError, struct.error, McapError) as damage:
            reason = f"what follows is damaged: {damage or type(damage).__name__}"
    cut = reason and f"The log {log} was cut off or is still being written; it was read up to byte {whole} ({reason})."
    return contents.recording(cut)


def _log_file(path: Path) -> Path:
    if not path.exists():
        raise FileNotFoundError(f"There is no {path}; give the directory of a run or its log.mcap.")
    log = path / "log.mcap" if path.is_dir() else path
    if not log.exists():
        raise FileNotFoundError(f"The directory {path} holds no log.mcap; it is not the directory of a logged run.")
    return log


def _records(stream: IO[bytes]) -> Iterator[tuple[int, bytes]]:
    """Opcode and content of each whole record that is left in a file."""
    end = os.fstat(stream.fileno()).st_size
    while len(prefix := stream.read(_PREFIX.size)) == _PREFIX.size:
        opcode, length = _PREFIX.unpack(prefix)
        if stream.tell() + length > end:
            return
        yield opcode, stream.read(length)


def _run(body: bytes, start: int, end: int) -> tuple[int, Run, int]:
    """Messages of one channel and one length that stand end to end in a chunk, from the one in ``start:end`` on.

    Returns:
        Their channel, the messages, and where the last of them ends.
    """
    if end > len(body):
        raise ValueError("a message is longer than its chunk")
    size, head_end = end - start, start + _PREFIX.size + 2  # the head is opcode, length and channel
    # Looking further ahead is only worth it where a second message follows the first.
    followed = body[end : end + head_end - start] == body[start:head_end]
    records = np.frombuffer(body, np.uint8, ((len(body) - start) // size if followed else 1) * size, start)
    records = records.reshape(-1, size)
    alike = (records[:, : head_end - start] == records[0, : head_end - start]).all(axis=1)
    records = records if alike.all() else records[: alike.argmin()]
    data = _PREFIX.size + _MESSAGE.size
    channel, _, _, _ = _MESSAGE.unpack_from(body, start + _PREFIX.size)
    log_times = records[:, data - 16 : data - 8].copy().view("<u8")[:, 0]
    return channel, Run(log_times, records[:, data:].tobytes(), size - data), start + records.size


class _Contents:
    """What the records read so far amount to."""

    def __init__(self) -> None:
        self._schemas: dict[int, Schema] = {}
        self._sources: dict[int, Source] = {}
        self._attachments: dict[str, bytes] = {}

    def take(self, opcode: int, content: bytes) -> None:
        """Take in one record of the file; indexes and the summary tell nothing new and are passed over."""
        if opcode == Opcode.CHUNK:
            chunk = Chunk.read(ReadDataStream(BytesIO(content)))
            body, size = get_chunk_data_stream(chunk, validate_crc=True)
            self._take_chunk(body.read(size))
        elif opcode == Opcode.MESSAGE:
            self._take_chunk(_PREFIX.pack(opcode, len(content)) + content)
        elif opcode == Opcode.ATTACHMENT:
            attachment = Attachment.read(ReadDataStream(BytesIO(content)))
            self._attachments[attachment.name] = attachment.data
        else:
            self._register(opcode, content)

    def _take_chunk(self, body: bytes) -> None:
        runs: dict[int, list[Run]] = {}
        at = 0
        while at < len(body):
            opcode, length = _PREFIX.unpack_from(body, at)
            end = at + _PREFIX.size + length
            if opcode == Opcode.MESSAGE:
                channel, run, end = _run(body, at, end)
                if channel not in self._sources:
                    raise ValueError(f"a message of channel {channel} came before the channel")
                runs.setdefault(channel, []).append(run)
            else:
                self._register(opcode, body[at + _PREFIX.size : end])
            at = end
        for channel, of_channel in runs.items():
            self._sources[channel].add(of_channel)

    def _register(self, opcode: int, content: bytes) -> None:
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(ReadDataStream(BytesIO(content)))
            self._schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(ReadDataStream(BytesIO(content)))
            if channel.message_encoding != "msgpack":
                raise LogError(f"The channel {channel.topic} is {channel.message_encoding}; a run's log is msgpack.")
            schema = self._schemas.get(channel.schema_id)
            layout = TableLayout.of_json_schema(schema.data if schema else b"")
            self._sources.setdefault(channel.id, Source(channel.topic, layout))

    def recording(self, cut: str) -> Recording:
        """Everything taken in, by topic."""
        topics: dict[str, list[Source]] = {}
        for source in self._sources.values():
            topics.setdefault(source.topic, []).append(source)
        return Recording({topic: join(sources) for topic, sources in topics.items()}, cut, self._attachments)
