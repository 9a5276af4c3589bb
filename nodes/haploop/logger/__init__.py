"""The energy books, the log and the process that keeps them.

``haploop.logger.read(directory)`` gives a run's log as NumPy arrays, ``haploop.logger.stream(directory)`` piece by
piece, so that a log of any length fits into memory.
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from haploop.logger.log.recording import Recording
    from haploop.logger.log.stream import LogStream


def read(path: str | Path, topics: Collection[str] | None = None, columns: Collection[str] | None = None) -> Recording:
    """Reads the log of a run: see :func:`haploop.logger.log.stream.read`, imported when first used."""
    from haploop.logger.log import stream as log_stream

    return log_stream.read(path, topics, columns)


def stream(
    path: str | Path, topics: Collection[str] | None = None, columns: Collection[str] | None = None
) -> LogStream:
    """Goes through the log of a run, ``for topic, log_times_ns, columns in stream(run)``.

    See :class:`haploop.logger.log.stream.LogStream`, imported when first used.
    """
    from haploop.logger.log.stream import LogStream

    return LogStream(path, topics, columns)
