"""Arrays by channel and column, of a log that was read from its file, or kept in memory."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import reduce
from typing import TYPE_CHECKING, Any, NoReturn

import msgpack
import numpy as np
from numpy.typing import NDArray

from haploop.logger.log.table import Floats, pack
from haploop.protocol.changes import Event
from haploop.protocol.names import meant

if TYPE_CHECKING:
    import pandas
    import pint

TIMESTAMP = "timestamp"


class Table(dict[str, Floats]):
    """The columns of a topic: float64 arrays of shape (rows,) by name, rows in order of log time.

    A topic whose columns changed during the run has all of them, with NaN in the rows from before or after.

    Attributes:
        units: unit by column name, "" for a pure number.
    """

    def __init__(self, columns: Iterable[tuple[str, Floats]], units: Mapping[str, str]) -> None:
        super().__init__(columns)
        self.units = {name: units[name] for name in self}

    def __missing__(self, name: str) -> NoReturn:
        raise KeyError(f"There is no column {name}{meant(name, self)}; the columns are {', '.join(self)}.")

    def __repr__(self) -> str:
        rows = len(next(iter(self.values()), ()))
        names = (f"{name} ({unit})" if unit else name for name, unit in self.units.items())
        return f"<{rows} rows of {', '.join(names) or 'no columns'}>"

    def quantity(self, name: str) -> pint.Quantity[Floats]:
        """Returns a column with its unit, as a quantity of pint's application registry."""
        import pint

        return pint.get_application_registry().Quantity(self[name], self.units[name])

    def frame(self) -> pandas.DataFrame:
        """Returns the columns as a data frame, with ``frame.attrs["units"]`` by name.

        Its index is the column ``timestamp``, renamed ``time (s)``, which is how pandas labels the axis of a plot.

        Raises:
            ImportError: pandas is missing.
        """
        try:
            import pandas
        except ImportError as error:
            raise ImportError("Data frames need pandas; install it with: pip install 'haploop[pandas]'") from error
        frame = pandas.DataFrame(dict(self))
        frame = frame.set_index(TIMESTAMP).rename_axis("time (s)") if TIMESTAMP in self else frame
        frame.attrs["units"] = dict(self.units)
        return frame


# Rows of a topic: a table of its columns, or the maps of a topic without columns (``/events``).
Rows = Table | list[Event]


class Recording(dict[str, Any]):
    """The content of a log, rows by topic.

    Attributes:
        truncated: whether the file ends before its closing summary, as for a run that was killed or is still going.
        cut: a sentence on where it ends, "" for a complete file.
        attachments: content of each attached file by name.
    """

    def __init__(self, topics: Mapping[str, Rows], cut: str, attachments: dict[str, bytes]) -> None:
        super().__init__(topics)
        self.truncated = bool(cut)
        self.cut = cut
        self.attachments = attachments

    def __repr__(self) -> str:
        lines = (
            f"{topic}: {rows if isinstance(rows, Table) else f'<{len(rows)} maps>'}" for topic, rows in self.items()
        )
        return "\n".join([f"<recording{', cut: ' * self.truncated}{self.cut}>", *lines])

    def __missing__(self, topic: str) -> NoReturn:
        hint, known = meant(topic, self), ", ".join(self) or "none"
        raise KeyError(f"There is no channel {topic} in this log{hint}; its channels are {known}.")


def join(
    pieces: Sequence[tuple[NDArray[np.uint64], Rows]], units: Mapping[str, str] | None = None
) -> tuple[NDArray[np.uint64], Rows]:
    """Joins pieces of one topic, with rows in the order of log time and, at equal times, of the pieces.

    The tables are used up in the process, so that hardly more than one column is held twice.

    Args:
        pieces: log times in ns, shape (rows,), and rows: all tables or all lists of maps. The result is a piece, too.
        units: unit by column of the columns wanted; those of the pieces if None. A piece without one has NaN there.
    """
    times = np.concatenate([times for times, _ in pieces] or [np.empty(0, np.uint64)])
    order = None if (times[1:] >= times[:-1]).all() else np.argsort(times, kind="stable")
    times_in_order = times if order is None else times[order]
    tables = [rows for _, rows in pieces if isinstance(rows, Table)]
    if not tables and not units:
        maps = [one for _, rows in pieces if isinstance(rows, list) for one in rows]
        return times_in_order, maps if order is None else [maps[row] for row in order]
    if units is None:
        units = reduce(merge_columns, [table.units for table in tables])

    def column(name: str) -> Floats:
        parts = [
            table.pop(name) if name in table else np.full(len(times), np.nan)
            for table, (times, _) in zip(tables, pieces, strict=True)
        ]
        whole = parts[0] if len(parts) == 1 else np.concatenate([*parts, np.empty(0)])
        return whole if order is None else whole[order]

    return times_in_order, Table(((name, column(name)) for name in units), units)


def merge_columns(known: Mapping[str, str], new: Mapping[str, str]) -> dict[str, str]:
    """Returns the columns of both with their units, each in its own order: a new one comes after the one it follows."""
    names, at = list(known), 0
    for name in new:
        if name in known:
            at = names.index(name) + 1
        else:
            names.insert(at, name)
            at += 1
    units = {**new, **known}
    return {name: units[name] for name in names}


class MemoryLog:
    """Takes what ``haploop.logger.log.writer.Log`` takes, and returns what reading its file would, bit for bit."""

    def __init__(self) -> None:
        self._channels: list[tuple[str, dict[str, str]]] = []
        self._units: dict[str, dict[str, str]] = {}
        self._pieces: dict[str, list[tuple[NDArray[np.uint64], Rows]]] = {}
        self._attachments: dict[str, bytes] = {}

    def channel(
        self, topic: str, columns: Mapping[str, str], *, samples_per_message: int | None = None, title: str
    ) -> int:
        """Returns the number of a channel, registered if it is new; samples per message and title do not matter."""
        key = topic, dict(columns)
        if key not in self._channels:
            self._channels.append(key)
            self._units[topic] = merge_columns(self._units.get(topic, {}), columns)
            self._pieces.setdefault(topic, [])
        return self._channels.index(key)

    def write(self, channel: int, log_times_ns: NDArray[np.int64], values: Floats) -> None:
        """Adds messages: values of shape (messages, columns), or (messages, samples, columns)."""
        topic, units = self._channels[channel]
        rows = values.reshape(-1, len(units))
        times = np.repeat(log_times_ns.astype(np.uint64), values[..., 0].size // max(1, len(values)))
        columns = ((name, np.ascontiguousarray(rows[:, number])) for number, name in enumerate(units))
        self._pieces[topic].append((times, Table(columns, units)))

    def message(self, channel: int, log_time_ns: int, obj: Event) -> None:
        """Adds one map, as it would come back from a file."""
        topic, _ = self._channels[channel]
        self._pieces[topic].append((np.array([log_time_ns], np.uint64), [msgpack.unpackb(pack(obj))]))

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Keeps a whole file, of any ``media_type``."""
        self._attachments[name] = data

    def recording(self) -> Recording:
        """Returns all that was written, once: the log is empty afterwards."""
        topics = {topic: join(self._pieces.pop(topic), units)[1] for topic, units in self._units.items()}
        return Recording(topics, "", self._attachments)
