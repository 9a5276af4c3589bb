"""The search for readings under which the paper's Fig. 6 comes out: at random, then around the best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from haploop.tools.executor.executors import Executor, make_executor, map_parallel
from haploop.tools.render.progress import Stage
from haploop.tools.studies.choi2022.simulation.reading import BASE, Reading, draw
from haploop.tools.studies.choi2022.simulation.reading_runs import shortfalls

SEED = 2022


@dataclass(frozen=True)
class Size:
    """How much is searched.

    Attributes:
        structures, each: readings at random: so many structures, and readings of each.
        rounds, best, children: of refinement: around so many of the best so many others, again and again.
        neighbours: around the nearest reading, to see how robust it is.
    """

    structures: int
    each: int
    rounds: int
    best: int
    children: int
    neighbours: int


WHOLE = Size(structures=64, each=64, rounds=4, best=3, children=64, neighbours=64)
SMALL = Size(structures=2, each=4, rounds=1, best=1, children=2, neighbours=2)
# How far the refinement strays in its first and last round, and the neighbours: standard deviations of ln.
FAR, CLOSE, NEIGHBOURLY = 0.3, 0.05, 0.05


@dataclass(frozen=True)
class Found:
    """What was found.

    Attributes:
        rows: of every reading, with ``stage``: "base", "nearest", "random", "refined" or "neighbour".
        nearest: the reading nearest to the paper, its numbers rounded to three digits.
    """

    rows: list[dict[str, Any]]
    nearest: Reading

    def of(self, stage: str) -> list[dict[str, Any]]:
        """The rows of a stage."""
        return [row for row in self.rows if row["stage"] == stage]


def search(size: Size, workers: int | None, stage: Stage) -> Found:
    """Search with the fixed seed; the same sizes give the same rows, whatever the number of workers.

    The nearest reading is that of the finalists whose distance, with the mean of its neighbours' added, is the least:
    one that only just holds is worth less than one whose neighbours hold, too.
    """
    rng = np.random.default_rng(SEED)
    with make_executor(workers) as executor:
        seen = _run(executor, draw(rng, size.structures, size.each), "random", stage)
        for spread in np.geomspace(FAR, CLOSE, size.rounds):
            parents = _best(seen, size.best)
            groups = [[parent.near(rng, float(spread)) for _ in range(size.children)] for parent in parents]
            seen += _run(executor, groups, "refined", stage)
        finalists = _best(seen, size.best)
        around = [[one.near(rng, NEIGHBOURLY) for _ in range(size.neighbours)] for one in finalists]
        nearby = _run(executor, around, "neighbour", stage)
        index = _nearest(seen, finalists, nearby)
        nearest = finalists[index].rounded()
        ends = _run(executor, [[BASE]], "base", stage) + _run(executor, [[nearest]], "nearest", stage)
    kept = nearby[index * size.neighbours : (index + 1) * size.neighbours]
    return Found([row for _, row in [*ends, *seen, *kept]], nearest)


Seen = list[tuple[Reading, dict[str, Any]]]


def _run(executor: Executor, groups: Sequence[Sequence[Reading]], name: str, stage: Stage) -> Seen:
    """Every reading with its row, in order."""
    advance = stage(f"{name} readings, in groups", len(groups))
    answers = map_parallel(executor, shortfalls, groups, advance)
    return [
        (reading, row | {"stage": name})
        for group, rows in zip(groups, answers, strict=True)
        for reading, row in zip(group, rows, strict=True)
    ]


def _best(seen: Seen, count: int) -> list[Reading]:
    """The nearest readings, no two of them of one structure as long as there are others nearly as good."""
    order = sorted(seen, key=lambda one: one[1]["distance"])
    picked: list[Reading] = []
    for reading, _ in order:
        if sum(other.choices == reading.choices for other in picked) < max(1, count // 3):
            picked.append(reading)
        if len(picked) == count:
            break
    return picked


def _nearest(seen: Seen, finalists: Sequence[Reading], nearby: Seen) -> int:
    """Which of the finalists is the nearest, its neighbours considered."""
    each = len(nearby) // len(finalists)
    own = [next(row["distance"] for other, row in seen if other is one) for one in finalists]
    around = np.array([row["distance"] for _, row in nearby]).reshape(len(finalists), each).mean(axis=1)
    return int(np.argmin(own + around))
