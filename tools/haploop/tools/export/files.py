"""Files that appear under their names only when they are whole."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

from haploop.launch.output import OutputError


class ExportFailed(Exception):
    """The files could not be written to their end; the message says why, and nothing of them is left."""


@contextlib.contextmanager
def new_files(targets: Sequence[Path], replace: bool) -> Iterator[list[IO[bytes]]]:
    """Open a file for each target, under the target's name with ``.part`` after it; they take their names at the end.

    When something raises on the way, no part is left and what stood under the names stays.

    Raises:
        OutputError: a target exists already and ``replace`` is not set, or a file cannot be made.
        ExportFailed: the operating system refuses to write on.
    """
    for target in targets:
        if target.is_dir() or (target.exists() and not replace):
            hint = "" if target.is_dir() else ", or write over it with --force"
            raise OutputError(f"{target} exists already; name another place with --out{hint}.")
    parts = [target.with_name(f"{target.name}.part") for target in targets]
    opened: list[IO[bytes]] = []
    try:
        for part in parts:
            opened.append(_open(part))
        try:
            yield opened
            for file in opened:
                file.close()
            for part, target in zip(parts, targets, strict=True):
                part.replace(target)
        except OSError as error:
            raise ExportFailed(
                f"Writing to {targets[0].parent} failed ({error.strerror or error}); nothing was exported. "
                "Make room there or name another place with --out."
            ) from error
    finally:
        for file, part in zip(opened, parts, strict=False):
            with contextlib.suppress(OSError):
                file.close()
            part.unlink(missing_ok=True)


def _open(part: Path) -> IO[bytes]:
    try:
        part.parent.mkdir(parents=True, exist_ok=True)
        return part.open("wb")
    except OSError as error:
        raise OutputError(
            f"{part} cannot be made ({error.strerror}); name a place that is writable with --out."
        ) from error
