"""Many scenes at once: those of one structure in arrays, all others alone, with the same results bit for bit."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from haploop.controller.dissipation import ElementError
from haploop.launch.batch.batch import Batch
from haploop.launch.batch.stacking import runs_in_arrays, structures
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.spec import RunFailed
from haploop.logger.summary import OF_THE_MACHINE

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

Scene = dict[str, Any]
Kinds = dict[str, "type[Element]"]
# Fewer loops of one structure are sooner run one by one; more than so many at once outgrow the cache.
FEWEST, MOST = 16, 2048


def run_array(scenes: Sequence[Scene], kinds: Kinds, **options: Any) -> list[dict[str, Any]]:
    """The results of ``results_of``, in the order of the scenes."""
    results = dict(results_of(scenes, kinds, **options))
    return [results[index] for index in range(len(scenes))]


def results_of(
    scenes: Sequence[Scene],
    kinds: Kinds,
    *,
    energy: bool = True,
    trajectories: bool = False,
    fewest: int = FEWEST,
    most: int = MOST,
) -> Iterator[tuple[int, dict[str, Any]]]:
    """Run resolved scenes to their ends; what came of them is told part by part, so that none of it need be kept.

    Args:
        scenes: of any structure; scenes that differ in numbers alone are run together.
        kinds: element kinds at hand.
        energy: whether to keep energy books; they take most of the time.
        trajectories: whether to hash every trajectory.
        fewest, most: loops in an array.

    Yields:
        The index of a scene and the entries of its summary but for those of the machine, ``energy`` and
        ``trajectory_sha256`` only where asked for. A run that failed has ``title``, ``seed``, ``ended`` and ``why``.
    """
    alone = set(range(len(scenes)))
    for group in groups(scenes):
        for chunk in _chunks(group, fewest, most):
            together = _together([scenes[index] for index in chunk], kinds, energy, trajectories)
            for index, result in zip(chunk, together, strict=True):
                if result is not None:
                    alone.remove(index)
                    yield index, result
    for index in sorted(alone):
        yield index, _alone(scenes[index], kinds, energy, trajectories)


def groups(scenes: Sequence[Scene]) -> list[list[int]]:
    """Indices of the scenes of each structure that runs in arrays."""
    found: dict[Hashable, list[int]] = {}
    for index, (scene, shape) in enumerate(zip(scenes, structures(scenes), strict=True)):
        if runs_in_arrays(scene):
            found.setdefault(shape, []).append(index)
    return list(found.values())


def _chunks(group: list[int], fewest: int, most: int) -> list[list[int]]:
    """The group in as few parts as can be, equally long; none where it is too small."""
    if len(group) < fewest:
        return []
    parts = -(-len(group) // most)
    bounds = [len(group) * part // parts for part in range(parts + 1)]
    return [group[first:last] for first, last in pairwise(bounds)]


def _together(
    scenes: Sequence[Scene], kinds: Kinds, energy: bool, trajectories: bool
) -> Sequence[dict[str, Any] | None]:
    """The results of scenes of one structure; None where a scene has to be run alone.

    An element that does not take arrays raises here, and whatever raises for one loop stops all: alone, every loop
    comes to its own end.
    """
    try:
        loops = Batch(scenes, kinds, energy=energy, trajectories=trajectories)
        loops.run()
    except (ElementError, ArithmeticError):
        return [None] * len(scenes)
    return loops.results


def _alone(scene: Scene, kinds: Kinds, energy: bool, trajectories: bool) -> dict[str, Any]:
    aside = {*OF_THE_MACHINE, *(() if energy else ("energy",)), *(() if trajectories else ("trajectory_sha256",))}
    try:
        summary = run_in_process(scene, kinds)
    except RunFailed as error:
        return {"title": scene["title"], "seed": scene["seed"], "ended": "failed", "why": str(error)}
    return {key: value for key, value in summary.items() if key not in aside}
