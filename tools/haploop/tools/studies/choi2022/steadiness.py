"""Steady contacts, and the largest stiffness that an element steadies: one definition for the whole study.

A contact is *steady* if, some time after a push, the position swings by no more than one encoder step to either side
("no unwanted vibration", Choi et al. 2022, V.B.3). An element's *largest steady stiffness* is the largest of 2.5, 3.0,
... N/mm up to which every wall is steady with one and the same size of the element.

Sizes are tried by the cheap form of this test (``is_steady``): the push is the tap that begins the press. They are
tried in batches on a grid that begins with 0, then between the neighbours of the best; the best is the one that holds
the most in the mean over a few starts, among equals the one that swings least. What is reported as a result is judged
(``reached``), held still and pushed twice, from starts by which no size was chosen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple, Self

import numpy as np

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_batch import run_batch
from haploop.logger.summary import Summary
from haploop.protocol.scene.scene import Scene, by_window
from haploop.tools.search.bisect import rungs_held
from haploop.tools.search.intervals import Interval, mean_interval
from haploop.tools.studies.choi2022.answers import Answers
from haploop.tools.studies.choi2022.device import KINDS, Setup, elements_of

STEP_N_M = 500.0
# From 2.5 N/mm in steps of 0.5 (Choi et al. 2022, V.B.3), to where nothing is steady here.
STIFFNESSES = np.arange(2500.0, 8001.0, STEP_N_M)
# One encoder step to either side.
WIDEST_M = 2.0 * 28.7e-6
# A press is watched over the half second before this time; the tap that begins it comes after some 10 ms.
WATCHED_S, BRIEFLY_S = 3.0, 1.5
# Sizes of one element, N s/m or kg, and of both: dampings, then masses. Neighbours differ by some 10 and 25 percent.
DAMPINGS = np.append(0.0, np.geomspace(0.1, 10.0, 47))
MASSES = np.append(0.0, np.geomspace(5e-4, 0.05, 47))
PAIR_DAMPINGS = np.append(0.0, np.geomspace(0.4, 8.0, 13))
PAIR_MASSES = np.append(0.0, np.geomspace(0.003, 0.045, 13))
# Starts by which a size is chosen, and by which it is judged.
CHOSEN_BY, JUDGED_BY = tuple(range(4)), tuple(range(100, 112))
# Numbers of sizes tried between the neighbours of the best, for one element and for each of two.
_FINER = {1: 16, 2: 6}
# The walls are tried in this many parts, so that as many cores share them; larger batches cost less.
_PARTS = 4
# With friction no two setups run in one batch, so batches are small.
_FEWEST = 4
_GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def started(scene: Scene, start: int) -> Scene:
    """Returns a scene with another start: seed of the sensors' noise, and where in a tick's travel the wall is met.

    Starts 0, 1, ... are spread evenly over the travel of one tick by the golden ratio; start 0 is the scene's own.
    """
    way_m = abs(scene.device.velocity) / scene.clock.control_rate
    device = replace(scene.device, position=scene.device.position + way_m * (start * _GOLDEN % 1.0))
    return replace(scene, seed=scene.seed + start, device=device)


def pressed(scene: Scene, until_s: float = WATCHED_S) -> Scene:
    """Returns the scene of a tap and a press, watched until a time in s."""
    return replace(scene, duration=until_s)


def swing_m(result: Summary) -> float:
    """Returns the swing of the position over the last half second, peak to peak; infinite if the run broke off."""
    return result["window"]["oscillation_m"] if "window" in result else np.inf


def is_steady(result: Summary) -> bool:
    """Tells whether a press is steady."""
    return swing_m(result) <= WIDEST_M


def run_all(scenes: Sequence[Scene], *, energy: bool = False) -> list[Summary]:
    """Returns the results of scenes; those of one structure run in batches."""
    return run_batch([*map(by_window, scenes)], registry(), energy=energy, fewest=_FEWEST)


def largest(steady: np.ndarray, stiffnesses: np.ndarray = STIFFNESSES) -> float:
    """Returns the largest stiffness that one size leaves steady together with all softer ones; N/m, 0 if there is none.

    ``steady`` is of shape (stiffnesses, sizes).
    """
    count = int(held(steady).max(initial=0))
    return float(stiffnesses[count - 1]) if count else 0.0


def held(steady: np.ndarray) -> np.ndarray:
    """Returns for every size (or along any further axes) how many stiffnesses precede the first that is not steady."""
    return np.logical_and.accumulate(steady, axis=0).sum(axis=0)


class Range(NamedTuple):
    """What was tried for one element.

    Attributes:
        sizes: N s/m or kg, shape (sizes, 1), for damping with inertia (sizes, 2).
        swings_m: swings of the position at the end, peak to peak, shape (stiffnesses, sizes, starts).
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
        """Returns the index of the best size; among equals the one that swings least up to the stiffness it holds."""
        most = self.held()
        there = np.flatnonzero(most == most.max())
        rungs = max(int(most.max()), 1)
        return int(there[self.swings_m[:rungs, there].max(axis=(0, 2)).argmin()])

    def with_more(self, other: Self) -> Self:
        """Returns this range and another of the same starts as one."""
        swings_m = np.concatenate([self.swings_m, other.swings_m], axis=1)
        return type(self)(np.concatenate([self.sizes, other.sizes]), swings_m)


