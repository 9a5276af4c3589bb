"""Sizes of an element tuned for one wall, and the sizes that leave walls steady: runs of the program on a grid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from haploop.tools.render.units import amount
from haploop.tools.studies.choi2022.experiment.measure import is_steady, largest
from haploop.tools.studies.choi2022.experiment.setup import KINDS, Elements, Setup, elements_of
from haploop.tools.studies.choi2022.work import Work

# From 2.5 N/mm in steps of 0.5 (Choi et al. 2022, V.B.3), to where nothing is steady any more.
STIFFNESSES = np.arange(2500.0, 8001.0, 500.0)
# Felt by a hand at 100 Hz, between 8.5 um at 20 Hz and 0.06 um at 320 Hz in logarithms (Israr, Choi and Tan 2006).
FELT_M = 0.5e-6
# Sizes of the order of the paper's 2.7 N s/m and 9 g.
DAMPINGS = np.geomspace(0.2, 10.0, 24)
MASSES = np.geomspace(5e-4, 0.04, 30)
# An encoder's step to either side; what is steady and swings wider is dying down.
_STEPS_M = 2.0 * 28.7e-6


class Range(NamedTuple):
    """The range of one element.

    Attributes:
        sizes: N s/m or kg, shape (sizes,).
        steady: shape (stiffnesses, sizes).
        swings_m: peak to peak of the position over the last half second; infinite where the run broke off.
    """

    sizes: np.ndarray
    steady: np.ndarray
    swings_m: np.ndarray

    def largest(self, stiffnesses: np.ndarray) -> float:
        """Returns the largest stiffness that some size leaves steady, as all softer ones do; N/m, 0 where none is."""
        return largest(self.steady, stiffnesses)


def ranges(work: Work, setup: Setup, stiffnesses: np.ndarray) -> dict[str, Range]:
    """Returns the ranges of nothing and of the three elements, one at a time."""
    step = 6 if work.small else 1
    sizes = {KINDS[0]: np.zeros(1), KINDS[1]: DAMPINGS[::step], KINDS[2]: MASSES[::step], KINDS[3]: MASSES[::step]}
    cells = [(kind, k, float(size)) for kind in KINDS for k in stiffnesses for size in sizes[kind]]
    results = work.run_all("stable ranges", [setup.scene(k, elements_of(kind, size)) for kind, k, size in cells])
    found = {}
    for kind, of_kind in sizes.items():
        here = [result for cell, result in zip(cells, results, strict=True) if cell[0] == kind]
        shape = len(stiffnesses), len(of_kind)
        steady, swings_m = (np.reshape([of(result) for result in here], shape) for of in (is_steady, _swing_m))
        found[kind] = Range(of_kind, steady, swings_m)
    return found


def _swing_m(result: dict[str, Any]) -> float:
    return result["window"]["oscillation_m"] if "window" in result else np.inf


class Tuned(NamedTuple):
    """The elements with which a wall swings least, and what came of that run."""

    elements: Elements
    result: dict[str, Any]

    @property
    def steady(self) -> bool:
        """True if there is no unwanted vibration."""
        return is_steady(self.result)

    @property
    def ended(self) -> str:
        """The verdict, and the swing at the end."""
        if not self.swing_m:
            return f"{self.result['verdict']}, comes to rest"
        dying = ", dying down" if self.steady and self.swing_m > _STEPS_M else ""
        return f"{self.result['verdict']}, swings {amount(self.swing_m, 'm')} peak to peak{dying}"

    @property
    def swing_m(self) -> float:
        """Peak to peak over the last 0.5 s."""
        return self.result["window"]["oscillation_m"]


def tuned(work: Work, name: str, setup: Setup, stiffness: float, choices: Sequence[Elements]) -> Tuned:
    """Returns of some elements those that are steady and swing least ("best tuned", Choi et al. 2022, V.B.1)."""
    results = work.run_all(name, [setup.scene(stiffness, elements) for elements in choices])
    tried = [Tuned(elements, result) for elements, result in zip(choices, results, strict=True) if "window" in result]
    return min(tried, key=lambda one: (not one.steady, one.swing_m))
