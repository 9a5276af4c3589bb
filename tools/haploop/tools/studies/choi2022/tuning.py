"""The size with which an element steadies the stiffest wall, and the stiffness it then comes to, start by start.

Sizes are tried in batches on a grid that begins with 0, then between the neighbours of the best; the best is the one
with the greatest mean over a few starts of what it holds, of several the one that swings least. What it comes to is
judged from other starts.
"""

from __future__ import annotations

import json
from itertools import product
from typing import NamedTuple, Self

import numpy as np

from haploop.tools.search.intervals import Interval, mean_interval
from haploop.tools.studies.choi2022.device import KINDS, Setup, elements_of
from haploop.tools.studies.choi2022.steadiness import (
    STIFFNESSES,
    WIDEST_M,
    Judged,
    held,
    judged_largest,
    largest,
    pressed,
    run_all,
    started,
    swing_m,
)
from haploop.tools.studies.choi2022.work import Work

# Sizes of one element, N s/m or kg, and of both: dampings, then masses. Neighbours differ by some 10 and 25 per cent.
DAMPINGS = np.append(0.0, np.geomspace(0.1, 10.0, 47))
MASSES = np.append(0.0, np.geomspace(5e-4, 0.05, 47))
PAIR_DAMPINGS = np.append(0.0, np.geomspace(0.4, 8.0, 13))
PAIR_MASSES = np.append(0.0, np.geomspace(0.003, 0.045, 13))
# Starts by which a size is chosen, and by which it is judged.
CHOSEN_BY, JUDGED_BY = tuple(range(4)), tuple(range(100, 112))
# Sizes tried between the neighbours of the best.
_FINER = {1: 16, 2: 6}
# The walls are tried in so many parts, for so many cores to share; larger batches cost less.
_PARTS = 4
FILE = "largest_stiffnesses.json"


class Range(NamedTuple):
    """What was tried of one element.

    Attributes:
        sizes: N s/m or kg, shape (sizes, 1), of damping with inertia (sizes, 2).
        swings_m: of the position in the end, peak to peak, shape (stiffnesses, sizes, starts).
    """

    sizes: np.ndarray
    swings_m: np.ndarray

    @property
    def steady(self) -> np.ndarray:
        """What is steady from all starts, shape (stiffnesses, sizes)."""
        return np.all(self.swings_m <= WIDEST_M, axis=-1)

    def held(self, widest_m: float = WIDEST_M) -> np.ndarray:
        """Returns the mean over the starts of how many stiffnesses each size holds."""
        return held(self.swings_m <= widest_m).mean(axis=-1)

    def best(self) -> int:
        """Returns the index of the best size; of several the one that swings least up to the stiffness it holds."""
        most = self.held()
        there = np.flatnonzero(most == most.max())
        rungs = max(int(most.max()), 1)
        return int(there[self.swings_m[:rungs, there].max(axis=(0, 2)).argmin()])

    def with_more(self, other: Self) -> Self:
        """Returns both, of the same starts, as one."""
        swings_m = np.concatenate([self.swings_m, other.swings_m], axis=1)
        return type(self)(np.concatenate([self.sizes, other.sizes]), swings_m)


class Reached(NamedTuple):
    """The largest steady stiffness of an element, N/m: with which size, and by the judge from each start.

    Attributes:
        unfelt: how many starts leave nothing there that a hand feels.
        twice: the largest, in the batches by which the size was chosen, if a swing might be twice as wide.
    """

    kind: str
    sizes: tuple[float, ...]
    steady: tuple[float, ...]
    unfelt: int
    twice: float

    @property
    def mean(self) -> Interval:
        """Mean over the starts in N/mm, with its interval of confidence."""
        return mean_interval(np.array(self.steady) / 1e3)

    def describe(self) -> str:
        """Returns it in N/mm: ``"5.2 [4.9, 5.5]"``, or ``"4.5"`` where all starts come to the same."""
        mean, low, high = self.mean
        return f"{mean:.1f}" if low == high else f"{mean:.1f} [{low:.1f}, {high:.1f}]"


def beats(one: Reached, other: Reached) -> bool:
    """Tells whether one bears more than the other: by a step of the stiffness or more, their intervals apart."""
    return one.mean.value - other.mean.value >= 0.5 and one.mean.apart(other.mean)


