"""Readings of the paper's experiments: drawn at random, and near to one another."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from haploop.tools.studies.choi2022.experiment.setup import UNITS, VELOCITIES, Setup
from haploop.tools.studies.choi2022.simulation.shares import Space

# What a reading chooses. Extra delay in s: from nothing to what a slow input and output card adds.
CHOICES: dict[str, tuple[Any, ...]] = {
    "delay_s": (0.0, 0.0003, 0.0006, 0.001, 0.0015, 0.002),
    "unit": tuple(UNITS),
    "mount": ("motor", "tip"),
    "velocity": tuple(VELOCITIES),
}
# Bounds of a log-uniform draw: the mode's frequency from below what was reported (near 200 Hz) to where it hardly
# matters; the near mass from the rotor alone (0.0029 kg of 0.0525) to most of it; ratios of damping of metal drives; a
# press and a tap as a hand makes them; a hand half to twice as heavy, damped and stiff as the published mean.
BOUNDS: dict[str, tuple[float, float]] = {
    "mode_Hz": (80.0, 500.0),
    "near_share": (0.055, 0.8),
    "mode_damping": (0.005, 0.06),
    "push_N": (1.5, 4.0),
    "entry_m_s": (0.1, 0.24),
    "hand": (0.5, 2.0),
}
# What each is, with its unit.
ABOUT: dict[str, str] = {
    "delay_s": "extra delay (s)",
    "unit": "inertial unit",
    "mount": "mount of the unit",
    "velocity": "low-pass of the velocity",
    "friction_N": "dry friction (N)",
    "acceleration": "acceleration of",
    "mode_Hz": "mode of the drive (Hz)",
    "near_share": "near mass, share",
    "mode_damping": "mode's damping ratio",
    "push_N": "push (N)",
    "entry_m_s": "entry speed (m/s)",
    "hand": "hand, times the published",
}
SPACE = Space(CHOICES, BOUNDS, ABOUT)
# Delays are whole plant steps.
_STEP_S, _MOST_S = 1e-4, 2e-3


def draw(rng: np.random.Generator, structures: int, each: int) -> list[list[Setup]]:
    """Readings at random, without friction, ``each`` of every one of some structures, so that they run in arrays.

    Every option of a choice comes up equally often, but for the remainder: its column is shuffled by itself.
    """
    columns = {key: [options[i % len(options)] for i in range(structures)] for key, options in CHOICES.items()}
    for column in columns.values():
        rng.shuffle(column)
    chosen = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    return [[Setup(**_numbers(rng), **choice) for _ in range(each)] for choice in chosen]


def _numbers(rng: np.random.Generator) -> dict[str, float]:
    return {key: _rounded(math.exp(rng.uniform(math.log(low), math.log(high)))) for key, (low, high) in BOUNDS.items()}


def _rounded(value: float) -> float:
    """To three digits, as a scene file has them: what is steady may hang on the fourth."""
    return float(f"{value:.3g}")


def around(rng: np.random.Generator, setup: Setup, spread: float, count: int, *, delayed: bool = True) -> list[Setup]:
    """So many others near a reading, with its choices; if delayed, one delay for all of them, some steps off.

    Each number is taken times e^(spread xi), xi normal, and kept within its bounds.
    """
    steps = round(10.0 * spread * rng.standard_normal()) if delayed else 0
    delay_s = round(min(max(setup.delay_s + steps * _STEP_S, 0.0), _MOST_S), 4)
    found = []
    for _ in range(count):
        numbers = {
            key: _rounded(float(np.clip(getattr(setup, key) * math.exp(spread * rng.standard_normal()), *bounds)))
            for key, bounds in BOUNDS.items()
        }
        found.append(replace(setup, **numbers, delay_s=delay_s))
    return found


def structure(setup: Setup) -> Sequence[Any]:
    """What readings that run in arrays have in common."""
    return tuple(getattr(setup, key) for key in CHOICES)
