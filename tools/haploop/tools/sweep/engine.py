"""Runs a sweep and shows its progress: every cell not stored yet, then the boundaries, then one table of all rows."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence, Sized
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any, Self

from haploop.protocol.amounts import fixed
from haploop.tools.executor.pool import Group, Pool, Stop
from haploop.tools.executor.work import Work
from haploop.tools.render.terminal import console
from haploop.tools.sweep.boundary import Boundary, Candidate, find_boundaries, verdict_is
from haploop.tools.sweep.cells import Axis, Bisect, Extra, Item, Sweep
from haploop.tools.sweep.record import VERDICT, wants_energy, wants_trajectories
from haploop.tools.sweep.store import Store
from haploop.tools.sweep.table import (
    CELL,
    ENDED,
    JOINS,
    NUMBER,
    PROVISOS,
    SEED,
    TEXT,
    WHOLE,
    WHY,
    Column,
    Row,
    make_schema,
    make_table,
)

if TYPE_CHECKING:
    from rich.console import Console

_REFRESH_PER_S = 4


class Stopped(Exception):
    """A sweep was asked to stop; the cells that are done are stored."""


class SweepProgress:
    """Cells done, cells per second, time left and results so far, on a terminal; a context manager.

    Attributes:
        counts: number of all rows, those of earlier calls too, by verdict, or by how a run without one ended.
        provisos: number of the steady rows by what they rest on.
    """

    def __init__(self, title: str, terminal: Console | None = None) -> None:
        from rich import progress

        self.counts, self.provisos = Counter[str](), Counter[str]()
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
        """Adds to the number of cells to be run."""
        self._total += cells
        self._bars.update(self._task, total=self._total)

    def add_rows(self, rows: Sequence[Row], stored: bool = False) -> None:
        """Takes cells that are done; ``stored`` are those of an earlier call."""
        self.counts.update(outcome(row) for row in rows)
        for row in rows:
            if row.get(VERDICT) == "steady":
                self.provisos.update(filter(None, str(row.get(PROVISOS) or "").split(JOINS)))
        if not stored:
            self.ran += len(rows)
            self.reason = self.reason or next((row[WHY] for row in rows if not row.get(VERDICT)), "")
        else:
            self._total += len(rows)
        elapsed_s = time.monotonic() - self._began
        rate = f"{fixed(self.ran / elapsed_s)} cells/s" if self.ran else ""
        done, counts = sum(self.counts.values()), describe_counts(self.counts)
        self._bars.update(self._task, completed=done, rate=rate, counts=counts)

    def stopping(self, received: Sized, under_way: int) -> bool:
        """Tells whether interrupts have been received; says so once, on a terminal or not, with the cells under way."""
        if received and not self._stopping:
            self._stopping = True
            self._bars.console.print(
                f"Stopping after the cells in progress ({under_way}); interrupt again to end at once.",
                highlight=False,
            )
        return bool(received)


def outcome(row: Row) -> str:
    """Returns the outcome of a row in one word."""
    return row.get(VERDICT) or row[ENDED]


def describe_counts(counts: Mapping[str, int]) -> str:
    """Returns counts such as ``12 steady, 3 limit-cycle``, the most frequent first."""
    return ", ".join(f"{count} {word}" for word, count in sorted(counts.items(), key=lambda pair: (-pair[1], pair[0])))


class Engine:
    """One sweep that is being run.

    Args:
        store: where its rows go, and where those of an earlier call are.
        stop: called between parts with the number of cells under way; True ends the sweep after these.
        compiled: whether to run compiled by JAX.
    """

    def __init__(
        self,
        sweep: Sweep,
        store: Store,
        pool: Pool,
        progress: SweepProgress,
        stop: Stop,
        compiled: bool = False,
    ) -> None:
        self._sweep, self._store, self._pool, self._progress, self._stop = sweep, store, pool, progress, stop
        self._work = Work(
            make=sweep.scene,
            keep=sweep.row,
            sources=sweep.sources,
            energy=wants_energy(sweep.record),
            trajectories=wants_trajectories(sweep.record),
            compiled=compiled,
        )

    def run(self) -> list[Boundary]:
        """Runs the missing cells and writes the table; returns the boundaries, if they are sought.

        Raises:
            Stopped: before all was done.
            StoreError, ExecutorError, PluginError: a file, a worker, or a plugin in a worker failed.
        """
        if self._sweep.bisect is None:
            stored = self._store.done((CELL, ENDED, VERDICT))
            self._progress.add_rows(stored, stored=True)
            done = {row[CELL] for row in stored}
            self._progress.expect(self._sweep.count - len(done))
            for _ in self._rows(_without(self._sweep.groups(), done), self._sweep.count - len(done)):
                pass
            self._store.finish()
            return []
        found = self._bisected(self._sweep.bisect)
        self._store.finish(_boundary_table(self._sweep, self._sweep.bisect, found))
        return found

    def _rows(self, groups: Iterable[Group], count: int) -> Iterator[tuple[Item, Row]]:
        done = 0
        for part in self._pool.parts(self._work, groups, count, self._stop):
            rows = [row for _, row in part]
            self._store.add(rows)
            self._progress.add_rows(rows)
            done += len(rows)
            yield from part
        if done < count:
            raise Stopped

    def _bisected(self, bisect: Bisect) -> list[Boundary]:
        """Finds the boundary of every combination of the other axes and the seed, in that order."""
        axis, others = self._sweep.bisected(bisect)
        stored = {row[CELL]: row for row in self._store.done((CELL, ENDED, WHY, VERDICT))}
        self._progress.add_rows(list(stored.values()), stored=True)
        rows, next_cell = list(_rows_of(self._sweep, others)), 0

        def run(candidates: Sequence[Candidate]) -> Iterator[tuple[int, Row]]:
            """Runs a round: the grid at first, then one cell between its values in some of the rows."""
            nonlocal next_cell
            at_points = next_cell == 0
            items: list[Item] = []
            for row, value in candidates:
                places, repeat = rows[row]
                place = axis.values.index(value) if at_points else 0
                cell = self._sweep.number({**places, axis.key: place}, repeat)
                items.append(cell if at_points else Extra(next_cell + row, cell, value))
            next_cell += self._sweep.count if at_points else len(rows)
            places = {_cell(item): place for place, item in enumerate(items)}
            missing = sorted((item for item in items if _cell(item) not in stored), key=_cell)
            together = bool(missing) and self._sweep.together(missing[0])
            self._progress.expect(len(missing))
            for item in items:
                if _cell(item) in stored:
                    yield places[_cell(item)], stored[_cell(item)]
            for item, row in self._rows([Group(missing, together)], len(missing)):
                yield places[_cell(item)], row

        return find_boundaries(len(rows), axis.values, bisect.tolerance, run, verdict_is(bisect.holds), bisect.holds)


def _without(groups: Iterable[Group], done: set[int]) -> Iterator[Group]:
    """Yields the cells of the groups that are not done, in stretches without a gap."""
    for group in groups:
        ends = [group.items[0] - 1, *(cell for cell in group.items if done and cell in done), group.items[-1] + 1]
        for before, after in pairwise(ends):
            if after - before > 1:
                yield Group(range(before + 1, after), group.together)


def _rows_of(sweep: Sweep, others: Sequence[Axis]) -> Iterator[tuple[dict[str, int], int]]:
    """Yields a place on each other axis and a repeat for every row that is bisected."""
    for *places, repeat in product(*(range(len(other.values)) for other in others), range(sweep.repeat)):
        yield {other.key: place for other, place in zip(others, places, strict=True)}, repeat


def _cell(item: Item) -> int:
    return item.cell if isinstance(item, Extra) else item


def _boundary_table(sweep: Sweep, bisect: Bisect, found: Sequence[Boundary]) -> Any:
    axis, others = sweep.bisected(bisect)
    numbers = [Column(name, NUMBER, axis.unit or "") for name in ("low", "high", "boundary")]
    columns = [*sweep.key_columns(others), *numbers, Column("changes", WHOLE), Column(WHY, TEXT)]
    rows: list[Row] = []
    for (places, repeat), one in zip(_rows_of(sweep, others), found, strict=True):
        row = {SEED: sweep.base.seed + repeat, "changes": one.changes, WHY: one.why}
        row |= {other.key: other.entry(other.values[places[other.key]]) for other in others}
        if not math.isnan(one.near):
            row |= {"low": one.low, "high": one.high, "boundary": bisect.tolerance.middle(one.near, one.far)}
        rows.append(row)
    return make_table(rows, make_schema(columns, sweep.toml()))
