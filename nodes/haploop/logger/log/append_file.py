"""A file that only grows, piece by whole piece: what it holds is never half a piece, even when the disk is full."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import NoReturn

from haploop.logger.log import LogError


class AppendFile:
    """A new file, over any file of that name.

    Attributes:
        path: where it is.
        size: bytes of the pieces written.
    """

    def __init__(self, path: str | Path) -> None:
        """Makes the file.

        Raises:
            LogError: the operating system refuses.
        """
        self.path = Path(path)
        self.size = 0
        self._failure: LogError | None = None
        try:
            # Unbuffered: pieces are large, and an error then belongs to the piece that met it.
            self._file = self.path.open("wb", buffering=0)
        except OSError as error:
            raise LogError(
                f"The log {self.path} cannot be made ({error.strerror}); name a directory that exists and is writable."
            ) from error

    @property
    def writable(self) -> bool:
        """Tells whether another piece may be appended: neither closed nor refused by the operating system."""
        return not self._file.closed

    def append(self, piece: bytes) -> None:
        """Hands a piece to the operating system.

        Raises:
            LogError: the operating system refuses, now or at an earlier piece; the file is cut back to the whole
                pieces before it and stays so.
        """
        if self._failure:
            raise self._failure
        rest = memoryview(piece)
        try:
            # An interrupt may have left part of a piece, or all of it, uncounted behind the last one: write over it.
            self._file.seek(self.size)
            while rest:
                rest = rest[self._file.write(rest) or 0 :]
        except OSError as error:
            self._fail(error)
        self.size += len(piece)

    def _fail(self, error: OSError) -> NoReturn:
        # A device or a pipe cannot be cut back; it was never a log that could be read again.
        with contextlib.suppress(OSError):
            self._file.truncate(self.size)
        self._file.close()
        self._failure = LogError(
            f"Writing the log {self.path} failed after {self.size} bytes ({error.strerror}). "
            f"What was written before that stays and can be read with haploop.logger.read; "
            f"make room there, or write the run to another directory, and run again."
        )
        raise self._failure from error

    def close(self) -> None:
        """Closes the file; a second call does nothing."""
        self._file.close()
