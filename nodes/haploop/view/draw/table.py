"""One table of a picture: columns of equal length at equal steps of time, and how the page knows them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

Column = dict[str, str]


def column(name: str, unit: str, label: str) -> Column:
    """How the page knows a column: a short name, an SI unit, and words for the legend."""
    return {"name": name, "unit": unit, "label": label}


@dataclass
class Table:
    """Values of shape (columns, rows); row i is at ``t0_s + i dt_s``.

    Attributes:
        envelope: whether each two rows are the extremes of one stretch of time, instead of samples.
        more: what else the page is told.
    """

    name: str
    t0_s: float
    dt_s: float
    columns: list[Column]
    values: np.ndarray
    envelope: bool = False
    more: dict[str, Any] = field(default_factory=dict)

    def header(self) -> dict[str, Any]:
        """The table's entry in the header of a picture."""
        rows = self.values.shape[1]
        head = {"name": self.name, "t0_s": self.t0_s, "dt_s": self.dt_s, "rows": rows, "columns": self.columns}
        return head | {"envelope": self.envelope} | self.more
