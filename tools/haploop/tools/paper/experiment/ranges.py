"""Which sizes of each element leave which walls steady: runs of the program on a grid."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from haploop.tools.paper.experiment.many import is_steady, runs
from haploop.tools.paper.experiment.setup import KINDS, Setup, elements_of
from haploop.tools.paper.work import Work

# From 2.5 N/mm in steps of 0.5 (Choi et al. 2022, V.B.3), to where nothing is steady any more.
STIFFNESSES = np.arange(2500.0, 8001.0, 500.0)
# What a hand feels at 100 Hz, between 8.5 um at 20 Hz and 0.06 um at 320 Hz in logarithms (Israr, Choi and Tan 2006).
FELT_M = 0.5e-6
_DAMPINGS = np.geomspace(0.2, 20.0, 24)
_MASSES = np.geomspace(5e-4, 0.08, 30)


class Range(NamedTuple):
    """One element.

    Attributes:
        sizes: N s/m or kg, shape (sizes,).
        steady: shape (stiffnesses, sizes).
        swings_m: peak to peak of the position over the last half second; infinite where the run broke off.
    """

    sizes: np.ndarray
    steady: np.ndarray
    swings_m: np.ndarray

    def largest(self, stiffnesses: np.ndarray) -> float:
        """The largest stiffness that some size leaves steady, as all softer ones do; N/m, 0 where none is."""
        some = np.asarray(self.steady.any(axis=1))
        count = len(some) if some.all() else int((~some).argmax())
        return float(stiffnesses[count - 1]) if count else 0.0

    def best(self, stiffness_index: int) -> float | None:
        """A size amid the longest row of steady ones at that stiffness."""
        row, longest, start = self.steady[stiffness_index], (0, 0), 0
        for i in range(len(row) + 1):
            if i == len(row) or not row[i]:
                longest, start = max(longest, (i - start, start)), i + 1
        return float(self.sizes[longest[1] + longest[0] // 2]) if longest[0] else None


def ranges(work: Work, setup: Setup, stiffnesses: np.ndarray) -> dict[str, Range]:
    """Of nothing and the three elements, one at a time."""
    step = 6 if work.small else 1
    sizes = {KINDS[0]: np.zeros(1), KINDS[1]: _DAMPINGS[::step], KINDS[2]: _MASSES[::step], KINDS[3]: _MASSES[::step]}
    cells = [(kind, size, k) for kind in KINDS for k in stiffnesses for size in sizes[kind]]
    scenes = [setup.scene(k, elements_of(kind, float(size))) for kind, size, k in cells]
    results = runs(work, "stable ranges", scenes)
    steady, swings = [is_steady(result) for result in results], [_swing_m(result) for result in results]
    found, first = {}, 0
    for kind in KINDS:
        count = len(stiffnesses) * len(sizes[kind])
        here = slice(first, first + count)
        found[kind] = Range(sizes[kind], *(np.reshape(of[here], (len(stiffnesses), -1)) for of in (steady, swings)))
        first += count
    return found


def _swing_m(result: dict[str, Any]) -> float:
    return result["window"]["oscillation_m"] if "window" in result else np.inf


def with_friction(
    work: Work, found: dict[str, Range], stiffnesses: np.ndarray
) -> tuple[dict[str, tuple[float, float]], np.ndarray]:
    """For each element the largest stiffness (0.5 steps) without and with the published friction, at the same sizes.

    Friction is run only from the last stiffness that is steady without it upwards, at the sizes that were the best
    there and below. Also returns how much still swings in the runs that are steady with it, m.
    """
    asked: list[tuple[str, float, float]] = []
    for kind, one in found.items():
        last = int(np.searchsorted(stiffnesses, one.largest(stiffnesses)))
        best = {one.best(i) for i in (last, max(last - 1, 0))} if last < len(stiffnesses) else {None}
        best = {size for size in best if size is not None} or {float(np.median(one.sizes))}
        above = stiffnesses[last : last + (2 if work.small else 5)]
        asked += [(kind, size, float(k)) for size in sorted(best) for k in above]
    setup = Setup()
    results = runs(work, "with friction", [setup.scene(k, elements_of(kind, size)) for kind, size, k in asked])
    limits = {}
    for kind, one in found.items():
        of: dict[float, bool] = {}
        for (asked_kind, _, k), result in zip(asked, results, strict=True):
            if asked_kind == kind:
                of[k] = of.get(k, False) or is_steady(result)
        limit = 0.0
        for k in sorted(of):
            if not of[k]:
                break
            limit = k
        limits[kind] = (one.largest(stiffnesses), limit)
    return limits, np.array([_swing_m(result) for result in results if is_steady(result)])
