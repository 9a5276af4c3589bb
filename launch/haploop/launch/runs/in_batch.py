"""Many scenes at once: those of one structure as batches, all others alone, with the same results bit for bit."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from itertools import chain, pairwise
from typing import TYPE_CHECKING, Any, TypeVar

from haploop.controller.dissipation import ElementError
from haploop.launch.batch.batch import Batch
from haploop.launch.batch.stacking import device_of, is_batchable, structures
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.spec import RunFailed
from haploop.launch.stability.finding import Finding
from haploop.launch.stability.judge import is_watched, with_verdict
from haploop.launch.stability.judge_batch import judge_batch
from haploop.logger.summary import OF_THE_MACHINE, Summary
from haploop.plant.chain.transition import DEVICES
from haploop.plant.choose import needs_chain
from haploop.protocol.scene.scene import Scene

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element

Kinds = dict[str, "type[Element]"]
T = TypeVar("T")
# Fewer members of one structure than the first run faster one by one; more than the second at once outgrow the cache.
FEWEST, MOST = 16, 2048


def run_batch(scenes: Sequence[Scene], kinds: Kinds, **options: Any) -> list[Summary]:
    """Returns the results of ``batch_results``, in the order of the scenes."""
    results = dict(batch_results(scenes, kinds, **options))
    return [results[index] for index in range(len(scenes))]


def batch_results(
    scenes: Sequence[Scene],
    kinds: Kinds,
    *,
    energy: bool = True,
    trajectories: bool = False,
    fewest: int = FEWEST,
    most: int = MOST,
) -> Iterator[tuple[int, Summary]]:
    """Runs resolved scenes to their ends; results are yielded part by part, so that none of them needs to be kept.

    Args:
        scenes: of any structure; scenes that differ in numbers alone are run together.
        energy: whether to keep energy books; they take most of the time.
        trajectories: whether to hash every trajectory.
        fewest, most: members of a batch.

    Yields:
        The index of a scene and the entries of its summary except those of the machine, ``energy`` and
        ``trajectory_sha256`` only if asked for. A run that failed has ``title``, ``seed``, ``ended`` and ``why``.
    """
    alone = set(range(len(scenes)))
    for group in groups(scenes):
        for chunk in _chunks(scenes, group, fewest, most):
            together = _together([scenes[index] for index in chunk], kinds, energy, trajectories)
            for index, result in zip(chunk, together, strict=True):
                if result is not None:
                    alone.remove(index)
                    yield index, result
    for index in sorted(alone):
        yield index, _alone(scenes[index], kinds, energy, trajectories)


def groups(scenes: Sequence[Scene]) -> list[list[int]]:
    """Returns the indices of the scenes of each structure that can be run as a batch."""
    found: dict[Hashable, list[int]] = {}
    fits: dict[Hashable, bool] = {}
    for index, (scene, shape) in enumerate(zip(scenes, structures(scenes), strict=True)):
        # Of one structure either all can be or none; only for chains do the numbers decide as well.
        if shape not in fits or needs_chain(scene):
            fits[shape] = is_batchable(scene)
        if fits[shape]:
            found.setdefault(shape, []).append(index)
    return list(found.values())


def _chunks(scenes: Sequence[Scene], group: list[int], fewest: int, most: int) -> list[list[int]]:
    """Returns the group in as few parts as possible, of equal length; none if it is too small.

    With friction a part has no more devices than a process keeps. A part of a single scene is left out.
    """
    if len(group) < fewest:
        return []
    some = [group]
    if scenes[group[0]].friction:
        by_device: dict[Hashable, list[int]] = {}
        for index in group:
            by_device.setdefault(device_of(scenes[index]), []).append(index)
        some = [[*chain.from_iterable(part)] for part in _parts([*by_device.values()], DEVICES)]
    return [part for one in some for part in _parts(one, most) if len(part) > 1]


def _parts(whole: list[T], most: int) -> list[list[T]]:
    """Returns a list in as few parts as possible, of nearly equal length."""
    parts = -(-len(whole) // most)
    bounds = [len(whole) * part // parts for part in range(parts + 1)]
    return [whole[first:last] for first, last in pairwise(bounds)]


def _together(scenes: Sequence[Scene], kinds: Kinds, energy: bool, trajectories: bool) -> Sequence[Summary | None]:
    """Returns the results of scenes of one structure; None where a scene has to be run alone.

    An element that takes no arrays, or keeps attributes of its own, raises here, and whatever raises for one member
    stops all: run alone, each scene comes to its own end.
    """
    try:
        batch = Batch(scenes, kinds, energy=energy, trajectories=trajectories)
        batch.run()
        return with_verdicts(batch, scenes)
    except (ElementError, ArithmeticError):
        return [None] * len(scenes)


def with_verdicts(batch: Batch, scenes: Sequence[Scene]) -> list[Summary | None]:
    """Returns the results of a batch that has run, with the verdicts that its scenes ask for.

    None where a scene has to be run alone: if a single one is left to be judged, it is no batch.

    Raises:
        ElementError: an element raised while its loop was watched.
    """
    results = batch.results[: len(scenes)]
    watched = [index for index, result in enumerate(results) if result and is_watched(scenes[index], result)]
    if len(watched) == 1:
        results[watched[0]] = None
        watched = []
    end = batch.end(watched) if watched else None
    found = dict(zip(end.numbers.tolist(), judge_batch(end), strict=True)) if end else {}
    diverged = Finding("diverged", "diverged")
    return [
        result and with_verdict(scene, result, lambda index=index: found.get(index, diverged))
        for index, (scene, result) in enumerate(zip(scenes, results, strict=True))
    ]


def _alone(scene: Scene, kinds: Kinds, energy: bool, trajectories: bool) -> Summary:
    aside = {*OF_THE_MACHINE, *(() if energy else ("energy",)), *(() if trajectories else ("trajectory_sha256",))}
    try:
        summary = run_in_process(scene, kinds)
    except RunFailed as error:
        return {"title": scene.title, "seed": scene.seed, "ended": "failed", "why": str(error)}
    return {key: value for key, value in summary.items() if key not in aside}
