"""The table of a sweep: its columns as Parquet, and reading it, finished or not, as NumPy columns."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from haploop.logger.summary import versions

# What stands in every table beside the axes and what is recorded.
CELL, SEED, ENDED, WHY, SCENE = "cell", "seed", "ended", "why", "scene"
# Kinds of column, and the types they have in Parquet.
NUMBER, WHOLE, TEXT, TRUTH = "float64", "int64", "string", "bool"
# A row by column: numbers, text, truth values, None where there is nothing.
Row = dict[str, Any]
# What sweep.toml holds: title, repeat, record, axes (values by key), bisect and base, the tables of the scene.
ResolvedSweep = dict[str, Any]


class NeedsPyarrow(ImportError):
    """Tables are Parquet, and pyarrow is not installed."""


def pyarrow() -> Any:
    """Imports pyarrow with its Parquet; NeedsPyarrow where it is not installed."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise NeedsPyarrow(
            "A sweep writes Parquet, which needs pyarrow; install it with: pip install 'haploop[parquet]'"
        ) from error
    return pyarrow


@dataclass(frozen=True)
class Column:
    """One column: its name, its kind, and the unit of its numbers."""

    name: str
    kind: str
    unit: str = ""


def make_schema(columns: Iterable[Column], sweep: str) -> Any:
    """Makes the schema; units stand in the metadata of the fields, the resolved sweep and the versions in its own."""
    arrow = pyarrow()
    fields = []
    for column in columns:
        unit = {"unit": column.unit} if column.unit else None
        fields.append(arrow.field(column.name, arrow.type_for_alias(column.kind), metadata=unit))
    return arrow.schema(fields, metadata={"sweep": sweep, "versions": json.dumps(versions())})


def make_table(rows: Sequence[Row], schema: Any) -> Any:
    """Makes an Arrow table of rows; what a row does not have is null."""
    arrow = pyarrow()
    arrays = [arrow.array([row.get(field.name) for row in rows], type=field.type) for field in schema]
    return arrow.Table.from_arrays(arrays, schema=schema)


SWEEP, TABLE, BOUNDARY, PARTS = "sweep.toml", "table.parquet", "boundary.parquet", "parts"


class TableError(Exception):
    """There is no sweep's table to be read; the message says why."""


@dataclass(frozen=True)
class SweepTable:
    """The results of a sweep so far; ``table["wall.stiffness"]`` is a column.

    Attributes:
        columns: by name, equally long, in the order of the cells: float64 (NaN where there is nothing), int64, bool,
            or objects (str, None where there is nothing).
        units: of the columns that have one.
        sweep: the resolved sweep.
        boundary: the columns of the boundaries; empty where none were sought, or as long as the sweep goes on.
        finished: whether every cell is there.
    """

    columns: dict[str, np.ndarray]
    units: dict[str, str]
    sweep: ResolvedSweep
    boundary: dict[str, np.ndarray]
    finished: bool

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.columns:
            raise KeyError(f"There is no column {name}; there are {', '.join(self.columns)}.")
        return self.columns[name]

    def __len__(self) -> int:
        return len(self.columns[CELL])


def is_sweep(directory: Path) -> bool:
    """Tells whether a directory is that of a sweep."""
    return (Path(directory) / SWEEP).is_file()


def read(directory: str | Path) -> SweepTable:
    """Reads the table of a sweep, of a running or interrupted one as far as it is written.

    Raises:
        TableError: there is no sweep there, or its table cannot be read.
        NeedsPyarrow: pyarrow is not installed.
    """
    directory, arrow = Path(directory), pyarrow()
    try:
        sweep = tomllib.loads((directory / SWEEP).read_text(encoding="utf-8"))
        finished = (directory / TABLE).exists()
        files = [directory / TABLE] if finished else sorted((directory / PARTS).glob("*.parquet"))
        tables = [arrow.parquet.read_table(file) for file in files]
        boundary = directory / BOUNDARY
        boundaries = _columns(arrow.parquet.read_table(boundary)) if finished and boundary.exists() else {}
    except (OSError, ValueError) as error:
        raise TableError(f"{directory} holds no sweep that can be read: {error}") from error
    if not tables:
        raise TableError(f"The sweep in {directory} has no finished cell yet.")
    whole = arrow.concat_tables(tables).sort_by(CELL)
    described = [field for field in whole.schema if b"unit" in (field.metadata or {})]
    units = {field.name: field.metadata[b"unit"].decode() for field in described}
    return SweepTable(_columns(whole), units, sweep, boundaries, finished)


def _columns(table: Any) -> dict[str, np.ndarray]:
    return {name: table[name].to_numpy() for name in table.column_names}
