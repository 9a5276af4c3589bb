"""How stiff a wall each element steadies under a reading: from 2.5 N/mm upwards, until none of its sizes does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from haploop.controller.dissipation import registry
from haploop.launch.batch.run import run_array
from haploop.tools.search import ladder
from haploop.tools.studies.choi2022.experiment.map_parallel import is_steady
from haploop.tools.studies.choi2022.experiment.setup import KINDS, Elements, Setup, both, elements_of

# From 2.5 N/mm in steps of 0.5 (Choi et al. 2022, V.B.3).
STIFFNESSES = np.arange(2500.0, 7501.0, 500.0)
NAMES = (*KINDS, "both")
_MASSES = (0.0009, 0.0018, 0.0035, 0.006, 0.009, 0.014, 0.02, 0.03)
# Sizes in N s/m and kg; the paper's own are among them: 2.7 N s/m, 1.8 g, and 2.15 N s/m with 9 g.
SIZES: dict[str, tuple[tuple[float, ...], ...]] = {
    KINDS[0]: ((0.0,),),
    KINDS[1]: tuple((b,) for b in (0.3, 0.8, 1.5, 2.15, 2.7, 4.0, 6.0, 9.0)),
    KINDS[2]: tuple((m,) for m in _MASSES),
    KINDS[3]: tuple((m,) for m in _MASSES),
    "both": tuple((b, m) for b in (0.8, 2.15, 4.0, 7.0) for m in (0.0035, 0.009, 0.02)),
}
# With friction a reading's loops run together with no other reading's, so that arrays are small.
_FEWEST = 4
# For each element of NAMES the steady sizes, shape (stiffnesses, sizes).
Steady = dict[str, np.ndarray]


def made(name: str, size: Sequence[float]) -> Elements:
    """The elements of one size."""
    return both(*size) if name == "both" else elements_of(name, *size)


def run_all(scenes: Sequence[dict[str, Any]], *, energy: bool = False) -> list[dict[str, Any]]:
    """The results of scenes in this process, in their order."""
    return run_array(scenes, registry(), energy=energy, fewest=_FEWEST)


def climb(setups: Sequence[Setup], stiffnesses: np.ndarray = STIFFNESSES) -> list[Steady]:
    """For each reading and element which sizes leave which walls steady, up to the first wall that none does.

    Args:
        setups: best of one structure, so that they run in arrays.
    """

    def ask(stiffness: float, going: Sequence[tuple[int, str]]) -> list[list[bool]]:
        scenes = [setups[i].scene(stiffness, made(name, size)) for i, name in going for size in SIZES[name]]
        steady = iter(map(is_steady, run_all(scenes)))
        return [[next(steady) for _ in SIZES[name]] for _, name in going]

    members = [(i, name) for i in range(len(setups)) for name in NAMES]
    found = [{name: np.zeros((len(stiffnesses), len(SIZES[name])), bool) for name in NAMES} for _ in setups]
    for (i, name), rows in ladder.climb(members, stiffnesses.tolist(), ask, passes=any).items():
        found[i][name][: len(rows)] = rows
    return found


def largest(steady: np.ndarray, stiffnesses: np.ndarray = STIFFNESSES) -> float:
    """The largest stiffness that some size leaves steady, as all softer ones do; N/m, 0 where none is."""
    count = ladder.rungs_held(sizes.any() for sizes in steady)
    return float(stiffnesses[count - 1]) if count else 0.0


def best_size(name: str, steady: np.ndarray) -> tuple[float, ...]:
    """Of the sizes that are steady at the largest stiffness the one in their middle; the middle size where none is."""
    rows = np.flatnonzero(steady.any(axis=1))
    sizes = np.flatnonzero(steady[rows[-1]]) if len(rows) else np.arange(len(SIZES[name]))
    return SIZES[name][int(sizes[len(sizes) // 2])]
