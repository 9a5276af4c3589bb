"""Reading of files that somebody names: regular ones alone, up to a size, with an OSError in words for all others."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

# A file of text that is larger is none that a person or a run of this program has written.
_MOST_BYTES = 1 << 26


def demand_regular(path: str | Path) -> os.stat_result:
    """Returns size and times of a file that can be read to its end.

    Raises:
        OSError: there is none, or it is a directory, a pipe or a device; ``strerror`` says so in words.
    """
    try:
        found = Path(path).stat()
    except ValueError as error:
        raise OSError(errno.EINVAL, "A file's name holds no NUL character", str(path)) from error
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(found.st_mode):
        raise OSError(errno.EINVAL, "It is a pipe or a device, not a file", str(path))
    return found


def read_file(path: str | Path, most_bytes: int = _MOST_BYTES) -> bytes:
    """Returns the content of a file; OSError as of ``demand_regular``, or where it is longer than ``most_bytes``."""
    size = demand_regular(path).st_size
    if size > most_bytes:
        raise OSError(errno.EFBIG, f"It has {size} bytes, and {most_bytes} at most were expected", str(path))
    return Path(path).read_bytes()


def line_of(error: UnicodeDecodeError) -> int:
    """Returns the line, from 1, of the byte that is no UTF-8 in what was read whole."""
    return error.object.count(b"\n", 0, error.start) + 1


def read_text(path: str | Path) -> str:
    """Returns a file's UTF-8 text, without a byte order mark; OSError as of ``read_file``, or UnicodeDecodeError."""
    return read_file(path).decode("utf-8-sig")
