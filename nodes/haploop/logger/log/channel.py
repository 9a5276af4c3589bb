"""One channel of a log: from the bytes of its messages to columns."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import msgpack
import numpy as np
from numpy.typing import NDArray

from haploop.logger.log.error import LogError
from haploop.logger.log.recording import Table
from haploop.logger.log.records import MessageRun
from haploop.logger.log.table import Floats, TableLayout, rows_of


@dataclass(frozen=True)
class LogChannel:
    """A channel of this topic whose messages are laid out so; without columns, they are any maps."""

    topic: str
    layout: TableLayout

    def decode(
        self, runs: Sequence[MessageRun], names: Collection[str] | None
    ) -> tuple[NDArray[np.uint64], Table | list[Any]]:
        """Log time in ns of every row, shape (rows,), and the rows: the columns ``names`` (None: all), or the maps.

        Raises:
            LogError: the messages are not what the schema of the channel says.
        """
        try:
            return self._decode(runs, names)
        except (ValueError, TypeError, AttributeError) as error:
            raise LogError(f"A message on {self.topic} is no msgpack map of its schema's numbers: {error}.") from error

    def _decode(
        self, runs: Sequence[MessageRun], names: Collection[str] | None
    ) -> tuple[NDArray[np.uint64], Table | list[Any]]:
        log_times_ns = np.concatenate([run.log_times_ns for run in runs])
        units = self.layout.columns
        if not units:
            return log_times_ns, [msgpack.unpackb(payload) for run in runs for payload in run]
        rows_each, columns = self._columns(runs)
        kept = ((name, column) for name, column in zip(units, columns, strict=True) if names is None or name in names)
        return np.repeat(log_times_ns, rows_each), Table(kept, units)

    def _columns(self, runs: Sequence[MessageRun]) -> tuple[int | list[int], Sequence[Floats]]:
        """Rows in each message, and all columns."""
        columns = self.layout.read(b"".join([run.payloads for run in runs]))
        if columns is not None:
            return self.layout.samples or 1, columns
        # Other programs may order or encode the same numbers otherwise.
        rows = [rows_of(msgpack.unpackb(payload), self.layout.columns) for run in runs for payload in run]
        flat = np.array([row for of_message in rows for row in of_message], np.float64)
        return [len(of_message) for of_message in rows], list(flat.reshape(-1, len(self.layout.columns)).T)
