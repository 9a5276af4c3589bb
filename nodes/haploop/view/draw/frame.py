"""A picture as bytes: a header in JSON, then the columns of every table as 32-bit floats, little-endian.

uint32 length of the header | header, padded with spaces | of each table its columns one by one, padded with zeros.
Header and tables each begin at a multiple of 8 bytes, so that a browser looks at the columns where they lie.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np

from haploop.view.draw.table import Table


def encode(from_s: float, to_s: float, tables: Sequence[Table]) -> bytes:
    """One picture of a stretch of time."""
    header = {"from_s": from_s, "to_s": to_s, "tables": [table.header() for table in tables]}
    head = json.dumps(header, separators=(",", ":"), allow_nan=False).encode()
    head += b" " * (-(4 + len(head)) % 8)
    parts = [len(head).to_bytes(4, "little"), head]
    with np.errstate(over="ignore", invalid="ignore"):  # beyond what a float32 holds is infinite on the screen too
        for table in tables:
            data = table.values.astype("<f4").tobytes()
            parts += [data, bytes(-len(data) % 8)]
    return b"".join(parts)