class Reached(NamedTuple):
    """The largest steady stiffness of an element, N/m: the size, and for each start what the judge finds.

    Attributes:
        twice: the largest, in the batches by which the size was chosen, if a swing were allowed to be twice as wide.
    """

    kind: str
    sizes: tuple[float, ...]
    steady: tuple[float, ...]
    twice: float

    @property
    def mean(self) -> Interval:
        """Mean over the starts in N/mm, with its interval of confidence."""
        return mean_interval(np.array(self.steady) / 1e3)

    def describe(self) -> str:
        """Returns the mean in N/mm: ``"4.96 [4.87, 5.05]"``, or ``"4.5"`` if all starts give the same."""
        return in_words(self.mean)


def in_words(mean: Interval) -> str:
    """Returns a mean with its interval, without it if all starts give the same, and ``"none"`` for 0."""
    value, low, high = mean
    if not value:
        return "none"
    return f"{value:.1f}" if high - low < 1e-9 else f"{value:.2f} [{low:.2f}, {high:.2f}]"


def beats(one: Reached, other: Reached) -> bool:
    """Tells whether one withstands more than the other: by a step of the stiffness or more, with intervals apart."""
    return one.mean.value - other.mean.value >= 0.5 and one.mean.apart(other.mean)


def sizes_of(kind: str, small: bool) -> np.ndarray:
    """Returns the sizes tried first, shape (sizes, 1 or 2)."""
    if kind == KINDS[0]:
        return np.zeros((1, 1))
    if kind == "both":
        step = 9 if small else 1
        return np.array([*product(PAIR_DAMPINGS[::step], PAIR_MASSES[::step])])
    return (DAMPINGS if kind == KINDS[1] else MASSES)[:: 12 if small else 1, None]


class Presses(NamedTuple):
    """Presses on some walls, in N/m, with some sizes of an element, from some starts."""

    setup: Setup
    kind: str
    walls: Sequence[float]
    sizes: Sequence[Sequence[float]]
    starts: tuple[int, ...]

    def scenes(self) -> list[Scene]:
        elements = [elements_of(self.kind, *size) for size in self.sizes]
        scenes = [self.setup.scene(stiffness, one) for stiffness in self.walls for one in elements]
        return [started(scene, start) for scene in scenes for start in self.starts]

    def swings_m(self) -> np.ndarray:
        """Returns how far the position swings at the end, shape (walls, sizes, starts)."""
        swings = [swing_m(result) for result in run_all([pressed(scene) for scene in self.scenes()])]
        return np.array(swings).reshape(len(self.walls), len(self.sizes), -1)

    def judged(self) -> list[float]:
        """Returns from each start the largest stiffness in N/m up to which all are steady with the first size.

        This is found by the judge of runs, which holds the hand, removes the noise, pushes twice, and watches until it
        can decide, for up to 16 s.
        """
        results = run_batch(self.scenes(), registry(), energy=False)
        counts = [rungs_held(map(is_judged_steady, results[at :: len(self.starts)])) for at in range(len(self.starts))]
        return [self.walls[count - 1] if count else 0.0 for count in counts]


def is_judged_steady(result: Summary) -> bool:
    """Tells whether a run that was judged is steady: its swing does not grow at the wall, and what remains is narrow.

    If the judge cannot tell within 16 s whether a slow change continues, the width by then counts, unless the swing
    grew by more than three times the error of its rate.
    """
    found = result.get("stability", {"why": "", "width_m": np.inf})
    rate, error = (found.get(name) or 0.0 for name in ("rate_1_s", "error_1_s"))
    lasts = result.get("verdict") in ("steady", "limit-cycle") or (found["why"] == "too slow" and rate <= 3.0 * error)
    return lasts and found["width_m"] <= WIDEST_M


def tried(answers: Answers, setup: Setup, kind: str, sizes: np.ndarray) -> Range:
    """Runs every size on every wall from the starts by which a size is chosen."""
    starts = CHOSEN_BY[:1] if answers.small else CHOSEN_BY
    parts = np.array_split(STIFFNESSES, 1 if answers.small else _PARTS)
    presses = [Presses(setup, kind, part.tolist(), sizes.tolist(), starts) for part in parts]
    swings_m = answers.map_parallel(f"walls with {kind.replace('-', ' ')}", Presses.swings_m, presses)
    return Range(sizes, np.concatenate(swings_m))


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


def reached(answers: Answers, setup: Setup, kind: str) -> Reached:
    """Returns the largest steady stiffness of an element with its best size."""
    grid = tried(answers, setup, kind, sizes_of(kind, answers.small))
    if kind != KINDS[0] and not answers.small:
        grid = grid.with_more(tried(answers, setup, kind, finer(grid)))
    best = grid.best()
    sizes = () if kind == KINDS[0] else tuple(grid.sizes[best].tolist())
    rungs = round(grid.held(2.0 * WIDEST_M).max())
    twice = float(STIFFNESSES[rungs - 1]) if rungs else 0.0
    if answers.small:
        level = largest(grid.swings_m[:, best] <= WIDEST_M)
        return Reached(kind, sizes, (level,) * 2, twice)
    half = len(JUDGED_BY) // 2
    walls = STIFFNESSES.tolist()
    halves = [Presses(setup, kind, walls, [sizes], starts) for starts in (JUDGED_BY[:half], JUDGED_BY[half:])]
    parts = answers.map_parallel(f"judging {kind.replace('-', ' ')}", Presses.judged, halves)
    return Reached(kind, sizes, tuple(one for part in parts for one in part), twice)
