"""One MCAP chunk: the messages gathered since the last one, compressed, checked by a CRC and indexed by channel."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from functools import partial
from typing import Literal

import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk, ChunkIndex

from haploop.logger.log.rows import FreeRows, TableRows

Compression = Literal["", "lz4"]

# Negative levels give up size for speed. On a log of random motions -3 takes three quarters of the time of level 0 and
# gives 3 % more bytes, still half of what goes in; -5 gives 14 % more and wins hardly any time.
_LZ4_LEVEL = -3


def compressor(compression: Compression) -> Callable[[bytes], bytes]:
    """The function that packs a chunk's messages."""
    if not compression:
        return bytes
    import lz4.frame

    return partial(lz4.frame.compress, compression_level=_LZ4_LEVEL)


def chunk(
    rows: Sequence[TableRows | FreeRows], start: int, compression: Compression, compress: Callable[[bytes], bytes]
) -> tuple[bytes, ChunkIndex]:
    """Compose a chunk and the message indexes that follow it.

    Args:
        rows: the messages, at least one channel's and at least one message each.
        start: byte of the file at which the chunk is to stand.
        compression: its name in the file, and ``compress``, the function that does it.

    Returns:
        The bytes for the file, and the index of the chunk for the file's summary.
    """
    body = b"".join([some.body() for some in rows])
    packed = compress(body)
    log_times = np.concatenate([some.log_times() for some in rows])
    begin, end = int(log_times.min()), int(log_times.max())
    piece = RecordBuilder()
    Chunk(compression, packed, end, begin, zlib.crc32(body), len(body)).write(piece)
    chunk_bytes = piece.count
    base, index_offsets = 0, {}
    for some in rows:
        index_offsets[some.channel] = start + piece.count
        piece.write(some.index(base))
        base += some.size
    index = ChunkIndex(
        chunk_length=chunk_bytes,
        chunk_start_offset=start,
        compression=compression,
        compressed_size=len(packed),
        message_end_time=end,
        message_index_length=piece.count - chunk_bytes,
        message_index_offsets=index_offsets,
        message_start_time=begin,
        uncompressed_size=len(body),
    )
    return piece.end(), index
