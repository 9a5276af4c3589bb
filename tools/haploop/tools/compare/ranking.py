"""What can be told apart: two stabilizers whose intervals have no point in common, under either set of seeds."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations
from typing import NamedTuple

from haploop.tools.compare.bench import Row
from haploop.tools.compare.comparison import OfLoop
from haploop.tools.search.intervals import Interval, mean_interval


def held(row: Row) -> Interval:
    """Returns the stiffness that is rendered while the wall is held, with its interval over the seeds, N/m."""
    return mean_interval([each.rendered.held_N_m for each in row.seeds])


class Ranking(NamedTuple):
    """Pairs of stabilizers that are apart under the seeds told, the one that renders more first.

    Attributes:
        told: all of them.
        reproduced: those that are apart the same way under the other seeds, too.
        contradicted: those that are apart the other way there.
    """

    told: frozenset[tuple[str, str]]
    reproduced: frozenset[tuple[str, str]]
    contradicted: frozenset[tuple[str, str]]

    def versus(self, some: str, other: str) -> str:
        """Returns "more", "less", or "alike" where they cannot be told apart under both sets of seeds."""
        if (some, other) in self.reproduced:
            return "more"
        return "less" if (other, some) in self.reproduced else "alike"


def apart(rows: Iterable[Row]) -> frozenset[tuple[str, str]]:
    """Returns the pairs whose intervals have no point in common, the larger first."""
    pairs = set[tuple[str, str]]()
    for (some, held_N_m), (other, than_N_m) in combinations([(row.family, held(row)) for row in rows], 2):
        if held_N_m.apart(than_N_m):
            pairs.add((some, other) if held_N_m.value > than_N_m.value else (other, some))
    return frozenset(pairs)


def ranking(of: OfLoop) -> Ranking:
    """Returns the ranking of a loop; without other seeds nothing is reproduced."""
    told, again = apart(of.rows), apart(of.again)
    contradicted = frozenset((more, less) for more, less in told if (less, more) in again)
    return Ranking(told, told & again, contradicted)


def best(of: OfLoop) -> tuple[Row, list[Row]]:
    """Returns the row that renders most, and those that cannot be told from it under both sets of seeds, as listed."""
    found, order = max(of.rows, key=lambda row: held(row).value), ranking(of)
    return found, [row for row in of.rows if row is not found and order.versus(found.family, row.family) == "alike"]
