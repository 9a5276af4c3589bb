"""The search for the reading of the experiments that is nearest to the paper: at random, then around the best."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from haploop.tools.studies.choi2022.experiment.map_parallel import many
from haploop.tools.studies.choi2022.experiment.reading_rows import gap_N_m, rows
from haploop.tools.studies.choi2022.experiment.readings import around, draw, structure
from haploop.tools.studies.choi2022.experiment.setup import FRICTION_N, Setup
from haploop.tools.studies.choi2022.work import Work

SEED = 2022


@dataclass(frozen=True)
class Size:
    """How much is searched.

    Attributes:
        structures, each: readings at random: so many structures, and readings of each.
        rounds, best, groups, children: of refinement: around so many of the best so many groups of others, which have
            a delay in common, again and again.
        neighbours: around the nearest, to see how robust it is.
    """

    structures: int
    each: int
    rounds: int
    best: int
    groups: int
    children: int
    neighbours: int


WHOLE = Size(structures=24, each=24, rounds=2, best=3, groups=3, children=8, neighbours=24)
SMALL = Size(structures=1, each=2, rounds=1, best=1, groups=1, children=1, neighbours=1)
# How far the refinement strays in its first and last round: standard deviations of ln.
FAR, CLOSE = 0.15, 0.05


@dataclass(frozen=True)
class Found:
    """What was found.

    Attributes:
        rows: of every reading, with ``stage``: "random", "refined", "neighbour" or "friction".
        nearest: the one nearest to the paper.
        row: that of the nearest.
        with_friction: the row of the nearest with the published friction.
    """

    rows: list[dict[str, Any]]
    nearest: Setup
    row: dict[str, Any]
    with_friction: dict[str, Any]

    def of(self, stage: str) -> list[dict[str, Any]]:
        """The rows of a stage."""
        return [row for row in self.rows if row["stage"] == stage]


Seen = list[tuple[Setup, dict[str, Any]]]


def search(work: Work) -> Found:
    """Search with the fixed seed; the same sizes give the same rows, whatever the number of workers.

    It is without friction, which takes some forty times as long to run; the nearest alone is run with it, too.
    """
    size, rng = SMALL if work.small else WHOLE, np.random.default_rng(SEED)
    seen = _run(work, draw(rng, size.structures, size.each), "random")
    for spread in np.geomspace(FAR, CLOSE, size.rounds):
        parents = _best(seen, size.best)
        groups = [around(rng, parent, float(spread), size.children) for parent in parents for _ in range(size.groups)]
        seen += _run(work, groups, "refined")
    nearest, row = min(seen, key=_key)
    beside = [around(rng, nearest, CLOSE, size.neighbours, delayed=False)]
    near = _run(work, beside, "neighbour")
    rough = _run(work, [[replace(nearest, friction_N=0.0 if work.small else FRICTION_N)]], "friction")
    return Found([row for _, row in [*seen, *near, *rough]], nearest, row, rough[0][1])


def _key(one: tuple[Setup, dict[str, Any]]) -> tuple[float, float]:
    """By the distance, and where that is the same by how much the largest stiffnesses differ from the paper's."""
    return one[1]["distance"], gap_N_m(one[1])


def _run(work: Work, groups: Sequence[Sequence[Setup]], name: str) -> Seen:
    """Every reading with its row, in order."""
    answers = many(work, f"readings of the experiments, {name}, in groups", rows, groups)
    return [
        (setup, row | {"stage": name})
        for group, answer in zip(groups, answers, strict=True)
        for setup, row in zip(group, answer, strict=True)
    ]


def _best(seen: Seen, count: int) -> list[Setup]:
    """The nearest readings, no more than half of them of one structure."""
    picked: list[Setup] = []
    for setup, _ in sorted(seen, key=lambda one: one[1]["distance"]):
        if sum(structure(other) == structure(setup) for other in picked) < max(1, count // 2):
            picked.append(setup)
        if len(picked) == count:
            break
    return picked


def columns(found: Iterable[dict[str, Any]]) -> dict[str, list[Any]]:
    """Rows as columns, for the data beside the figure."""
    table = list(found)
    return {key.replace(" ", "_"): [row[key] for row in table] for key in table[0]}
