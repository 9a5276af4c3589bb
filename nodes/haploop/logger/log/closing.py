"""The close of an MCAP file: the end of its data, the summary that lets a reader seek in it, and the footer."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    McapRecord,
    Schema,
    Statistics,
    SummaryOffset,
)

MAGIC = b"\x89MCAP0\r\n"
_CRC_BYTES = 4


@dataclass
class Summary:
    """Records that are kept of a log while it is written."""

    schemas: list[Schema] = field(default_factory=list)
    channels: list[Channel] = field(default_factory=list)
    chunks: list[ChunkIndex] = field(default_factory=list)
    attachments: list[AttachmentIndex] = field(default_factory=list)
    message_counts: dict[int, int] = field(default_factory=dict)

    def statistics(self) -> Statistics:
        """Returns the counts and the span of time of everything written."""
        return Statistics(
            attachment_count=len(self.attachments),
            channel_count=len(self.channels),
            channel_message_counts=self.message_counts,
            chunk_count=len(self.chunks),
            message_count=sum(self.message_counts.values()),
            message_end_time=max((chunk.message_end_time for chunk in self.chunks), default=0),
            message_start_time=min((chunk.message_start_time for chunk in self.chunks), default=0),
            metadata_count=0,
            schema_count=len(self.schemas),
        )

    def closing(self, data_bytes: int) -> bytes:
        """Returns everything from the DataEnd record to the end of a file that holds ``data_bytes`` so far."""
        data_end = RecordBuilder()
        DataEnd(data_section_crc=0).write(data_end)
        start = data_bytes + data_end.count

        groups: list[tuple[Opcode, Sequence[McapRecord]]] = [
            (Opcode.SCHEMA, self.schemas),
            (Opcode.CHANNEL, self.channels),
            (Opcode.STATISTICS, [self.statistics()]),
            (Opcode.CHUNK_INDEX, self.chunks),
            (Opcode.ATTACHMENT_INDEX, self.attachments),
        ]
        summary, offsets = RecordBuilder(), []
        for opcode, records in groups:
            group_start = summary.count
            for record in records:
                record.write(summary)
            if records:
                offsets.append(SummaryOffset(opcode, start + group_start, summary.count - group_start))
        offset_start = start + summary.count
        for offset in offsets:
            offset.write(summary)

        # The checksum covers the footer as well, up to the checksum itself.
        footer, covered = RecordBuilder(), summary.end()
        Footer(start, offset_start, summary_crc=0).write(footer)
        covered += footer.end()[:-_CRC_BYTES]
        return data_end.end() + covered + zlib.crc32(covered).to_bytes(_CRC_BYTES, "little") + MAGIC
