"""Progress of a sweep on the terminal."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping, Sequence, Sized
from typing import TYPE_CHECKING, Self

from haploop.tools.sweep.record import VERDICT
from haploop.tools.sweep.table import ENDED, WHY, Row

if TYPE_CHECKING:
    from rich.console import Console

_REFRESH_PER_S = 4


class SweepProgress:
    """Cells done, cells per second, time left and what came of them, on a terminal; a context manager.

    Attributes:
        counts: of all rows, those of earlier calls too, by verdict, or by how a run ended that has none.
    """

    def __init__(self, title: str, terminal: Console | None = None) -> None:
        from rich import progress

        from haploop.tools.render.terminal import console

        self.counts: Counter[str] = Counter()
        self.ran, self.reason = 0, ""
        self._total, self._stopping = 0, False
        self._began = time.monotonic()
        terminal = terminal or console(stderr=True)
        self._bars = progress.Progress(
            progress.TextColumn("{task.description}"),
            progress.BarColumn(bar_width=20),
            progress.MofNCompleteColumn(),
            progress.TextColumn("{task.fields[rate]}"),
            progress.TimeRemainingColumn(compact=True),
            progress.TextColumn("{task.fields[counts]}"),
            console=terminal,
            disable=not terminal.is_terminal,
            transient=True,
            refresh_per_second=_REFRESH_PER_S,
        )
        self._task = self._bars.add_task(title, total=None, rate="", counts="")

    def __enter__(self) -> Self:
        self._bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bars.stop()

    def expect(self, cells: int) -> None:
        """Adds cells that are to be run."""
        self._total += cells
        self._bars.update(self._task, total=self._total)

    def add_rows(self, rows: Sequence[Row], stored: bool = False) -> None:
        """Takes cells that are done; ``stored`` are those of an earlier call."""
        self.counts.update(outcome(row) for row in rows)
        if not stored:
            self.ran += len(rows)
            self.reason = self.reason or next((row[WHY] for row in rows if not row.get(VERDICT)), "")
        else:
            self._total += len(rows)
        elapsed_s = time.monotonic() - self._began
        rate = f"{self.ran / elapsed_s:.3g} cells/s" if self.ran else ""
        done, counts = sum(self.counts.values()), describe_counts(self.counts)
        self._bars.update(self._task, completed=done, rate=rate, counts=counts)

    def stopping(self, received: Sized) -> bool:
        """Tells whether interrupts have been received; says so once, on a terminal or not."""
        if received and not self._stopping:
            self._stopping = True
            self._bars.console.print("Stopping after the cells under way; once more ends at once.", highlight=False)
        return bool(received)


def outcome(row: Row) -> str:
    """Returns a row in one word."""
    return row.get(VERDICT) or row[ENDED]


def describe_counts(counts: Mapping[str, int]) -> str:
    """Returns counts such as ``12 steady, 3 limit-cycle``, the most frequent first."""
    return ", ".join(f"{count} {word}" for word, count in sorted(counts.items(), key=lambda pair: (-pair[1], pair[0])))
