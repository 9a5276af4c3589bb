"""Judgement whether loops are steady: many at once, each run until its swings have died away or will not.

Scenes of one structure run in arrays; light work is done in this process, heavy work on several cores.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Self

from haploop.controller.dissipation import Element
from haploop.launch.batch.run import batch_results, groups
from haploop.launch.batch.stacking import is_batchable
from haploop.logger.summary import Summary
from haploop.logger.verdict.measures import SMALLEST_SWING_M
from haploop.protocol.scene.scene import Device, Run, Scene
from haploop.tools.advise.tasks import is_held_by
from haploop.tools.executor.parts import Group
from haploop.tools.executor.pool import Pool, read_sources
from haploop.tools.executor.work import Results, Work, load_kinds
from haploop.tools.linear.linearity import is_linear
from haploop.tools.linear.one_tick import OneTickMap

# A run whose swings would die away within so many times its duration is run again, so long; alone the first only.
LONGER = 2, 4, 8
# Swings that die away by less than this a second may as well not; by more than this, they may be soon gone.
_DYING_1_S, _SURELY_DYING_1_S = 0.02, 1.0
# Seconds after which loops with friction are looked at first, where so many are alike: their swings cost most.
GLANCE_S, _WORTH_A_GLANCE = 0.25, 8
# Without energy books, so many loops of one structure are already sooner run in an array; more than so many with
# friction, whose stops and starts take their time, are better shared between workers.
FEWEST, MOST = 3, 64
# Processor seconds that a simulated second takes, about: of an array, of a loop in it with friction, of a loop alone.
_ARRAY_S, _IN_IT_S, _ALONE_S = 0.2, 0.03, 0.15
# Fewer are not worth the start of workers.
_WORTH_S = 6.0


def execution_mode(scene: Scene) -> str:
    """Returns how such scenes run.

    ``"arrays"``, where hundreds cost little more than one; ``"friction"``, in arrays out of which every stop and start
    is taken; ``"alone"``.
    """
    if not is_batchable(scene):
        return "alone"
    return "friction" if scene.friction else "arrays"


@dataclass(frozen=True)
class Judgement:
    """The judgement of a run.

    Attributes:
        steady: the verdict, or swings that die away too slowly for a run to end, in a loop whose exact map is stable.
        verdict, oscillation_m, summary: of the longest run; the swing peak to peak over its window.
        presumed: whether its swings have still to die away.
    """

    steady: bool
    verdict: str
    oscillation_m: float
    summary: Summary
    presumed: bool = False


class Judge:
    """Runs loops, in arrays or on several cores, and judges them; a context manager.

    Args:
        workers: processes for heavy work; as many as there are cores when None.
    """

    def __init__(
        self,
        kinds: dict[str, type[Element]],
        plugins: Sequence[Path] = (),
        workers: int | None = None,
        on_progress: Callable[[int], object] = lambda runs: None,
    ) -> None:
        self._kinds, self._sources = kinds, read_sources(plugins)
        self._workers, self._told = workers, on_progress
        self._here = Pool(1)
        self._pool: Pool | None = None
        self._maps: dict[str, OneTickMap] = {}
        self.runs = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: Any) -> None:
        if self._pool:
            self._pool.__exit__(*error)

    def judge(
        self, scenes: Sequence[Scene], patient: Sequence[bool] | None = None, energy: bool = False
    ) -> list[Judgement]:
        """Judges each loop, in order.

        A run whose swings die away too slowly for its duration is repeated as much longer as will do; one about which
        nobody is patient is taken as steady then, and ends early where it buzzes for good. All are patient where
        nothing is said.
        """
        hasty = {index for index, waits in enumerate(patient or ()) if not waits}
        found = self._glanced(scenes, hasty)
        left = [index for index in range(len(scenes)) if index not in found]
        results = dict(zip(left, self._results([scenes[i] for i in left], energy), strict=True))
        needed = {index: self._needed(scenes[index], result) for index, result in results.items()}
        for factor in LONGER:
            again = [index for index in left if needed[index] == factor and index not in hasty]
            longer = [replace(scenes[i], duration=scenes[i].duration * factor) for i in again]
            results |= zip(again, self._results(longer, energy), strict=True)
        for index, result in results.items():
            presumed = index in hasty and needed[index] > 1
            found[index] = self._judgement(scenes[index], result, presumed)
        return [found[index] for index in range(len(scenes))]

    def _glanced(self, scenes: Sequence[Scene], hasty: set[int]) -> dict[int, Judgement]:
        """Judges those of the hasty ones that buzz already and will not cease, where friction makes runs dear."""
        able = [
            i for i in sorted(hasty)
            if execution_mode(scenes[i]) == "friction"
            and scenes[i].duration > 2.0 * GLANCE_S
            and is_held_by(scenes[i], GLANCE_S / 2.0)
        ]  # fmt: skip
        together = groups([scenes[index] for index in able])
        looked = [able[place] for group in together if len(group) >= _WORTH_A_GLANCE for place in group]
        results = self._results([replace(scenes[i], duration=GLANCE_S) for i in looked], energy=False)
        return {
            index: Judgement(False, result["verdict"], result["window"]["oscillation_m"], result)
            for index, result in zip(looked, results, strict=True)
            if result["ended"] == "done"
            and result["verdict"] == "limit-cycle"
            and (growth := result["window"]["growth_1_s"]) is not None
            and growth > -_SURELY_DYING_1_S
        }

    def _judgement(self, scene: Scene, result: Summary, presumed: bool) -> Judgement:
        if result["ended"] not in ("done", "diverged"):
            return Judgement(False, result["ended"], math.inf, result)
        verdict = result["verdict"]
        steady = presumed or verdict == "steady" or (verdict == "limit-cycle" and self._will_be(scene, result))
        return Judgement(steady, verdict, result["window"]["oscillation_m"], result, presumed)

    def _needed(self, scene: Scene, result: Summary) -> int:
        """Returns how many times as long a run must be for its swings to die away; 1 where the exact map tells."""
        rate = _dying_1_s(result)
        if not rate or is_linear(scene, self._kinds):
            return 1
        least_m = max(SMALLEST_SWING_M, scene.encoder.resolution if scene.encoder else 0.0)
        swing_m = result["window"]["oscillation_m"] / 2.0
        needs_s = result["duration_s"] + math.log(max(1.0, swing_m / least_m)) / rate
        allowed = LONGER if execution_mode(scene) == "arrays" else LONGER[:1]
        return next((factor for factor in allowed if needs_s <= factor * scene.duration), 1)

    def _will_be(self, scene: Scene, result: Summary) -> bool:
        """Tells whether swings that die away more slowly than the run could show do so in the exact map, too."""
        if not _dying_1_s(result) or not is_linear(scene, self._kinds) or not scene.wall:
            return False
        device = Device(mass=scene.device.mass, damping=scene.device.damping)
        hand = scene.hand and replace(scene.hand, force=None, rest=0.0)
        # The map is one for all stiffnesses, starts and forces.
        loop = replace(scene, title="", seed=0, run=Run(), duration=1.0, wall=None, device=device, hand=hand)
        if (key := repr(loop)) not in self._maps:
            self._maps[key] = OneTickMap.from_scene(scene, self._kinds)
        return self._maps[key].growth(scene.wall.stiffness) < 1.0

    def _results(self, scenes: Sequence[Scene], energy: bool) -> list[Summary]:
        bundles = sorted(_bundled(scenes), key=lambda bundle: -_seconds(scenes, bundle))
        found: list[Summary] = [{}] * len(scenes)
        work = _Bundles(sources=self._sources, energy=energy)
        items = [Group([[scenes[index] for index in bundle]], together=False) for bundle in bundles]
        # Items come back as they went; identity tells which is which.
        place = {id(group.items[0]): bundle for group, bundle in zip(items, bundles, strict=True)}
        heavy = self._workers != 1 and sum(_seconds(scenes, bundle) for bundle in bundles) >= _WORTH_S
        if heavy and not self._pool:
            self._pool = Pool(self._workers)
        for part in (self._pool if heavy and self._pool else self._here).parts(work, items):
            for item, results in part:
                for index, result in zip(place[id(item)], results, strict=True):
                    found[index] = result
                self.runs += len(item)
                self._told(self.runs)
        return found


@dataclass(frozen=True)
class _Bundles(Work):
    """Work on bundles: an item is a list of scenes that run together, its result a list of results."""

    def run(self, items: Sequence[Any]) -> tuple[float, list[Any]]:
        began, run = time.perf_counter(), super().run
        done = [run(bundle)[1] for bundle in items]
        return time.perf_counter() - began, done

    def lost(self, item: Any, why: str) -> Any:
        lost = super().lost
        return [lost(scene, why) for scene in item]

    def _results(self) -> Results:
        return partial(batch_results, kinds=load_kinds(self.sources), energy=self.energy, fewest=FEWEST)


def _bundled(scenes: Sequence[Scene]) -> list[list[int]]:
    """Returns indices of the scenes that run together; each of the others by itself."""
    found, alone = [], set(range(len(scenes)))
    for group in groups(scenes):
        if len(group) >= FEWEST:
            alone.difference_update(group)
            parts = -(-len(group) // MOST) if scenes[group[0]].friction else 1
            found += [group[part::parts] for part in range(parts)]
    return found + [[index] for index in sorted(alone)]


def _seconds(scenes: Sequence[Scene], bundle: list[int]) -> float:
    first = scenes[bundle[0]]
    in_array_s = _IN_IT_S * (first.friction is not None) + _ARRAY_S / len(bundle)
    return first.duration * (_ALONE_S if len(bundle) < FEWEST else in_array_s) * len(bundle)


def _dying_1_s(result: Summary) -> float:
    """Returns the rate r of e^(-r t) by which the swings of a limit cycle die away; 0 where they do not."""
    rate = result["window"]["growth_1_s"] if result.get("verdict") == "limit-cycle" else None
    return -rate if rate is not None and rate < -_DYING_1_S else 0.0
