"""What was read from a log: arrays by channel and column."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import msgpack
import numpy as np
from numpy.typing import NDArray

from haploop.logger.log_error import LogError
from haploop.logger.msgpack_table import Floats, TableLayout, rows_of


class Table(dict[str, Floats]):
    """The columns of a topic: float64 arrays of shape (rows,) by name, rows in order of log time.

    A topic whose columns changed during the run has all of them, NaN in the rows from before or after.

    Attributes:
        units: unit by column name, "" for a pure number.
    """

    def __init__(self, columns: Iterable[tuple[str, Floats]], units: dict[str, str]) -> None:
        super().__init__(columns)
        self.units = units

    def __missing__(self, name: str) -> NoReturn:
        raise KeyError(f"There is no column {name}; the columns are {', '.join(self)}.")


class Recording(dict[str, Any]):
    """What a log holds, by topic: a :class:`Table`, or a list of maps for a topic without columns (``/events``).

    Attributes:
        truncated: whether the file ends before its closing summary, as that of a killed run or of one still going.
        cut: a sentence on where it ends, "" for a whole file.
        attachments: content of each attached file by name.
    """

    def __init__(self, topics: dict[str, Any], cut: str, attachments: dict[str, bytes]) -> None:
        super().__init__(topics)
        self.truncated = bool(cut)
        self.cut = cut
        self.attachments = attachments

    def __missing__(self, topic: str) -> NoReturn:
        raise KeyError(f"There is no channel {topic} in this log; its channels are {', '.join(self)}.")


@dataclass(frozen=True)
class Run:
    """Messages of one length: log times in ns, shape (messages,), and their bytes, end to end."""

    log_times_ns: NDArray[np.uint64]
    payloads: bytes
    message_bytes: int

    def __iter__(self) -> Iterator[bytes]:
        for start in range(0, len(self.payloads), self.message_bytes):
            yield self.payloads[start : start + self.message_bytes]


class Source:
    """One MCAP channel's messages while a log is read."""

    def __init__(self, topic: str, layout: TableLayout) -> None:
        self.topic = topic
        self.layout = layout
        self._log_times: list[NDArray[np.uint64]] = []
        self._columns: list[Sequence[Floats]] = []
        self._maps: list[Any] = []

    def add(self, runs: Sequence[Run]) -> None:
        """Take messages in.

        Raises:
            LogError: they are not what the schema of the channel says.
        """
        try:
            self._add(runs)
        except (ValueError, TypeError, AttributeError) as error:
            raise LogError(f"A message on {self.topic} is no msgpack map of its schema's numbers: {error}.") from error

    def _add(self, runs: Sequence[Run]) -> None:
        log_times_ns = np.concatenate([run.log_times_ns for run in runs])
        names = self.layout.columns
        if not names:
            self._log_times.append(log_times_ns)
            self._maps.extend(msgpack.unpackb(payload) for run in runs for payload in run)
            return
        rows_each: int | list[int] = self.layout.samples or 1
        columns: Sequence[Floats] | None = self.layout.read(b"".join([run.payloads for run in runs]))
        if columns is None:
            # Other programs may order or encode the same numbers otherwise.
            rows = [rows_of(msgpack.unpackb(payload), names) for run in runs for payload in run]
            rows_each = [len(of_message) for of_message in rows]
            flat = np.array([row for of_message in rows for row in of_message], np.float64)
            columns = list(flat.reshape(-1, len(names)).T)
        self._log_times.append(np.repeat(log_times_ns, rows_each))
        self._columns.append(columns)

    def log_times(self) -> NDArray[np.uint64]:
        """Log time in ns of every row or free map, shape (rows,)."""
        return np.concatenate([*self._log_times, np.empty(0, np.uint64)])

    def column(self, name: str) -> Floats:
        """One column, shape (rows,); NaN throughout where this channel has none of the name."""
        if name not in self.layout.columns:
            return np.full(len(self.log_times()), np.nan)
        number = list(self.layout.columns).index(name)
        return np.concatenate([*(columns[number] for columns in self._columns), np.empty(0)])

    def maps(self) -> list[Any]:
        """The messages of a channel without columns."""
        return self._maps


def join(sources: Sequence[Source]) -> Table | list[Any]:
    """All channels of one topic as one, rows in the order of log time and, at the same time, of the file.

    Raises:
        LogError: some of the channels have columns and some have none.
    """
    log_times = np.concatenate([source.log_times() for source in sources])
    order = np.argsort(log_times, kind="stable")
    units: dict[str, str] = {}
    for source in sources:
        units = source.layout.columns | units
    if not units:
        maps = [one for source in sources for one in source.maps()]
        return [maps[row] for row in order]
    if not all(source.layout.columns for source in sources):
        raise LogError(f"The topic {sources[0].topic} mixes messages with and without columns; read them apart.")
    return Table(((name, np.concatenate([source.column(name) for source in sources])[order]) for name in units), units)
