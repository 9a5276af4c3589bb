"""Sweeps run by their engine alone, perhaps stopped, and the rows that they leave."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pyarrow.parquet

from haploop.tools.executor.pool import Pool
from haploop.tools.sweep.boundary import Boundary
from haploop.tools.sweep.engine import Engine, Stopped, SweepProgress
from haploop.tools.sweep.store import Store
from haploop.tools.sweep.table import make_schema


class Quiet(SweepProgress):
    """Keeps what is reported to it."""

    def __init__(self) -> None:
        super().__init__("quiet")
        self.expected, self.cells, self.stored = 0, [], 0

    def expect(self, cells: int) -> None:
        self.expected += cells

    def add_rows(self, rows: Any, stored: bool = False) -> None:
        self.stored += len(rows) if stored else 0
        self.cells += [] if stored else [row["cell"] for row in rows]


def engine_run(made: Any, out: Path, stop_after: int | None = None, workers: int = 1) -> tuple[Quiet, list[Boundary]]:
    """Runs a sweep into a directory, stopped after ``stop_after`` cells; returns the progress and the boundaries."""
    out.mkdir(exist_ok=True)
    (out / "sweep.toml").write_text(made.toml())
    told = Quiet()
    with Store(out, make_schema(made.columns(), made.toml())) as store, Pool(workers) as pool:
        stop = lambda _: stop_after is not None and len(told.cells) >= stop_after  # noqa: E731
        try:
            return told, Engine(made, store, pool, told, stop).run()
        except Stopped:
            return told, []


def rows(directory: Path) -> list[dict[str, Any]]:
    return pyarrow.parquet.read_table(directory / "table.parquet").to_pylist()
