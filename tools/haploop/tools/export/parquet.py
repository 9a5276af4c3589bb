"""Apache Parquet: a file for every topic, float64 columns with their units in the schema.

``pyarrow.parquet.read_schema(file).field("x").metadata[b"unit"]`` is the unit of a column; pandas and polars read the
files as they are.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from itertools import chain
from typing import IO, Any

import numpy as np

from haploop.logger.log.stream import Batch
from haploop.tools.export.writer import MAP_UNITS, MESSAGE, ExportWriter, Units, column, map_rows

try:
    import pyarrow as arrow
    from pyarrow import parquet
except ImportError as error:
    raise ImportError("Parquet files need pyarrow; install it with: pip install 'haploop[parquet]'") from error

# Rows that are held back until they make a group, which a reader can read by itself.
_GROUP_ROWS = 1 << 16


class ParquetWriter(ExportWriter):
    """One Parquet file a topic."""

    suffix, file_per_topic = ".parquet", True

    def __init__(self, files: Sequence[IO[bytes]], units: Units, attachments: Mapping[str, bytes]) -> None:
        self._units = units
        self._schemas = {topic: _schema(columns or MAP_UNITS) for topic, columns in units.items()}
        self._files = {
            topic: parquet.ParquetWriter(file, self._schemas[topic]) for topic, file in zip(units, files, strict=True)
        }
        self._held: dict[str, list[Batch]] = {topic: [] for topic in units}

    def add(self, batch: Batch) -> None:
        held = self._held[batch.topic]
        held.append(batch)
        if sum(len(one.log_times_ns) for one in held) >= _GROUP_ROWS:
            self._write(batch.topic)

    def _write(self, topic: str) -> None:
        """Make a group of the rows held back."""
        held, self._held[topic] = self._held[topic], []
        if not held:
            return
        if names := self._units[topic]:
            columns = [np.concatenate([column(batch, name) for batch in held]) for name in names]
        else:
            columns = [[*chain(*parts)] for parts in zip(*map(map_rows, held), strict=True)]
        schema = self._schemas[topic]
        arrays = [arrow.array(values, type=field.type) for values, field in zip(columns, schema, strict=True)]
        group = arrow.Table.from_arrays(arrays, schema=schema)
        self._files[topic].write_table(group, row_group_size=group.num_rows)

    def finish(self) -> None:
        for topic, file in self._files.items():
            self._write(topic)
            file.close()

    def __exit__(self, *_: object) -> None:
        for file in self._files.values():
            with contextlib.suppress(OSError):  # that it could not write was said before
                file.close()


def _schema(units: Mapping[str, str]) -> Any:
    fields = [
        arrow.field(name, arrow.string() if name == MESSAGE else arrow.float64(), metadata={"unit": unit})
        for name, unit in units.items()
    ]
    return arrow.schema(fields)
