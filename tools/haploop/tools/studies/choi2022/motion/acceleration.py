"""What section III says of filtered and measured acceleration, tested."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np

from haploop.tools.linear.one_tick import OneTickMap
from haploop.tools.render.units import fixed
from haploop.tools.studies.choi2022.motion.prescribed import PERIOD_S, mean_taken
from haploop.tools.studies.choi2022.simulation.scenes import fig6, run, single_contact

CUTOFFS_HZ = (None, 100.0, 30.0, 10.0)
# An IMU of the class of the paper's: 300 ug/Hz^0.5, 16 bit over 8 g, 420 Hz (MPU-9250's data sheet).
IMU = {
    "noise_density": 2.9e-3, "range": 78.5, "resolution": 2.4e-3, "bandwidth": 420.0, "delay": 0.0014, "bias": 0.0,
    "mount": "tip",
}  # fmt: skip
# PHANToM Premium 1.5, one count.
COUNT_M = 28.7e-6


def named(cutoff_Hz: float | None) -> str:
    """What a row of numbers calls a cutoff."""
    return "unfiltered" if cutoff_Hz is None else f"{cutoff_Hz:g} Hz"


def passive_up_to_Hz(cutoff_Hz: float | None) -> float:
    """The lowest frequency at which bidirectional inertia gives more than it takes, without delay; to 1 Hz."""
    frequencies = np.arange(1.37, 500.0, 1.0)
    taken = mean_taken("bidirectional-inertia", 2.0 * np.pi * frequencies * PERIOD_S, 0, cutoff_Hz)
    return float(frequencies[np.argmax(taken < 0.0)]) if (taken < 0.0).any() else math.inf


def largest_mass_kg(cutoff_Hz: float | None, stiffness_N_m: float) -> float:
    """The largest virtual mass, from 0 on, with which the paper's device and hand behind 2 ms stay stable.

    By the loop's one-tick map: rho(M) = 1, bisected. 0 where it is unstable with the least mass already.
    """
    low, high = 0.0, 1e-5
    while high < 10.0 and _growth(high, cutoff_Hz, stiffness_N_m) < 1.0:
        low, high = high, 1.2 * high
    if not low:
        return 0.0
    while high - low > 1e-6 * high:
        middle = (low + high) / 2.0
        low, high = (middle, high) if _growth(middle, cutoff_Hz, stiffness_N_m) < 1.0 else (low, middle)
    return low


def largest_stiffness_N_m(cutoff_Hz: float | None, mass_kg: float) -> float:
    """Up to which stiffness, from 0 on, the same loop in contact with a wall stays stable; 0 where it never is."""
    ranges = OneTickMap.of(_scene(mass_kg, cutoff_Hz)).stable_ranges()
    return ranges[0][1] if ranges and ranges[0][0] == 0.0 else 0.0


def _growth(mass_kg: float, cutoff_Hz: float | None, stiffness_N_m: float) -> float:
    return OneTickMap.of(_scene(mass_kg, cutoff_Hz)).growth(stiffness_N_m)


def _scene(mass_kg: float, cutoff_Hz: float | None) -> dict[str, Any]:
    scene = copy.deepcopy(fig6("c"))
    scene.pop("encoder")
    scene["acceleration"] = {"source": "encoder"} | ({"cutoff": cutoff_Hz} if cutoff_Hz else {})
    scene["dissipation"] = [{"kind": "bidirectional-inertia", "acts": "always", "mass": mass_kg}]
    return scene


def errors_m_s2(count_m: float = COUNT_M) -> dict[str, float]:
    """RMS error of what the controller takes for the acceleration in one contact, by how it comes to it.

    The contact is with the wall alone, so that the motion is the same whatever is made of it.
    """
    encoder = {"encoder": {"resolution": count_m, "rounding": "nearest"}}
    true = _accelerations(single_contact("true", acceleration={"source": "accelerometer"}, **encoder))
    found = {}
    for cutoff in CUTOFFS_HZ:
        table = {"source": "encoder"} | ({"cutoff": cutoff} if cutoff else {})
        scene = single_contact("differenced", acceleration=table, **encoder)
        found[f"encoder, {named(cutoff)}"] = _accelerations(scene)
    scene = single_contact("measured", acceleration={"source": "accelerometer"}, accelerometer=IMU, **encoder)
    found["accelerometer"] = _accelerations(scene)
    return {name: float(np.sqrt(np.mean((a - true) ** 2))) for name, a in found.items()}


def _accelerations(scene: dict[str, Any]) -> np.ndarray:
    return np.asarray(run(scene)[1]["/controller"]["a"])


def said(values: dict[str, float], unit: str) -> str:
    """Names and numbers in a row."""
    return ", ".join(f"{name} {fixed(value)} {unit}" for name, value in values.items())
