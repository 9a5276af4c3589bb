"""Comparisons of stabilizers that were never searched: what every one holds is given."""

import numpy as np

from haploop.tools.advise.families import STABILIZERS, Family
from haploop.tools.advise.walls.rendered import Rendered, Trying
from haploop.tools.compare.bench import BESIDE, Effort, Row
from haploop.tools.compare.comparison import AGAIN, TOLD, Comparison, OfLoop

# About what a seed holds less or more than another.
WAVES = (-1.0, 1.0, -0.5, 0.5)


def row(family: Family, held_N_m: float, block: int = TOLD, spread_N_m: float = 10.0) -> Row:
    """A row whose seeds hold about so much."""
    seeds = [Trying(held_N_m, held_N_m, Rendered(held_N_m + spread_N_m * wave), np.inf, None) for wave in WAVES]
    return Row(family.name, block, (1.0,) * len(family.parts), (), tuple(seeds))


def compared(**held_N_m: float) -> Comparison:
    """A comparison on one loop, in which all stabilizers but those named hold 1000 N/m."""
    told = [held_N_m.get(name, 1000.0) for name in (family.name.replace(" ", "_") for family in STABILIZERS)]
    rows, again = (
        tuple(row(family, value, block) for family, value in zip(STABILIZERS, told, strict=True))
        for block in (TOLD, AGAIN)
    )
    loop = OfLoop("as described", 0.0, 1000.0, rows, again)
    return Comparison("a device", "a task", (), Effort(), BESIDE, (loop,))
