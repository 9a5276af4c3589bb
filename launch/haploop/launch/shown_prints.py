"""Printed output of the nodes on the terminal: the first lines as they come, then few; a file holds all of it."""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path

PRINTS = "prints.txt"
_LOOK_S = 0.1
# Lines shown at once, and in each second after that.
_AT_ONCE, _EACH_SECOND = 20, 1.0
_MOST_BYTES, _LONGEST, _LONGEST_OF_OWN = 65_536, 200, 1000


class ShownPrints:
    """Shows on stderr what is added to a file; cuts lines longer than 200 characters, replaces what is not text."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._read = 0
        self._due = self._counted = 0.0
        self._budget: float = _AT_ONCE
        self._said = False
        self._told = 0

    def look(self, now: float) -> None:
        """Shows what is new, given the wall time in s; cheap, and done no more often than every 0.1 s."""
        if now < self._due:
            return
        self._budget = min(_AT_ONCE, self._budget + (now - self._counted) * _EACH_SECOND)
        self._counted, self._due = now, now + _LOOK_S
        lines, is_all = self._new()
        shown = lines[: int(self._budget)]
        self._budget -= len(shown)
        self._show(shown)
        if len(shown) < len(lines) or not is_all:
            self._skip()

    def tell(self, sentences: list[str]) -> None:
        """Shows the run's own messages whole, and empties the list; at most some 20 per run."""
        self._told += len(sentences)
        if self._told <= _AT_ONCE:
            self._show(sentences, longest=_LONGEST_OF_OWN)
        sentences.clear()

    def close(self, failed: bool) -> None:
        """Shows the last lines of a run that failed, or what is left to show of any other; removes an empty file."""
        lines, is_all = self._new(ended=True)
        if not is_all:
            self._skip()
            self._read = max(0, self._read - _MOST_BYTES)
            lines, _ = self._new(ended=True)
        self._show(lines[-_AT_ONCE:] if failed else lines[: int(self._budget)])
        if not failed and len(lines) > int(self._budget):
            self._skip()
        with contextlib.suppress(OSError):
            if not self._file.stat().st_size:
                self._file.unlink()

    def _new(self, ended: bool = False) -> tuple[list[str], bool]:
        """Returns the lines that have come, at most 64 KiB, and whether these are all."""
        try:
            with self._file.open("rb") as file:
                file.seek(self._read)
                data = file.read(_MOST_BYTES)
        except OSError:  # nothing was printed yet, or the directory is gone
            return [], True
        is_all = len(data) < _MOST_BYTES
        whole = data if ended or not is_all else data[: data.rfind(b"\n") + 1]
        self._read += len(whole)
        return whole.decode(errors="replace").splitlines(), is_all

    def _skip(self) -> None:
        with contextlib.suppress(OSError):
            self._read = self._file.stat().st_size
        if not self._said:
            self._said = True
            self._show([f"More was printed than is shown here; all of it is in {self._file}."])

    def _show(self, lines: list[str], longest: int = _LONGEST) -> None:
        with contextlib.suppress(OSError, ValueError):  # a terminal that is gone must not end the run
            for line in lines:
                text = line if line.isprintable() else "".join(c if c.isprintable() else "?" for c in line)
                print(text if len(text) <= longest else f"{text[:longest]} ...", file=sys.stderr)
