"""The base of every export format; CSV and Apache Parquet: a file for every topic, a column for every quantity.

CSV: UTF-8, one header line, ``timestamp (s),x (m)``; a pure number has only its name. Numbers have as many digits as it
takes to read back the same float64, a NaN is an empty cell, an infinite number is ``inf`` or ``-inf``. So one call of
``pandas.read_csv``, or a double click on the file, is enough; pandas before 3 rounds the last bit of some numbers,
unless told ``float_precision="round_trip"``.

Parquet: float64 columns; ``pyarrow.parquet.read_schema(file).field("x").metadata[b"unit"]`` is the unit of a column;
pandas and polars read the files as they are, and pandas has the units in ``attrs["units"]``.
"""

from __future__ import annotations

import contextlib
import csv
import io
import json
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from typing import IO, Any, ClassVar, Self

import numpy as np

from haploop.logger.log.recording import TIMESTAMP, Table
from haploop.logger.log.stream import Batch
from haploop.logger.log.table import Floats
from haploop.logger.summary import finite
from haploop.protocol.changes import Event

Units = Mapping[str, Mapping[str, str]]
# A topic of free maps becomes a table of these two columns: time, and the map as JSON.
MESSAGE = "message"
MAP_UNITS = {TIMESTAMP: "s", MESSAGE: ""}
# Key of a Parquet file's metadata from which pandas takes the ``attrs`` of a frame, as JSON.
_PANDAS = "PANDAS_ATTRS"
# Rows of a group of a Parquet file; a reader can read each group alone.
_GROUP_ROWS = 1 << 16


class ExportWriter(ABC):
    """Writes the content of a log into a file, or one for every topic, in the memory of a few batches.

    A context manager, which releases what it holds besides the files.
    """

    suffix: ClassVar[str]
    file_per_topic: ClassVar[bool] = False

    @abstractmethod
    def __init__(self, files: Sequence[IO[bytes]], units: Units, attachments: Mapping[str, bytes]) -> None:
        """Begins the files.

        Args:
            files: one per topic in the order of ``units``, or one for all; closed by the caller.
            units: for each topic, the unit by column of all columns to come; empty for a topic of free maps.
        """

    @abstractmethod
    def add(self, batch: Batch) -> None:
        """Takes the next rows of a topic; a column that they lack is NaN in them."""

    def finish(self) -> None:  # noqa: B027 (CSV holds nothing back)
        """Writes all that was held back; to be called once, when nothing has failed."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return None


def read_column(batch: Batch, name: str) -> Floats:
    """Returns a column of a batch, NaN throughout if it has none of this name."""
    assert isinstance(batch.rows, Table)
    return batch.rows[name] if name in batch.rows else np.full(len(batch.log_times_ns), np.nan)


def to_json(value: Any) -> str:
    """Returns compact JSON; null for numbers that are not finite, text for values that JSON does not know."""
    return json.dumps(finite(value), ensure_ascii=False, separators=(",", ":"), default=str)


class CsvWriter(ExportWriter):
    suffix, file_per_topic = ".csv", True

    def __init__(self, files: Sequence[IO[bytes]], units: Units, attachments: Mapping[str, bytes]) -> None:
        self._units = units
        self._files = dict(zip(units, files, strict=True))
        for topic, file in self._files.items():
            columns = units[topic] or MAP_UNITS
            file.write(_line(f"{name} ({unit})" if unit else name for name, unit in columns.items()))

    def add(self, batch: Batch) -> None:
        file = self._files[batch.topic]
        if names := self._units[batch.topic]:
            cells = [numbers(read_column(batch, name)) for name in names]
            file.writelines(f"{','.join(row)}\n".encode() for row in zip(*cells, strict=True))
        else:
            file.writelines(_line([repr(time), message]) for time, message in zip(*map_rows(batch), strict=True))


def numbers(values: Floats) -> list[str]:
    """Returns each number as the shortest text that reads back as it; "" for NaN."""
    texts = list(map(repr, values.tolist()))
    for row in np.flatnonzero(np.isnan(values)).tolist():
        texts[row] = ""
    return texts


def _line(cells: Iterable[str]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue().encode()


class ParquetWriter(ExportWriter):
    suffix, file_per_topic = ".parquet", True

    def __init__(self, files: Sequence[IO[bytes]], units: Units, attachments: Mapping[str, bytes]) -> None:
        try:
            import pyarrow
            from pyarrow import parquet
        except ImportError as error:
            raise ImportError("Parquet files need pyarrow; install it with: pip install 'haploop[parquet]'") from error
        self._arrow: Any = pyarrow
        self._units = units
        self._schemas = {topic: self._schema(columns or MAP_UNITS) for topic, columns in units.items()}
        self._files = {
            topic: parquet.ParquetWriter(file, self._schemas[topic]) for topic, file in zip(units, files, strict=True)
        }
        self._held: dict[str, list[Batch]] = {topic: [] for topic in units}

    def _schema(self, units: Mapping[str, str]) -> Any:
        arrow = self._arrow
        fields = [
            arrow.field(name, arrow.string() if name == MESSAGE else arrow.float64(), metadata={"unit": unit})
            for name, unit in units.items()
        ]
        return arrow.schema(fields, metadata={_PANDAS: json.dumps({"units": dict(units)})})

    def add(self, batch: Batch) -> None:
        held = self._held[batch.topic]
        held.append(batch)
        if sum(len(one.log_times_ns) for one in held) >= _GROUP_ROWS:
            self._write(batch.topic)

    def _write(self, topic: str) -> None:
        held, self._held[topic] = self._held[topic], []
        if not held:
            return
        if names := self._units[topic]:
            columns = [np.concatenate([read_column(batch, name) for batch in held]) for name in names]
        else:
            columns = [[*chain(*parts)] for parts in zip(*map(map_rows, held), strict=True)]
        schema = self._schemas[topic]
        arrays = [self._arrow.array(values, type=field.type) for values, field in zip(columns, schema, strict=True)]
        group = self._arrow.Table.from_arrays(arrays, schema=schema)
        self._files[topic].write_table(group, row_group_size=group.num_rows)

    def finish(self) -> None:
        for topic, file in self._files.items():
            self._write(topic)
            file.close()

    def __exit__(self, *_: object) -> None:
        for file in self._files.values():
            with contextlib.suppress(OSError):  # that it could not write has been reported
                file.close()


def map_rows(batch: Batch) -> tuple[list[float], list[str]]:
    """Returns time in s and JSON text of each of a batch's free maps."""
    maps: list[Event] = list(batch.rows)  # type: ignore[arg-type]
    nanoseconds = batch.log_times_ns.tolist()
    times = [float(one.get(TIMESTAMP, ns / 1e9)) for one, ns in zip(maps, nanoseconds, strict=True)]
    return times, [to_json(one) for one in maps]
