"""Judgement whether loops are steady: many at once, each run until its swings have died away or will not."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from haploop.launch.batch.run import groups
from haploop.logger.verdict.measures import SMALLEST_SWING_M
from haploop.tools.advise.runs import Runs, execution_mode
from haploop.tools.advise.tasks import is_held_by
from haploop.tools.linear.linearity import is_linear
from haploop.tools.linear.one_tick import OneTickMap

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

Scene = dict[str, Any]
# A run whose swings would die away within so many times its duration is run again, so long; alone the first only.
LONGER = 2, 4, 8
# Swings that die away by less than this a second may as well not; by more than this, they may be soon gone.
_DYING_1_S, _SURELY_DYING_1_S = 0.02, 1.0
# Seconds after which loops with friction are looked at first, where so many are alike: their swings cost most.
GLANCE_S, _WORTH_A_GLANCE = 0.25, 8


@dataclass(frozen=True)
class Judgement:
    """The judgement of a run.

    Attributes:
        steady: the verdict, or swings that die away too slowly for a run to end, in a loop whose exact map is stable.
        verdict: of the longest run.
        oscillation_m: peak to peak over its window.
        summary: its summary.
        presumed: whether its swings have still to die away.
    """

    steady: bool
    verdict: str
    oscillation_m: float
    summary: dict[str, Any]
    presumed: bool = False


class Judge:
    """Runs loops, in arrays or on several cores, and judges them; a context manager.

    Args:
        kinds: element kinds at hand.
        plugins: the files they came from.
        workers: processes for loops that do not run in arrays; as many as there are cores when None.
        on_progress: called with the number of runs done so far.
    """

    def __init__(
        self,
        kinds: dict[str, type[Element]],
        plugins: Sequence[Path] = (),
        workers: int | None = None,
        on_progress: Callable[[int], object] = lambda runs: None,
    ) -> None:
        self._kinds, self._runs = kinds, Runs(plugins, workers, on_progress)
        self._maps: dict[str, OneTickMap] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._runs.__exit__(kind, error, traceback)

    @property
    def runs(self) -> int:
        """The number of runs so far."""
        return self._runs.count

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
        results = dict(zip(left, self._runs.results([scenes[i] for i in left], energy), strict=True))
        needed = {index: self._needed(scenes[index], result) for index, result in results.items()}
        for factor in LONGER:
            again = [index for index in left if needed[index] == factor and index not in hasty]
            longer = [{**scenes[i], "duration": scenes[i]["duration"] * factor} for i in again]
            results |= zip(again, self._runs.results(longer, energy), strict=True)
        for index, result in results.items():
            presumed = index in hasty and needed[index] > 1
            found[index] = self._judgement(scenes[index], result, presumed)
        return [found[index] for index in range(len(scenes))]

    def _glanced(self, scenes: Sequence[Scene], hasty: set[int]) -> dict[int, Judgement]:
        """Judges those of the hasty ones that buzz already and will not cease, where friction makes runs dear."""
        able = [i for i in sorted(hasty) if execution_mode(scenes[i]) == "friction" and _can_be_glanced_at(scenes[i])]
        together = groups([scenes[index] for index in able])
        looked = [able[place] for group in together if len(group) >= _WORTH_A_GLANCE for place in group]
        results = self._runs.results([{**scenes[i], "duration": GLANCE_S} for i in looked], energy=False)
        return {
            index: Judgement(False, result["verdict"], result["window"]["oscillation_m"], result)
            for index, result in zip(looked, results, strict=True)
            if result["ended"] == "done" and _goes_on(result)
        }

    def _judgement(self, scene: Scene, result: dict[str, Any], presumed: bool) -> Judgement:
        if result["ended"] not in ("done", "diverged"):
            return Judgement(False, result["ended"], math.inf, result)
        verdict = result["verdict"]
        steady = presumed or verdict == "steady" or (verdict == "limit-cycle" and self._will_be(scene, result))
        return Judgement(steady, verdict, result["window"]["oscillation_m"], result, presumed)

    def _needed(self, scene: Scene, result: dict[str, Any]) -> int:
        """Returns how many times as long a run must be for its swings to die away; 1 where the exact map tells."""
        rate = _dying_1_s(result)
        if not rate or is_linear(scene, self._kinds):
            return 1
        least_m = max(SMALLEST_SWING_M, scene.get("encoder", {}).get("resolution", 0.0))
        swing_m = result["window"]["oscillation_m"] / 2.0
        needs_s = result["duration_s"] + math.log(max(1.0, swing_m / least_m)) / rate
        allowed = LONGER if execution_mode(scene) == "arrays" else LONGER[:1]
        return next((factor for factor in allowed if needs_s <= factor * scene["duration"]), 1)

    def _will_be(self, scene: Scene, result: dict[str, Any]) -> bool:
        """Tells whether swings that die away more slowly than the run could show do so in the exact map, too."""
        if not _dying_1_s(result) or not is_linear(scene, self._kinds):
            return False
        return self._map(scene).growth(scene["wall"]["stiffness"]) < 1.0

    def _map(self, scene: Scene) -> OneTickMap:
        """Returns the exact map, which is one for all stiffnesses, starts and forces."""
        hand = {key: value for key, value in scene.get("hand", {}).items() if key not in ("force", "rest")}
        aside = ("title", "seed", "run", "duration", "wall", "device", "hand")
        device = scene["device"]["mass"], scene["device"]["damping"]
        key = repr((device, hand, {name: scene[name] for name in scene if name not in aside}))
        if key not in self._maps:
            self._maps[key] = OneTickMap.from_scene(scene, self._kinds)
        return self._maps[key]


def _can_be_glanced_at(scene: Scene) -> bool:
    return scene["duration"] > 2.0 * GLANCE_S and is_held_by(scene, GLANCE_S / 2.0)


def _goes_on(result: dict[str, Any]) -> bool:
    """Tells whether a short run swings without dying away."""
    growth = result["window"]["growth_1_s"]
    return result["verdict"] == "limit-cycle" and growth is not None and growth > -_SURELY_DYING_1_S


def _dying_1_s(result: dict[str, Any]) -> float:
    """Returns the rate r of e^(-r t) by which the swings of a limit cycle die away; 0 where they do not."""
    rate = result["window"]["growth_1_s"] if result.get("verdict") == "limit-cycle" else None
    return -rate if rate is not None and rate < -_DYING_1_S else 0.0
