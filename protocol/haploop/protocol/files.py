"""Reading of files that somebody names: only regular files up to a size; for others an OSError says why in words."""

from __future__ import annotations

import errno
import math
import os
import stat
from pathlib import Path

# No text file that a person or a run of this program has written is larger than this.
MOST_BYTES = 1 << 26


def demand_regular(path: str | Path, most_bytes: float = math.inf) -> os.stat_result:
    """Returns size and times of a file that can be read to its end.

    Raises:
        OSError: there is no such file, it is a directory, a pipe or a device, or longer than ``most_bytes``;
            ``strerror`` says so in words.
    """
    try:
        found = Path(path).stat()
    except ValueError as error:
        raise OSError(errno.EINVAL, "A file name cannot contain a NUL character", str(path)) from error
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(found.st_mode):
        raise OSError(errno.EINVAL, "It is a pipe or a device, not a file", str(path))
    if found.st_size > most_bytes:
        raise OSError(errno.EFBIG, f"It has {found.st_size} bytes, but at most {most_bytes} were expected", str(path))
    return found


def read_file(path: str | Path, most_bytes: int = MOST_BYTES) -> bytes:
    """Returns a file's content; raises OSError as ``demand_regular`` does."""
    demand_regular(path, most_bytes)
    return Path(path).read_bytes()


def line_of(error: UnicodeDecodeError) -> int:
    """Returns the line, counted from 1, of the byte that is not UTF-8; the file must have been decoded as a whole."""
    return error.object.count(b"\n", 0, error.start) + 1


def read_text(path: str | Path) -> str:
    """Returns a file's UTF-8 text without a byte order mark; raises OSError as ``read_file``, or UnicodeDecodeError."""
    return read_file(path).decode("utf-8-sig")
