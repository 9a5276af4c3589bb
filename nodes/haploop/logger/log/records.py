"""The records of an MCAP file: the complete ones, one after the other, the content of a chunk, and its messages.

The frame of the file is read by the ``mcap`` library's own records; messages of equal length that stand end to end in a
chunk, as in this project's logs, are gathered and decoded by NumPy all at once.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import IO

import msgpack
import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Chunk
from mcap.stream_reader import get_chunk_data_stream
from numpy.typing import NDArray

from haploop.logger.log import LogError
from haploop.logger.log.recording import Rows, Table
from haploop.logger.log.table import TableLayout

_PREFIX = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")


@dataclass(frozen=True)
class MessageRun:
    """Messages of one channel and one length: log times in ns, shape (messages,), and their bytes, end to end.

    Attributes:
        sequence: number of the first on its channel, as the file has it.
    """

    channel: int
    sequence: int
    log_times_ns: NDArray[np.uint64]
    payloads: bytes
    message_bytes: int

    def __iter__(self) -> Iterator[bytes]:
        for start in range(0, len(self.payloads), self.message_bytes):
            yield self.payloads[start : start + self.message_bytes]


def records(stream: IO[bytes]) -> Iterator[tuple[int, bytes]]:
    """Yields opcode and content of each complete record that remains in a file at its present length."""
    end = os.fstat(stream.fileno()).st_size
    while len(prefix := stream.read(_PREFIX.size)) == _PREFIX.size:
        opcode, length = _PREFIX.unpack(prefix)
        if stream.tell() + length > end:
            return
        yield opcode, stream.read(length)


def chunk_body(content: bytes) -> bytes:
    """Returns the records in a chunk, unpacked and checked (ValueError, RuntimeError, McapError if it is damaged)."""
    chunk = Chunk.read(ReadDataStream(BytesIO(content)))
    body, size = get_chunk_data_stream(chunk, validate_crc=True)
    return body.read(size)


def frame(opcode: int, length: int) -> bytes:
    """Returns the bytes before the content of a record."""
    return _PREFIX.pack(opcode, length)


def demand_index(content: bytes) -> None:
    """Raises ValueError if this is no index of messages: a chunk with a flipped bit in its opcode may pass for one."""
    head = 6
    if len(content) != head + int.from_bytes(content[2:head], "little"):
        raise ValueError("an index of messages is longer or shorter than it states")


def lone_message(content: bytes) -> bytes:
    """Returns a message that stands outside of any chunk, as a chunk's body would hold it."""
    return frame(Opcode.MESSAGE, len(content)) + content


def parts(body: bytes) -> Iterator[MessageRun | tuple[int, bytes]]:
    """Yields the parts of a chunk's body in order: runs of messages, and other records by opcode and content.

    Raises ValueError or struct.error where the body is damaged.
    """
    at = 0
    while at < len(body):
        opcode, length = _PREFIX.unpack_from(body, at)
        end = at + _PREFIX.size + length
        if opcode == Opcode.MESSAGE:
            run, end = _run(body, at, end)
            yield run
        else:
            yield opcode, body[at + _PREFIX.size : end]
        at = end


def _run(body: bytes, start: int, end: int) -> tuple[MessageRun, int]:
    """Returns the run of messages that begins with the one in ``start:end``, all like it, and where the run ends."""
    if end > len(body):
        raise ValueError("a message is longer than its chunk")
    size, head_end = end - start, start + _PREFIX.size + 2  # the head is opcode, length and channel
    # Looking further ahead is only worth it where a second message follows the first.
    followed = body[end : end + head_end - start] == body[start:head_end]
    messages = np.frombuffer(body, np.uint8, ((len(body) - start) // size if followed else 1) * size, start)
    messages = messages.reshape(-1, size)
    alike = (messages[:, : head_end - start] == messages[0, : head_end - start]).all(axis=1)
    messages = messages if alike.all() else messages[: alike.argmin()]
    data = _PREFIX.size + _MESSAGE.size
    channel, sequence, _, _ = _MESSAGE.unpack_from(body, start + _PREFIX.size)
    log_times = messages[:, data - 16 : data - 8].copy().view("<u8")[:, 0]
    return MessageRun(channel, sequence, log_times, messages[:, data:].tobytes(), size - data), start + messages.size


@dataclass(frozen=True)
class LogChannel:
    """A channel of a topic, with the layout of its messages; without columns, they are any maps."""

    topic: str
    layout: TableLayout

    def decode(self, runs: Sequence[MessageRun], names: Collection[str] | None) -> tuple[NDArray[np.uint64], Rows]:
        """Returns log time of every row in ns, shape (rows,), and the rows: columns ``names`` (None: all), or the maps.

        Raises LogError where the messages are not what the schema of the channel says.
        """
        log_times_ns = np.concatenate([run.log_times_ns for run in runs])
        units = self.layout.columns
        try:
            if not units:
                maps = [msgpack.unpackb(payload) for run in runs for payload in run]
                if not all(isinstance(one, dict) for one in maps):
                    raise TypeError
                return log_times_ns, maps
            rows_each, columns = self.layout.samples or 1, self.layout.read(b"".join([run.payloads for run in runs]))
            if columns is None:  # other programs may order or encode the same numbers differently
                messages = [msgpack.unpackb(payload) for run in runs for payload in run]
                maps = [message if isinstance(message, list) else [message] for message in messages]
                rows = [[float(one.get(name, "nan")) for name in units] for of_message in maps for one in of_message]
                rows_each = [len(of_message) for of_message in maps]
                columns = list(np.array(rows, np.float64).reshape(-1, len(units)).T)
        except (ValueError, TypeError, AttributeError, OverflowError) as error:
            what = f"of the numbers {', '.join(units)} of its schema" if units else "at all"
            raise LogError(f"A message on {self.topic} is not a msgpack map {what}.") from error
        kept = ((name, column) for name, column in zip(units, columns, strict=True) if names is None or name in names)
        return np.repeat(log_times_ns, rows_each), Table(kept, units)
