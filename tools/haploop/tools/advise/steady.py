"""Is a loop steady? Many at once, each run until its swings have died away or will not."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from haploop.launch.array_run import run_array
from haploop.launch.array_scene import runs_in_arrays
from haploop.logger.window import SMALLEST_SWING_M
from haploop.tools.linearity import is_linear
from haploop.tools.one_tick import OneTickMap
from haploop.tools.sweep.pool import Pool

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

Scene = dict[str, Any]
# A run whose swings would die away within so many times its duration is run again, so long; alone the first only.
LONGER = 2, 4, 8
# Swings that die away by less than this a second may as well not.
_DYING_1_S = 0.02
# Processor seconds a tick of a loop in an array and alone, about; fewer seconds than this are not worth a worker.
_ARRAY_S, _ALONE_S, _WORTH_S = 5e-7, 1.2e-4, 2.0
# Without energy books, so many loops of one structure are already sooner run in an array.
_FEWEST = 4


@dataclass(frozen=True)
class Judgement:
    """What a run came to.

    Attributes:
        steady: the verdict, or swings that die away too slowly for a run to end, in a loop whose exact map is stable.
        verdict: of the longest run.
        oscillation_m: peak to peak over its window.
        summary: its summary.
    """

    steady: bool
    verdict: str
    oscillation_m: float
    summary: dict[str, Any]


class Judge:
    """Runs loops, in arrays or on several cores, and judges them; a context manager.

    Args:
        kinds: element kinds at hand.
        plugins: the files they came from.
        workers: processes for loops that do not run in arrays; as many as there are cores when None.
        told: called with the number of runs done so far.
    """

    def __init__(
        self,
        kinds: dict[str, type[Element]],
        plugins: Sequence[Path] = (),
        workers: int | None = None,
        told: Callable[[int], object] = lambda runs: None,
    ) -> None:
        self._kinds, self._plugins, self._workers, self._told = kinds, plugins, workers, told
        self._pool: Pool | None = None
        self._maps: dict[str, OneTickMap] = {}
        self.runs = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._pool:
            self._pool.__exit__(kind, error, traceback)

    def judged(self, scenes: Sequence[Scene], energy: bool = False) -> list[Judgement]:
        """What each loop comes to, in order.

        A run whose swings die away too slowly for its duration is repeated as much longer as will do.
        """
        found = self._results(scenes, energy)
        needed = [self._needed(scene, result) for scene, result in zip(scenes, found, strict=True)]
        for factor in LONGER:
            again = [index for index, needs in enumerate(needed) if needs == factor]
            longer = [{**scenes[i], "duration": scenes[i]["duration"] * factor} for i in again]
            for index, result in zip(again, self._results(longer, energy), strict=True):
                found[index] = result
        return [self._judgement(scene, result) for scene, result in zip(scenes, found, strict=True)]

    def _results(self, scenes: Sequence[Scene], energy: bool) -> list[dict[str, Any]]:
        if not scenes:
            return []
        if sum(map(_seconds, scenes)) < _WORTH_S:
            found = run_array(scenes, self._kinds, energy=energy, fewest=_FEWEST)
            self._count(len(scenes))
            return found
        self._pool = self._pool or Pool(self._workers)
        placed: dict[int, dict[str, Any]] = {}
        for index, result in self._pool.results(scenes, self._plugins, energy=energy):
            placed[index] = result
            self._count(1)
        return [placed[index] for index in range(len(scenes))]

    def _count(self, runs: int) -> None:
        self.runs += runs
        self._told(self.runs)

    def _judgement(self, scene: Scene, result: dict[str, Any]) -> Judgement:
        if result["ended"] not in ("done", "diverged"):
            return Judgement(False, result["ended"], math.inf, result)
        verdict = result["verdict"]
        steady = verdict == "steady" or (verdict == "limit-cycle" and self._will_be(scene, result))
        return Judgement(steady, verdict, result["window"]["oscillation_m"], result)

    def _needed(self, scene: Scene, result: dict[str, Any]) -> int:
        """How many times as long a run must be for its swings to die away; 1 where the exact map knows sooner."""
        rate = _dying_1_s(result)
        if not rate or is_linear(scene, self._kinds):
            return 1
        least_m = max(SMALLEST_SWING_M, scene.get("encoder", {}).get("resolution", 0.0))
        swing_m = result["window"]["oscillation_m"] / 2.0
        needs_s = result["duration_s"] + math.log(max(1.0, swing_m / least_m)) / rate
        allowed = [factor for factor in LONGER if is_cheap(scene) or factor == LONGER[0]]
        return next((factor for factor in allowed if needs_s <= factor * scene["duration"]), 1)

    def _will_be(self, scene: Scene, result: dict[str, Any]) -> bool:
        """Whether swings that die away more slowly than the run could show do so in the exact map, too."""
        if not _dying_1_s(result) or not is_linear(scene, self._kinds):
            return False
        return self._map(scene).growth(scene["wall"]["stiffness"]) < 1.0

    def _map(self, scene: Scene) -> OneTickMap:
        """The exact map, which is one for all stiffnesses, starts and forces."""
        hand = {key: value for key, value in scene.get("hand", {}).items() if key not in ("force", "rest")}
        aside = ("title", "seed", "run", "duration", "wall", "device", "hand")
        device = scene["device"]["mass"], scene["device"]["damping"]
        key = repr((device, hand, {name: scene[name] for name in scene if name not in aside}))
        if key not in self._maps:
            self._maps[key] = OneTickMap.of(scene, self._kinds)
        return self._maps[key]


def _dying_1_s(result: dict[str, Any]) -> float:
    """The rate r of e^(-r t) by which the swings of a limit cycle die away; 0 where they do not."""
    rate = result["window"]["growth_1_s"] if result.get("verdict") == "limit-cycle" else None
    return -rate if rate is not None and rate < -_DYING_1_S else 0.0


def _seconds(scene: Scene) -> float:
    """Processor time a run takes, about."""
    ticks = scene["duration"] * scene["clock"]["control_rate"]
    return ticks * (_ARRAY_S if is_cheap(scene) else _ALONE_S)


def is_cheap(scene: Scene) -> bool:
    """Whether many such scenes cost little more than one: they run in arrays, and nothing sticks in between."""
    return runs_in_arrays(scene) and "friction" not in scene
