"""An MCAP file that only grows, piece by whole piece, and ends with a summary that lets a reader seek in it.

It never holds an incomplete piece, even when the disk is full.
"""

from __future__ import annotations

import contextlib
import zlib
from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, NoReturn

from mcap import records as mcap
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode

from haploop.logger.log import LogError
from haploop.protocol.transport.machine import MACHINE, Machine

MAGIC = b"\x89MCAP0\r\n"
# Name in the header of the program that wrote the file.
LIBRARY = "haploop"
_CRC_BYTES = 4
# Bytes of summary entries that are held in memory.
_HELD_BYTES = 1 << 16


class McapFile:
    """A new file, which overwrites any file of that name.

    Attributes:
        size: bytes of the pieces written.
        schemas, channels, attachments, message_counts: what its summary will list.
    """

    def __init__(self, path: str | Path, machine: Machine = MACHINE) -> None:
        """Creates the file and writes its beginning; raises LogError where the operating system refuses."""
        self.path = Path(path)
        self.size = 0
        self._crc = 0
        self.schemas: list[mcap.Schema] = []
        self.channels: list[mcap.Channel] = []
        # About 130 bytes per chunk, which alone would grow with the log in memory: many are held in a nameless file.
        self._chunk_indexes = bytearray()
        self._more_indexes: IO[bytes] | None = None
        self._chunks = 0
        self._times: tuple[int, int] | None = None
        self.attachments: list[mcap.AttachmentIndex] = []
        self.message_counts: dict[int, int] = {}
        self._failure: LogError | None = None
        try:
            # Unbuffered: pieces are large, and an error is then raised for the piece that met it.
            self._file = machine.create(self.path)
        except OSError as error:
            raise LogError(
                f"The log {self.path} cannot be made ({error.strerror}); name a directory that exists and is writable."
            ) from error
        self.append(MAGIC + bytes_of(mcap.Header(profile="", library=LIBRARY)))

    def append_chunk(self, piece: bytes, index: mcap.ChunkIndex) -> None:
        """Appends a chunk; raises LogError as ``append`` does."""
        self.append(piece)
        try:
            self._hold(bytes_of(index))
        except OSError as error:
            self._fail(error)
        self._chunks += 1
        first, last = self._times or (index.message_start_time, 0)
        self._times = min(first, index.message_start_time), max(last, index.message_end_time)

    def _hold(self, index: bytes) -> None:
        self._chunk_indexes += index
        if len(self._chunk_indexes) > _HELD_BYTES:
            if self._more_indexes is None:
                self._more_indexes = TemporaryFile(dir=self.path.parent)  # noqa: SIM115
            self._more_indexes.write(self._chunk_indexes)
            self._chunk_indexes.clear()

    def append(self, piece: bytes) -> None:
        """Hands a piece to the operating system.

        Raises:
            LogError: it refuses this piece or refused an earlier one; the file is cut back to the whole pieces before
                that one, and kept.
        """
        self._append([piece])

    def _append(self, parts: Iterable[bytes]) -> None:
        """Appends one piece that comes in parts."""
        if self._failure:
            raise self._failure
        size, crc = self.size, self._crc
        try:
            # An interrupt may have left all or part of an uncounted piece behind the last one: overwrite it.
            self._file.seek(size)
            for part in parts:
                rest = memoryview(part)
                while rest:
                    rest = rest[self._file.write(rest) or 0 :]
                size, crc = size + len(part), zlib.crc32(part, crc)
        except OSError as error:
            self._fail(error)
        self.size, self._crc = size, crc

    def _fail(self, error: OSError) -> NoReturn:
        # A device or a pipe cannot be cut back; it was never a log that could be read again.
        with contextlib.suppress(OSError):
            self._file.truncate(self.size)
        self.close()
        self._failure = LogError(
            f"Writing the log {self.path} failed after {self.size} bytes ({error.strerror}). "
            f"What was written before that stays and can be read with haploop.api.read; "
            f"make room there, or write the run to another directory, and run again."
        )
        raise self._failure from error

    @property
    def writable(self) -> bool:
        """Tells whether another piece may be appended: the file is not closed, and the system refused no piece."""
        return not self._file.closed

    def close(self) -> None:
        self._file.close()
        if self._more_indexes:
            self._more_indexes.close()

    def append_summary(self) -> None:
        """Writes the end of the file, from the DataEnd record on; raises LogError as ``append`` does."""
        self._append(self._summary())

    def _summary(self) -> Iterator[bytes]:
        data_end = bytes_of(mcap.DataEnd(data_section_crc=self._crc))
        yield data_end
        groups: dict[Opcode, Iterable[bytes]] = {
            Opcode.SCHEMA: [bytes_of(*self.schemas)],
            Opcode.CHANNEL: [bytes_of(*self.channels)],
            Opcode.STATISTICS: [bytes_of(self._statistics())],
            Opcode.CHUNK_INDEX: self._held_indexes(),
            Opcode.ATTACHMENT_INDEX: [bytes_of(*self.attachments)],
        }
        start = end = self.size + len(data_end)
        crc, offsets = 0, []
        for opcode, pieces in groups.items():
            first = end
            for piece in pieces:
                end, crc = end + len(piece), zlib.crc32(piece, crc)
                yield piece
            if end > first:
                offsets.append(mcap.SummaryOffset(opcode, first, end - first))
        # The checksum covers the footer as well, up to the checksum itself.
        last = bytes_of(*offsets) + bytes_of(mcap.Footer(start, end, summary_crc=0))[:-_CRC_BYTES]
        yield last + zlib.crc32(last, crc).to_bytes(_CRC_BYTES, "little") + MAGIC

    def _held_indexes(self) -> Iterator[bytes]:
        if self._more_indexes:
            self._more_indexes.seek(0)
            yield from iter(partial(self._more_indexes.read, _HELD_BYTES), b"")
        yield bytes(self._chunk_indexes)

    def _statistics(self) -> mcap.Statistics:
        first, last = self._times or (0, 0)
        return mcap.Statistics(
            attachment_count=len(self.attachments),
            channel_count=len(self.channels),
            channel_message_counts=self.message_counts,
            chunk_count=self._chunks,
            message_count=sum(self.message_counts.values()),
            message_end_time=last,
            message_start_time=first,
            metadata_count=0,
            schema_count=len(self.schemas),
        )


def bytes_of(*records: mcap.McapRecord) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return builder.end()
