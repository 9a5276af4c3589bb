"""Many runs at once: scenes of one structure in arrays, light work in this process, heavy work on several cores."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from haploop.launch.batch.run import groups
from haploop.launch.batch.stacking import is_batchable
from haploop.tools.executor.parts import Group
from haploop.tools.executor.pool import Pool, read_sources
from haploop.tools.executor.work import Result, Results, Scene, Work, load_kinds

# Without energy books, so many loops of one structure are already sooner run in an array; more than so many with
# friction, whose stops and starts take their time, are better shared between workers.
FEWEST, MOST = 3, 64
# Processor seconds that a simulated second takes, about: of an array, of a loop in it with friction, of a loop alone.
_ARRAY_S, _IN_IT_S, _ALONE_S = 0.2, 0.03, 0.15
# Fewer are not worth the start of workers.
_WORTH_S = 6.0


@dataclass(frozen=True)
class Bundles(Work):
    """Work on bundles: an item is a list of scenes that run together, its result a list of results."""

    fewest: int = FEWEST

    def run(self, items: Sequence[Any]) -> tuple[float, list[Any]]:
        """Runs every scene of every bundle; returns the seconds all of it took, and the results."""
        began, run = time.perf_counter(), super().run
        done = [run(bundle)[1] for bundle in items]
        return time.perf_counter() - began, done

    def lost(self, item: Any, why: str) -> Any:
        """Returns a result for every scene of a bundle that cannot be run."""
        lost = super().lost
        return [lost(scene, why) for scene in item]

    def _results(self) -> Results:
        from haploop.launch.batch.run import batch_results

        return partial(batch_results, kinds=load_kinds(self.sources), energy=self.energy, fewest=self.fewest)


class Runs:
    """Runs scenes, the heaviest first; a context manager.

    Args:
        plugins: files with elements.
        workers: processes; as many as there are cores when None.
        on_progress: called with the number of runs done so far.

    Attributes:
        count: runs done so far.
    """

    def __init__(self, plugins: Sequence[Path], workers: int | None, on_progress: Callable[[int], object]) -> None:
        self._sources, self._workers, self._told = read_sources(plugins), workers, on_progress
        self._here = Pool(1)
        self._pool: Pool | None = None
        self.count = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._pool:
            self._pool.__exit__(kind, error, traceback)

    def results(self, scenes: Sequence[Scene], energy: bool) -> list[Result]:
        """Runs scenes and returns their summaries, in order."""
        bundles = sorted(_bundled(scenes), key=lambda bundle: -_seconds(scenes, bundle))
        found: list[Result] = [{}] * len(scenes)
        work = Bundles(sources=self._sources, energy=energy)
        items = [Group([[scenes[index] for index in bundle]], together=False) for bundle in bundles]
        # Items come back as they went; identity tells which is which.
        place = {id(group.items[0]): bundle for group, bundle in zip(items, bundles, strict=True)}
        for part in self._pool_for(sum(_seconds(scenes, bundle) for bundle in bundles)).parts(work, items):
            for item, results in part:
                for index, result in zip(place[id(item)], results, strict=True):
                    found[index] = result
                self.count += len(item)
                self._told(self.count)
        return found

    def _pool_for(self, seconds: float) -> Pool:
        if seconds < _WORTH_S or self._workers == 1:
            return self._here
        self._pool = self._pool or Pool(self._workers)
        return self._pool


def _bundled(scenes: Sequence[Scene]) -> list[list[int]]:
    """Returns indices of the scenes that run together; each of the others by itself."""
    found, alone = [], set(range(len(scenes)))
    for group in groups(scenes):
        if len(group) >= FEWEST:
            alone.difference_update(group)
            parts = -(-len(group) // MOST) if "friction" in scenes[group[0]] else 1
            found += [group[part::parts] for part in range(parts)]
    return found + [[index] for index in sorted(alone)]


def _seconds(scenes: Sequence[Scene], bundle: list[int]) -> float:
    """Returns about the processor time that a bundle takes, s."""
    first = scenes[bundle[0]]
    each_s = _ALONE_S if len(bundle) < FEWEST else _IN_IT_S * ("friction" in first) + _ARRAY_S / len(bundle)
    return first["duration"] * each_s * len(bundle)


def execution_mode(scene: Scene) -> str:
    """Returns how such scenes run.

    ``"arrays"``, where hundreds cost little more than one; ``"friction"``, in arrays out of which every stop and start
    is taken; ``"alone"``.
    """
    if not is_batchable(scene):
        return "alone"
    return "friction" if "friction" in scene else "arrays"
