"""The largest stiffness that a loop in contact bears with each element and its best size, without a single run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from haploop.tools.linear.one_tick import OneTickMap
from haploop.tools.search.bisect import bisect_many
from haploop.tools.studies.choi2022.experiment.setup import KINDS, Setup, elements_of
from haploop.tools.studies.choi2022.gate.gated_map import GatedMap

# Sizes tried for every element: from next to nothing to beyond what any loop here bears. N s/m, and kg.
DAMPINGS = np.geomspace(0.1, 40.0, 10)
MASSES = np.geomspace(3e-4, 0.08, 10)
_SOFTEST, _STIFFEST, _COARSE, _HALVINGS = 50.0, 60e3, 30, 4
_REFINED = 3


class Best(NamedTuple):
    """The largest steady stiffness in N/m (0 where none is), and the element's size that bears it."""

    stiffness: float
    size: float


def limits(setup: Setup) -> dict[str, Best]:
    """Of every kind of ``KINDS``: exact (rho(M) = 1) for three, found with the gated map for the last."""
    scene = setup.linear_scene([])
    gated = GatedMap.of(scene)

    def exact(kind: str) -> Callable[[np.ndarray], np.ndarray]:
        return lambda sizes: np.array([first_end(setup, kind, size) for size in sizes])

    found = {"nothing": Best(first_end(setup, "nothing", 0.0), 0.0)}
    for kind in KINDS[1:3]:
        found[kind] = _best(exact(kind), DAMPINGS if kind == "damping" else MASSES)
    found[KINDS[3]] = _best(lambda masses: gated_ends(gated, masses), MASSES)
    return found


def limit_of_both(setup: Setup, dampings: np.ndarray, masses: np.ndarray) -> tuple[float, float, float]:
    """The largest stiffness of damping with unidirectional inertia on a grid: (N/m, N s/m, kg)."""
    scene = setup.linear_scene([])
    ends = np.array([gated_ends(GatedMap.of(scene, float(damping)), masses) for damping in dampings])
    i, j = np.unravel_index(ends.argmax(), ends.shape)
    return float(ends[i, j]), float(dampings[i]), float(masses[j])


def first_end(setup: Setup, kind: str, size: float) -> float:
    """Where the range of steady stiffnesses that begins at 0 ends in N/m; 0 where there is none."""
    ranges = OneTickMap.of(setup.linear_scene(elements_of(kind, float(size)))).stable_ranges()
    return min(ranges[0][1], _STIFFEST) if ranges and ranges[0][0] == 0.0 else 0.0


def swings_at_Hz(setup: Setup, stiffness: float, kind: str = "nothing", size: float = 0.0) -> float:
    """The frequency of what grows fastest, or decays slowest, at a stiffness in N/m."""
    scene = setup.linear_scene(elements_of(kind, size))
    values = np.linalg.eigvals(OneTickMap.of(scene).matrix(stiffness))
    return float(abs(np.angle(values[np.abs(values).argmax()])) / (2.0 * np.pi) * scene["clock"]["control_rate"])


def gated_ends(gated: GatedMap, masses: np.ndarray) -> np.ndarray:
    """For every mass of unidirectional inertia: the stiffness at which the loop first grows, N/m."""
    coarse = np.geomspace(_SOFTEST, _STIFFEST, _COARSE)
    grows = gated.growth(coarse[:, None], masses[None, :]) >= 0.0
    first = np.where(grows.any(axis=0), grows.argmax(axis=0), len(coarse) - 1)
    ends = zip(np.where(first > 0, coarse[first - 1], 0.0).tolist(), coarse[first].tolist(), strict=True)

    def shrinks(middles: Mapping[int, float]) -> dict[int, bool]:
        growth = gated.growth(np.array(list(middles.values())), masses[list(middles)])
        return dict(zip(middles, (growth < 0.0).tolist(), strict=True))

    found = bisect_many(dict(enumerate(ends)), shrinks, most_rounds=_HALVINGS)
    return np.array([found[i][0] for i in range(len(masses))])


def _best(ends: Callable[[np.ndarray], np.ndarray], sizes: np.ndarray) -> Best:
    """The best of some sizes, and of others between its neighbours."""
    found = ends(sizes)
    i = int(found.argmax())
    finer = np.geomspace(sizes[max(i - 1, 0)], sizes[min(i + 1, len(sizes) - 1)], _REFINED + 2)[1:-1]
    sizes, found = np.append(sizes, finer), np.append(found, ends(finer))
    i = int(found.argmax())
    return Best(float(found[i]), float(sizes[i]))
