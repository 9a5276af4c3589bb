"""Printed output of the code in a node: kept in a file of the run, every line marked with the node and its tick."""

from __future__ import annotations

import contextlib
import io
import os
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any


class NodeOutput(io.TextIOWrapper):
    """A standard stream that marks lines as they are printed; ``close`` leaves it open.

    Bytes that are not text pass unchanged. A file that takes no more (a full disk) is no error for whoever prints.

    Attributes:
        lines: the raw stream below; its ``tick`` returns the tick at work, and is None before there is one.
    """

    def __init__(self, role: str, descriptor: int) -> None:
        self.lines = _Lines(role, descriptor)
        buffer = io.BufferedWriter(self.lines)
        super().__init__(buffer, encoding="utf-8", errors="backslashreplace", line_buffering=True)

    def close(self) -> None:
        self.flush()


class _Lines(io.RawIOBase):
    def __init__(self, role: str, descriptor: int) -> None:
        self._role, self._descriptor = role, descriptor
        self.tick: Callable[[], int] | None = None
        self._within_line = False
        self._lock = threading.Lock()

    def writable(self) -> bool:
        return True

    def write(self, data: Any) -> int:
        text = bytes(data)
        mark = f"{self._role}, tick {self.tick()}: ".encode() if self.tick else f"{self._role}: ".encode()
        with self._lock:
            marked = (b"" if self._within_line else mark) + text[:-1].replace(b"\n", b"\n" + mark) + text[-1:]
            self._within_line = not text.endswith(b"\n")
            with contextlib.suppress(OSError):
                os.write(self._descriptor, marked)
        return len(text)


def keep_prints(role: str, file: Path) -> None:
    """Appends standard output and error of this process to a file, or to standard error if it cannot be opened.

    The streams have a descriptor of their own: code that closes number 1 or 2 closes no socket that takes its place.
    """
    try:
        descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW, 0o666)
    except OSError:
        descriptor = os.dup(2)
    else:
        os.dup2(descriptor, 1)
        os.dup2(descriptor, 2)
    sys.stdout, sys.stderr = NodeOutput(role, descriptor), NodeOutput(role, descriptor)


@contextlib.contextmanager
def unheard() -> Iterator[None]:
    """Discards what is printed meanwhile by code that has already printed it, in the run that is repeated."""
    with (
        Path(os.devnull).open("w", encoding="utf-8") as nowhere,
        contextlib.redirect_stdout(nowhere),
        contextlib.redirect_stderr(nowhere),
    ):
        yield


def mark_ticks(tick: Callable[[], int]) -> None:
    """Marks what this node prints from now on with the tick at work."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, NodeOutput):
            stream.lines.tick = tick
