"""Steady contacts, and the largest stiffness that an element steadies: one definition for the whole study.

A contact is *steady* where, some time after a push, the position swings by no more than one encoder step to either side
("no unwanted vibration", Choi et al. 2022, V.B.3). An element's *largest steady stiffness* is the largest of 2.5, 3.0,
... N/mm up to which every wall is steady with one and the same size of it.

Sizes are tried by the cheap form of it (``is_steady``): the push is the tap that begins the press. What is told as a
result is judged (``judged_largest``), held still and pushed twice, from starts by which no size was chosen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from haploop.controller.dissipation import registry
from haploop.launch.batch.run import run_batch
from haploop.logger.summary import Summary
from haploop.protocol.scene.scene import Scene, by_window
from haploop.tools.search.bisect import rungs_held
from haploop.tools.studies.choi2022.device import Setup, elements_of

STEP_N_M = 500.0
# From 2.5 N/mm in steps of 0.5 (Choi et al. 2022, V.B.3), to where nothing here is steady any more.
STIFFNESSES = np.arange(2500.0, 8001.0, STEP_N_M)
# One encoder step to either side.
WIDEST_M = 2.0 * 28.7e-6
# A press is looked at over the half second before this time; the tap that begins it comes after some 10 ms.
WATCHED_S, BRIEFLY_S = 3.0, 1.5
# With friction no two setups run in one batch, so that batches are small.
FEWEST = 4
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)
# What is "steady" by the judge's own, stricter word no hand feels; a wider swing is so only if it does not grow.
_NOT_STEADY = ("growing", "diverged", "no-contact")


def started(scene: Scene, start: int) -> Scene:
    """Returns a scene with another start: seed of the sensors' noise, and where within a tick's way the wall is met.

    Starts 0, 1, ... are spread evenly over the way of one tick by the golden ratio; start 0 is the scene's own.
    """
    way_m = abs(scene.device.velocity) / scene.clock.control_rate
    device = replace(scene.device, position=scene.device.position + way_m * (start * _GOLDEN % 1.0))
    return replace(scene, seed=scene.seed + start, device=device)


def pressed(scene: Scene, until_s: float = WATCHED_S) -> Scene:
    """Returns the scene of a tap and a press, watched until a time in s."""
    return replace(scene, duration=until_s)


def swing_m(result: Summary) -> float:
    """Returns what the position swings by over the last half second, peak to peak; infinite where the run broke off."""
    return result["window"]["oscillation_m"] if "window" in result else np.inf


def is_steady(result: Summary) -> bool:
    """Tells whether a press is steady."""
    return swing_m(result) <= WIDEST_M


def run_all(scenes: Sequence[Scene], *, energy: bool = False) -> list[Summary]:
    """Returns the results of scenes, those of one structure in batches."""
    return run_batch([*map(by_window, scenes)], registry(), energy=energy, fewest=FEWEST)


def largest(steady: np.ndarray, stiffnesses: np.ndarray = STIFFNESSES) -> float:
    """Returns the largest stiffness that one size leaves steady, as it does all softer ones; N/m, 0 where none is.

    ``steady`` is of shape (stiffnesses, sizes).
    """
    count = int(held(steady).max(initial=0))
    return float(stiffnesses[count - 1]) if count else 0.0


def held(steady: np.ndarray) -> np.ndarray:
    """Returns for every size (or whatever the further axes are) the stiffnesses before the first that is not steady."""
    return np.logical_and.accumulate(steady, axis=0).sum(axis=0)


class Judged(NamedTuple):
    """The largest stiffness in N/m up to which all are steady, and whether at it no hand feels what is left."""

    steady: float
    unfelt: bool


def judged_largest(setup: Setup, kind: str, sizes: Sequence[float], starts: Sequence[int]) -> list[Judged]:
    """Returns what one size of an element comes to from each start, by the judge of runs.

    The judge holds the hand, takes the noise away, pushes twice, and watches until it tells, for up to 16 s.
    """
    elements = elements_of(kind, *sizes)
    walls = [setup.scene(float(stiffness), elements) for stiffness in STIFFNESSES]
    results = run_batch([started(wall, start) for start in starts for wall in walls], registry(), energy=False)
    found = []
    for first in range(0, len(results), len(walls)):
        climbed = results[first : first + len(walls)]
        count = rungs_held(map(_is_judged_steady, climbed))
        unfelt = count > 0 and climbed[count - 1]["verdict"] == "steady"
        found.append(Judged(float(STIFFNESSES[count - 1]) if count else 0.0, unfelt))
    return found


def _is_judged_steady(result: Summary) -> bool:
    """Tells whether a run that was judged is steady, by how wide what remains is; what grows is not."""
    return result.get("verdict", "diverged") not in _NOT_STEADY and result["stability"]["width_m"] <= WIDEST_M
