"""Which sizes of each element leave which walls steady: runs of the program on a grid."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from haploop.tools.studies.choi2022.experiment.map_parallel import is_steady, runs
from haploop.tools.studies.choi2022.experiment.setup import KINDS, Setup, elements_of
from haploop.tools.studies.choi2022.experiment.stiffness_ladder import largest
from haploop.tools.studies.choi2022.work import Work

# From 2.5 N/mm in steps of 0.5 (Choi et al. 2022, V.B.3), to where nothing is steady any more.
STIFFNESSES = np.arange(2500.0, 8001.0, 500.0)
# What a hand feels at 100 Hz, between 8.5 um at 20 Hz and 0.06 um at 320 Hz in logarithms (Israr, Choi and Tan 2006).
FELT_M = 0.5e-6
# Sizes of the order of the paper's 2.7 N s/m and 9 g.
DAMPINGS = np.geomspace(0.2, 10.0, 24)
MASSES = np.geomspace(5e-4, 0.04, 30)


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
        return largest(self.steady, stiffnesses)


def ranges(work: Work, setup: Setup, stiffnesses: np.ndarray) -> dict[str, Range]:
    """Of nothing and the three elements, one at a time."""
    step = 6 if work.small else 1
    sizes = {KINDS[0]: np.zeros(1), KINDS[1]: DAMPINGS[::step], KINDS[2]: MASSES[::step], KINDS[3]: MASSES[::step]}
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