def sizes_of(kind: str, small: bool) -> np.ndarray:
    """Returns the sizes tried first, shape (sizes, 1 or 2)."""
    if kind == KINDS[0]:
        return np.zeros((1, 1))
    if kind == "both":
        step = 6 if small else 1
        return np.array([*product(PAIR_DAMPINGS[::step], PAIR_MASSES[::step])])
    return (DAMPINGS if kind == KINDS[1] else MASSES)[:: 8 if small else 1, None]


class _Walls(NamedTuple):
    setup: Setup
    kind: str
    stiffnesses: np.ndarray
    sizes: np.ndarray
    starts: tuple[int, ...]


def _swings(of: _Walls) -> np.ndarray:
    elements = [elements_of(of.kind, *size) for size in of.sizes.tolist()]
    scenes = (of.setup.scene(stiffness, one) for stiffness in of.stiffnesses.tolist() for one in elements)
    pressing = [pressed(started(scene, start)) for scene in scenes for start in of.starts]
    swings = [swing_m(result) for result in run_all(pressing)]
    return np.array(swings).reshape(len(of.stiffnesses), len(of.sizes), -1)


class _Element(NamedTuple):
    setup: Setup
    kind: str
    sizes: tuple[float, ...]
    starts: tuple[int, ...]


def _judged(element: _Element) -> list[Judged]:
    return judged_largest(*element)


def tried(work: Work, setup: Setup, kind: str, sizes: np.ndarray) -> Range:
    """Runs every size on every wall from the starts by which a size is chosen."""
    starts = CHOSEN_BY[:1] if work.small else CHOSEN_BY
    parts = np.array_split(STIFFNESSES, 1 if work.small else _PARTS)
    walls = [_Walls(setup, kind, part, sizes, starts) for part in parts]
    return Range(sizes, np.concatenate(work.map_parallel(f"walls with {kind.replace('-', ' ')}", _swings, walls)))


def finer(found: Range) -> np.ndarray:
    """Returns sizes between the neighbours of the best, evenly in their logarithm."""
    best = found.sizes[found.best()]
    columns = []
    for one, at in zip(found.sizes.T, best, strict=True):
        values = np.unique(one)
        i = int(np.searchsorted(values, at))
        low, high = values[max(i - 1, 0)], values[min(i + 1, len(values) - 1)]
        count = _FINER[found.sizes.shape[1]]
        columns.append(np.geomspace(low or 0.1 * high, high, count + 2)[1:-1] if high else np.zeros(1))
    return np.array([*product(*columns)])


def reached(work: Work, setup: Setup, kind: str, grid: Range | None = None) -> Reached:
    """Returns the largest steady stiffness of an element; one that was found for the setup before is read back.

    Args:
        grid: what was tried of it, where it was.
    """
    file = work.out / FILE
    known = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    if known.get("setup") != setup.as_dict() or known.get("small") != work.small:
        known = {"setup": setup.as_dict(), "small": work.small}
    if kind not in known:
        known[kind] = _reach(work, setup, kind, grid)._asdict()
        file.write_text(json.dumps(known, indent=2) + "\n", encoding="utf-8")
    one = known[kind]
    return Reached(kind, tuple(one["sizes"]), tuple(one["steady"]), one["unfelt"], one["twice"])


def _reach(work: Work, setup: Setup, kind: str, grid: Range | None) -> Reached:
    grid = grid or tried(work, setup, kind, sizes_of(kind, work.small))
    if kind != KINDS[0] and not work.small:
        grid = grid.with_more(tried(work, setup, kind, finer(grid)))
    best = grid.best()
    sizes = () if kind == KINDS[0] else tuple(grid.sizes[best].tolist())
    twice = float(STIFFNESSES[round(grid.held(2.0 * WIDEST_M).max()) - 1])
    if work.small:
        level = largest(grid.swings_m[:, best] <= WIDEST_M)
        return Reached(kind, sizes, (level,) * 2, 0, twice)
    half = len(JUDGED_BY) // 2
    parts = [_Element(setup, kind, sizes, starts) for starts in (JUDGED_BY[:half], JUDGED_BY[half:])]
    judged = [one for part in work.map_parallel(f"judging {kind.replace('-', ' ')}", _judged, parts) for one in part]
    return Reached(kind, sizes, tuple(one.steady for one in judged), sum(one.unfelt for one in judged), twice)
