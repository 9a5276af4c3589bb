"""Reads a run's log into arrays, a whole one as well as one that was cut off anywhere or is still being written."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from haploop.logger.log.recording import Recording, join
from haploop.logger.log.stream import Batch, LogStream


def read(path: str | Path, topics: Collection[str] | None = None, columns: Collection[str] | None = None) -> Recording:
    """Read the log of a run.

    Args:
        path: a run's directory, or an MCAP file of msgpack maps.
        topics: only these topics; all when None.
        columns: only these columns, of every topic that has them; all when None. A topic that has none of them is left
            out, one without columns at all (``/events``) is not.

    Returns:
        Arrays by topic and column, ``read(run)["/plant"]["x"]``; of a log that was cut off, everything up to the last
        whole chunk, with ``truncated`` set.

    Raises:
        FileNotFoundError: there is no such directory or file, or the directory holds no log.
        LogError: the file is empty, is no MCAP file, or holds messages other than msgpack maps.
    """
    log = LogStream(path, topics, columns)
    batches: dict[str, list[Batch]] = {}
    for batch in log:
        batches.setdefault(batch.topic, []).append(batch)
    rows = {
        topic: join([batch[1:] for batch in batches.pop(topic, [])], units)[1]
        for topic in log.units
        if log.chosen(topic) and ((units := log.chosen_units(topic)) or not log.units[topic])
    }
    return Recording(rows, log.cut, log.attachments)
