"""Rankings of stabilizers: two are apart if their difference, seed by seed, is far from 0 under both sets of seeds."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations
from typing import NamedTuple

import numpy as np

from haploop.tools.advise.families import NOTHING
from haploop.tools.compare.bench import Row
from haploop.tools.compare.comparison import OfLoop
from haploop.tools.search.intervals import Interval, mean_interval

# Of some thousand pairs on a page a twentieth is beyond its 95 % interval by chance; so pairs are told apart by this
# many standard errors.
_ERRORS = 3.0


def held(row: Row) -> Interval:
    """Returns the stiffness that is rendered while the wall is held, with its interval over the seeds, N/m."""
    return mean_interval([each.rendered.held_N_m for each in row.seeds])


def more(row: Row, than: Row) -> Interval:
    """Returns how much more is held than with another stabilizer, N/m, with its 95 % interval."""
    return mean_interval(_differences(row, than))


def _differences(row: Row, than: Row) -> np.ndarray:
    """Returns the differences seed by seed, N/m: under a seed both bear the same conditions."""
    both = zip(row.seeds, than.seeds, strict=True)
    return np.array([one.rendered.held_N_m - other.rendered.held_N_m for one, other in both])


def without(rows: Sequence[Row]) -> Row:
    """Returns the row of no element."""
    return next(row for row in rows if row.family == NOTHING.name)


class Ranking(NamedTuple):
    """Pairs of stabilizers that are apart under the seeds shown, the one that renders more first.

    Attributes:
        told: all of them.
        reproduced: those that are apart in the same direction under the other seeds, too.
        contradicted: those that are apart in the opposite direction there.
    """

    told: frozenset[tuple[str, str]]
    reproduced: frozenset[tuple[str, str]]
    contradicted: frozenset[tuple[str, str]]

    def versus(self, some: str, other: str) -> str:
        """Returns "more", "less", or "alike" where they cannot be told apart under both sets of seeds."""
        if (some, other) in self.reproduced:
            return "more"
        return "less" if (other, some) in self.reproduced else "alike"


def apart(rows: Sequence[Row]) -> frozenset[tuple[str, str]]:
    """Returns the pairs, the larger first, whose mean difference is more than three of its standard errors."""
    pairs = set[tuple[str, str]]()
    for some, other in permutations(rows, 2):
        differences = _differences(some, other)
        error = float(np.std(differences, ddof=1)) / len(differences) ** 0.5
        if float(np.mean(differences)) > _ERRORS * error:
            pairs.add((some.family, other.family))
    return frozenset(pairs)


def ranking(of: OfLoop) -> Ranking:
    """Returns the ranking of a loop."""
    told, again = apart(of.rows), apart(of.again)
    contradicted = frozenset((more, less) for more, less in told if (less, more) in again)
    return Ranking(told, told & again, contradicted)


def best(of: OfLoop) -> tuple[Row, list[Row]]:
    """Returns the row that renders most, and those that cannot be told from it under both sets of seeds, as listed."""
    found, order = max(of.rows, key=lambda row: held(row).value), ranking(of)
    return found, [row for row in of.rows if row is not found and order.versus(found.family, row.family) == "alike"]


def choice(of: OfLoop) -> Row:
    """Returns the stabilizer to use: the first in the list that can be told to hold more than no element, and not less
    than any other; no element if there is none."""
    order = ranking(of)
    gains = [row for row in of.rows if order.versus(row.family, NOTHING.name) == "more"]
    unbeaten = [row for row in gains if all(order.versus(row.family, other.family) != "less" for other in gains)]
    return [*unbeaten, without(of.rows)][0]
