"""CSV: a file for every topic, one header line with the units in it, every number exact.

The header reads ``timestamp (s),x (m)``; a pure number has its name alone. Numbers have as many digits as it takes to
read back the same float64, a NaN is an empty cell, an infinite number is ``inf`` or ``-inf``. So one call of
``pandas.read_csv``, or a double click on the file, does.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import IO

import numpy as np

from haploop.logger.log.stream import Batch
from haploop.logger.log.table import Floats
from haploop.tools.export.writer import MAP_UNITS, ExportWriter, Units, column, map_rows


class CsvWriter(ExportWriter):
    """One CSV file a topic, UTF-8."""

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
            cells = [numbers(column(batch, name)) for name in names]
            file.writelines(f"{','.join(row)}\n".encode() for row in zip(*cells, strict=True))
        else:
            file.writelines(_line([repr(time), message]) for time, message in zip(*map_rows(batch), strict=True))

    def finish(self) -> None:
        pass


def numbers(values: Floats) -> list[str]:
    """Each number as the shortest text that reads back as it; "" for NaN."""
    texts = list(map(repr, values.tolist()))
    for row in np.flatnonzero(np.isnan(values)).tolist():
        texts[row] = ""
    return texts


def _line(cells: Iterable[str]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue().encode()
