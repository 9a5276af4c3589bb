"""The columns of a sweep's table, as Parquet holds them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from haploop.logger.summary import versions

# What stands in every table beside the axes and what is recorded.
CELL, SEED, ENDED, WHY, SCENE = "cell", "seed", "ended", "why", "scene"
# Kinds of column, and the types they have in Parquet.
NUMBER, WHOLE, TEXT, TRUTH = "float64", "int64", "string", "bool"


class NeedsPyarrow(ImportError):
    """Tables are Parquet, and pyarrow is not installed."""


def pyarrow() -> Any:
    """The module, with its Parquet.

    Raises:
        NeedsPyarrow: it is not installed.
    """
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


def schema_of(columns: Iterable[Column], sweep: str) -> Any:
    """The schema; units stand in the metadata of the fields, the resolved sweep and the versions in its own."""
    arrow = pyarrow()
    fields = [
        arrow.field(
            column.name, arrow.type_for_alias(column.kind), metadata={"unit": column.unit} if column.unit else None
        )
        for column in columns
    ]
    return arrow.schema(fields, metadata={"sweep": sweep, "versions": json.dumps(versions())})


def table_of(rows: Sequence[Mapping[str, Any]], schema: Any) -> Any:
    """Rows as an Arrow table; what a row does not have is null."""
    arrow = pyarrow()
    arrays = [arrow.array([row.get(field.name) for row in rows], type=field.type) for field in schema]
    return arrow.Table.from_arrays(arrays, schema=schema)
