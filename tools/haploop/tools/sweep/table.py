"""The table of a sweep: its columns as Parquet, and reading it, finished or not, as NumPy columns."""

from __future__ import annotations

import json
import tomllib
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from haploop.logger.summary import versions
from haploop.protocol.files import demand_regular, read_text
from haploop.protocol.names import meant

# Columns of every table beside the axes and what is recorded.
CELL, SEED, ENDED, WHY, SCENE = "cell", "seed", "ended", "why", "scene"
# Kinds of column, and the types they have in Parquet.
NUMBER, WHOLE, TEXT, TRUTH = "float64", "int64", "string", "bool"
# Separates the texts of a list that is recorded.
JOINS = "; "
# Column of what a verdict rests on.
PROVISOS = "stability.provisos"
# A row, by column: numbers, text, truth values, None where there is no value.
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
    """Makes the schema: units are in the metadata of the fields, the resolved sweep and the versions in its own."""
    arrow = pyarrow()
    fields = []
    for column in columns:
        unit = {"unit": column.unit} if column.unit else None
        fields.append(arrow.field(column.name, arrow.type_for_alias(column.kind), metadata=unit))
    schema = arrow.schema(fields, metadata={"sweep": sweep, "versions": json.dumps(versions())})
    return schema.with_metadata({**schema.metadata, _CHECKSUM: _checksum(schema)})


# Key of the metadata: CRC-32 of the description of a table's numbers; the numbers have their own checksums.
_CHECKSUM = b"checksum"


def _checksum(schema: Any) -> bytes:
    fields = [(field.name, str(field.type), (field.metadata or {}).get(b"unit")) for field in schema]
    return b"%08x" % zlib.crc32(repr((fields, schema.metadata.get(b"sweep"))).encode())


def write_table(table: Any, file: Any) -> None:
    """Writes a table as Parquet, with checksums."""
    pyarrow().parquet.write_table(table, file, write_page_checksum=True)


def make_table(rows: Sequence[Row], schema: Any) -> Any:
    """Makes an Arrow table of rows; values that a row does not have are null."""
    arrow = pyarrow()
    arrays = [arrow.array([row.get(field.name) for row in rows], type=field.type) for field in schema]
    return arrow.Table.from_arrays(arrays, schema=schema)


SWEEP, TABLE, BOUNDARY, PARTS = "sweep.toml", "table.parquet", "boundary.parquet", "parts"


class TableError(Exception):
    """A sweep's table cannot be read; the message says why."""


@dataclass(frozen=True)
class SweepTable:
    """The results of a sweep so far; ``table["wall.stiffness"]`` is a column.

    Attributes:
        columns: by name, equally long, in the order of the cells: float64 (NaN where there is no value), int64, bool,
            or objects (str, None where there is no value).
        units: of the columns that have one.
        sweep: the resolved sweep.
        boundary: the columns of the boundaries; empty where none were sought, or while the sweep is not finished.
        finished: whether every cell is there.
    """

    columns: dict[str, np.ndarray]
    units: dict[str, str]
    sweep: ResolvedSweep
    boundary: dict[str, np.ndarray]
    finished: bool

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.columns:
            raise KeyError(
                f"There is no column {name}{meant(name, self.columns)}; there are {', '.join(self.columns)}."
            )
        return self.columns[name]

    def __len__(self) -> int:
        return len(self.columns[CELL])

    def __repr__(self) -> str:
        so_far = "" if self.finished else ", not finished"
        return f"<sweep of {len(self)} cells{so_far}: {', '.join(self.columns)}>"


def is_sweep(directory: Path) -> bool:
    """Tells whether a directory is that of a sweep."""
    return (Path(directory) / SWEEP).is_file()


def read(directory: str | Path) -> SweepTable:
    """Reads the table of a sweep; of a running or interrupted one, as much as is written.

    Raises:
        TableError: there is no sweep there, or its table cannot be read.
        NeedsPyarrow: pyarrow is not installed.
    """
    directory, arrow = Path(directory), pyarrow()
    try:
        text = read_text(directory / SWEEP)
        sweep = tomllib.loads(text)
    except OSError as error:
        raise TableError(f"{directory} holds no sweep that can be read: {SWEEP}: {error.strerror}.") from error
    except (ValueError, RecursionError) as error:
        raise TableError(f"{directory / SWEEP} is damaged: it is not TOML.") from error
    finished, boundary = (directory / TABLE).exists(), directory / BOUNDARY
    files = [directory / TABLE] if finished else sorted((directory / PARTS).glob("*.parquet"))
    tables = [read_part(file, text) for file in files]
    boundaries = _columns(read_part(boundary, text)) if finished and boundary.exists() else {}
    if not tables:
        raise TableError(f"The sweep in {directory} has no finished cell yet.")
    whole = arrow.concat_tables(tables).sort_by(CELL)
    described = [field for field in whole.schema if b"unit" in (field.metadata or {})]
    units = {field.name: field.metadata[b"unit"].decode() for field in described}
    return SweepTable(_columns(whole), units, sweep, boundaries, finished)


def read_part(path: Path, sweep: str) -> Any:
    """Reads a Parquet file of a sweep, whose text it holds; TableError where it is damaged or of another sweep."""
    arrow, why = pyarrow(), "haploop did not write it"
    try:
        demand_regular(path)
        # Threads and read-ahead would keep extra memory for every file.
        file = arrow.parquet.ParquetFile(path, page_checksum_verification=True)
        table = file.read(use_threads=False)
        held = table.schema.metadata or {}
        if held.get(_CHECKSUM) not in (None, _checksum(table.schema)):
            why = "its columns do not match their checksum"
        elif held.get(b"sweep", b"").decode() != sweep:
            why = f"it belongs to another sweep than {SWEEP} beside it"
        else:
            return table
    except OSError as error:
        why = error.strerror or "it is damaged"
    except (arrow.lib.ArrowException, ValueError, TypeError, ArithmeticError, LookupError) as error:
        raise TableError(f"{path} cannot be read: it is damaged.") from error
    raise TableError(f"{path} cannot be read: {why}.")


def _columns(table: Any) -> dict[str, np.ndarray]:
    return {name: table[name].to_numpy() for name in table.column_names}
