"""Readings of the paper's experiments, drawn at random, and how far each element steadies the wall under each."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from haploop.tools.paper.experiment.setup import KINDS, UNITS, Elements, Setup, both, elements_of

# Bounds of a log-uniform draw: the mode's frequency from below what was reported (near 200 Hz) to where it hardly
# matters; the near mass from the rotor alone (0.0029 kg of 0.0525) to most of it; ratios of damping of metal drives.
BOUNDS: dict[str, tuple[float, float]] = {
    "mode_Hz": (80.0, 500.0),
    "near_share": (0.055, 0.8),
    "mode_damping": (0.005, 0.06),
    "push_N": (1.5, 4.0),
    "entry_m_s": (0.1, 0.24),
}
# Extra delay in s: from nothing to what a slow input and output card adds.
DELAYS_S = (0.0, 0.0003, 0.0006, 0.001, 0.0015, 0.002)
STIFFNESSES = np.arange(2500.0, 7501.0, 500.0)
STEP_N_M = 500.0
# The largest stiffness in N/m that the paper steadied: Fig. 10 (damping "up to 4.5", inertia "also 4.5 N/mm"), Fig. 9
# (5.5), and section V.B.4 (6.3). Between grid points every 500 N/m, so that a step away is no disagreement.
PAPER = {"damping": 4500.0, "bidirectional-inertia": 4500.0, "unidirectional-inertia": 5500.0, "both": 6300.0}
NAMES = (*KINDS, "both")
_DAMPINGS = (0.3, 0.8, 1.6, 2.7, 5.0, 9.0)
_MASSES = (0.0009, 0.0018, 0.0035, 0.006, 0.009, 0.014, 0.02, 0.03)
_BOTH = tuple((damping, mass) for damping in (0.8, 1.6, 2.7, 5.0) for mass in (0.0035, 0.009, 0.02))


def draw(seed: int, count: int) -> list[Setup]:
    """Readings at random, without friction; every delay, setting and mount comes up equally often."""
    rng = np.random.default_rng(seed)

    def each(options: Sequence[Any]) -> list[Any]:
        column = [options[i % len(options)] for i in range(count)]
        rng.shuffle(column)
        return column

    chosen = zip(each(DELAYS_S), each(list(UNITS)), each(("motor", "tip")), strict=True)
    return [
        Setup(**_numbers(rng), delay_s=delay, unit=unit, mount=mount, friction_N=0.0) for delay, unit, mount in chosen
    ]


def _numbers(rng: np.random.Generator) -> dict[str, float]:
    return {key: math.exp(rng.uniform(math.log(low), math.log(high))) for key, (low, high) in BOUNDS.items()}


class Candidate(NamedTuple):
    """One run: with which element of which size, how stiff a wall."""

    name: str
    size: tuple[float, ...]
    stiffness: float

    @property
    def elements(self) -> Elements:
        return both(*self.size) if self.name == "both" else elements_of(self.name, *(self.size or (0.0,)))


def candidates(stiffnesses: Iterable[float] = STIFFNESSES) -> list[Candidate]:
    """All runs of a reading."""
    inertias = [(name, (mass,)) for name in KINDS[2:] for mass in _MASSES]
    sizes = [("nothing", ()), *[("damping", (b,)) for b in _DAMPINGS], *inertias, *[("both", pair) for pair in _BOTH]]
    return [Candidate(name, size, float(stiffness)) for name, size in sizes for stiffness in stiffnesses]


def largest(steady: Iterable[tuple[Candidate, bool]]) -> dict[str, float]:
    """By element: the largest stiffness in N/m with a size that is steady, as all tested below have one; else 0."""
    by_name: dict[str, dict[float, bool]] = {name: {} for name in NAMES}
    for candidate, is_steady in steady:
        of = by_name[candidate.name]
        of[candidate.stiffness] = of.get(candidate.stiffness, False) or is_steady
    found = {}
    for name, of in by_name.items():
        found[name] = 0.0
        for stiffness in sorted(of):
            if not of[stiffness]:
                break
            found[name] = stiffness
    return found


def distance(found: dict[str, float]) -> float:
    """How far a reading is from the paper: by how many steps of 500 N/m its four largest stiffnesses differ, summed.

    Differences below one step do not count.
    """
    return sum(max(abs(found[name] - stiffness) / STEP_N_M - 1.0, 0.0) for name, stiffness in PAPER.items())
