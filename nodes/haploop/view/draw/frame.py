"""A snapshot as bytes: a header in JSON, then the columns of every table as 32-bit floats, little-endian.

uint32 length of the header | header, padded with spaces | of each table its columns one by one, padded with zeros.
Header and tables each begin at a multiple of 8 bytes, so that a browser reads the columns in place.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Column = dict[str, str]


def column(name: str, unit: str, label: str) -> Column:
    """Returns the header entry of a column: its short name, its SI unit and its label in the legend."""
    return {"name": name, "unit": unit, "label": label}


@dataclass
class Table:
    """One table of a snapshot: columns of equal length at equal steps of time.


    Attributes:
        name: under which the page finds it.
        t0_s, dt_s: row i is at ``t0_s + i dt_s``, s.
        columns: header entry of each column.
        values: shape (columns, rows).
        envelope: whether each two rows are the extremes of one interval of time, instead of samples.
        more: further entries of the header.
    """

    name: str
    t0_s: float
    dt_s: float
    columns: list[Column]
    values: np.ndarray
    envelope: bool = False
    more: dict[str, Any] = field(default_factory=dict)

    def header(self) -> dict[str, Any]:
        """Returns the table's entry in the header of a snapshot."""
        rows = self.values.shape[1]
        head = {"name": self.name, "t0_s": self.t0_s, "dt_s": self.dt_s, "rows": rows, "columns": self.columns}
        return head | {"envelope": self.envelope} | self.more


def encode(from_s: float, to_s: float, tables: Sequence[Table]) -> bytes:
    """Returns the snapshot of an interval of time as bytes."""
    header = {"from_s": from_s, "to_s": to_s, "tables": [table.header() for table in tables]}
    head = json.dumps(header, separators=(",", ":"), allow_nan=False).encode()
    head += b" " * (-(4 + len(head)) % 8)
    parts = [len(head).to_bytes(4, "little"), head]
    with np.errstate(over="ignore", invalid="ignore"):  # beyond what a float32 holds is infinite on the screen too
        for table in tables:
            data = table.values.astype("<f4").tobytes()
            parts += [data, bytes(-len(data) % 8)]
    return b"".join(parts)
