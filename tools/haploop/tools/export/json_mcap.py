"""MCAP with JSON messages, which Foxglove opens and plots: one message for every row, schemas with units and titles.

Topics and names are kept: a plot's path is ``/plant.x``, or ``/energy."wall.true"`` where the name has a point in it.
A number that is not finite, or that a row does not have, is left out of its message: JSON has no word for it, and the
schemas that Foxglove reads allow no null.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import IO, Any

import numpy as np
from mcap.writer import CompressionType, Writer

from haploop.logger.log.recording import TIMESTAMP, Table
from haploop.logger.log.stream import Batch
from haploop.tools.export.writer import ExportWriter, Units, to_json

# What every event has; a schema without any properties would not be read.
_EVENT_UNITS = {TIMESTAMP: "s", "tick": ""}


class JsonMcapWriter(ExportWriter):
    """One MCAP file."""

    suffix = ".json.mcap"

    def __init__(self, files: Sequence[IO[bytes]], units: Units, attachments: Mapping[str, bytes]) -> None:
        [file] = files
        self._writer = Writer(file, compression=CompressionType.LZ4)
        self._writer.start(library="haploop")
        for name, content in attachments.items():
            self._writer.add_attachment(0, 0, name, "text/plain", content)
        self._channels = {topic: self._channel(topic, columns or _EVENT_UNITS) for topic, columns in units.items()}
        self._counts = dict.fromkeys(units, 0)

    def _channel(self, topic: str, units: Mapping[str, str]) -> int:
        name = f"haploop.{topic.strip('/')}"
        schema = self._writer.register_schema(name, "jsonschema", json.dumps(_schema(name, units)).encode())
        return self._writer.register_channel(topic, "json", schema)

    def add(self, batch: Batch) -> None:
        if isinstance(batch.rows, Table):
            times_ns, messages = _row_times_ns(batch, batch.rows), _rows(batch.rows)
        else:
            times_ns, messages = batch.log_times_ns.tolist(), map(to_json, batch.rows)
        channel, first = self._channels[batch.topic], self._counts[batch.topic]
        for number, (time_ns, message) in enumerate(zip(times_ns, messages, strict=True), start=first):
            self._writer.add_message(channel, time_ns, message.encode(), time_ns, number & 0xFFFFFFFF)
        self._counts[batch.topic] += len(batch.log_times_ns)

    def finish(self) -> None:
        self._writer.finish()


def _schema(title: str, units: Mapping[str, str]) -> dict[str, Any]:
    columns = {
        name: {"type": "number", "title": f"{name} ({unit})" if unit else name, "unit": unit}
        for name, unit in units.items()
    }
    return {"title": title, "type": "object", "properties": columns}


def _row_times_ns(batch: Batch, rows: Table) -> list[int]:
    """Time of each row: of its own, since the steps of a tick share the time of their message."""
    stamps = rows.get(TIMESTAMP)
    if stamps is None or not (np.isfinite(stamps) & (stamps >= 0)).all():
        return batch.log_times_ns.tolist()
    return np.rint(stamps * 1e9).astype(np.uint64).tolist()


def _rows(rows: Table) -> list[str]:
    """Each row as a JSON object."""
    keys = [f"{json.dumps(name)}:" for name in rows]
    cells = [
        [key + text for text in map(repr, column.tolist())] for key, column in zip(keys, rows.values(), strict=True)
    ]
    for column, texts in zip(rows.values(), cells, strict=True):
        for row in np.flatnonzero(~np.isfinite(column)).tolist():
            texts[row] = ""
    absent = any("" in texts for texts in cells)
    return [f"{{{','.join(filter(None, row) if absent else row)}}}" for row in zip(*cells, strict=True)]
