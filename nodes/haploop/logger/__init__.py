"""The energy books, the log and the process that keeps them.

``haploop.logger.read(directory)`` gives a run's log as NumPy arrays, ``haploop.logger.stream(directory)`` piece by
piece, so that a log of any length fits into memory: see ``haploop.logger.log.stream.read`` and ``LogStream``.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from haploop.logger.log.stream import LogStream as stream
    from haploop.logger.log.stream import read as read

    __all__ = ["read", "stream"]


def __getattr__(name: str) -> object:
    """Imports the functions that read logs on first use: NumPy and the libraries of the file take a while to load."""
    if name not in ("read", "stream"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from haploop.logger.log import stream

    return stream.read if name == "read" else stream.LogStream
