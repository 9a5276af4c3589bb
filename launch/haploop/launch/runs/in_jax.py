"""Many scenes at once with the same code, compiled, on a CPU or a GPU (needs the extra ``haploop[jax]``)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import Any

from haploop.controller.dissipation import ElementError
from haploop.launch.batch.stacking import structure
from haploop.launch.runs.in_batch import FEWEST, Kinds, batch_results, groups, with_verdicts
from haploop.logger.summary import Summary
from haploop.plant.choose import needs_chain
from haploop.protocol.scene.scene import Scene, accelerometer_is_used
from haploop.protocol.ticks import Timebase

# Arrays have the largest size, or a half, a quarter or an eighth of it: few sizes have to be compiled.
_PARTS = (8, 4, 2, 1)
# Ticks, summed over members, that take about as long as compiling a program.
LEAST = 5_000_000


def compiled_results(
    scenes: Sequence[Scene], kinds: Kinds, *, energy: bool = True, fewest: int = FEWEST, most: int | None = None,
    least: int = LEAST,
) -> Iterator[tuple[int, Summary]]:  # fmt: skip
    """Runs resolved scenes to their ends, with one compiled program for all scenes that differ in numbers alone.

    The tick of a batch, a function of its parameters and its state, is traced on jax's placeholders, compiled, and kept
    for as long as the process lives. The first ticks and those after a change are done by ``Batch``. Random numbers
    come from the same streams. It runs on jax's default device; on GPUs it has been compiled, but never yet run.

    **Tolerance.** Every operation is the same in float64, except for products and sums that the compiler makes in one
    rounding. Positions stay within 1e-11 of the largest excursion from those of the scene run alone while no rounding
    of the encoder, contact, gate or window of an estimator falls to the other side. Where one does, the run from there
    on is a different one of the same kind, so in long limit cycles amplitude and energies agree, but not instants. The
    books balance to 1e-14 of the energy that moved: what single additions lose is kept by block, not by tick.

    Args:
        scenes, kinds, energy, fewest: as for ``batch_results``, which also runs the scenes that cannot be compiled:
            those with bodies in a row, friction, jitter, loss, or an element that asks what its numbers are.
        most: members of a batch; None for what suits the device.
        least: a structure is compiled once this many ticks of its scenes have been asked for in this process.

    Yields:
        The index of a scene and the entries of its summary, as ``batch_results`` does without ``trajectories``.

    Raises:
        ImportError: jax is not installed.
    """
    suits: int = _programs().most()  # called in any case: it also tells jax how to compile
    size = suits if most is None else most
    left = set(range(len(scenes)))
    for group in groups(scenes):
        if not _is_worth_compiling(scenes[group[0]], len(group), least):
            continue
        if len(group) < fewest:
            continue
        for first in range(0, len(group), size):
            chunk = group[first : first + size]
            results = _together([scenes[index] for index in chunk], kinds, energy, size)
            for index, result in zip(chunk, results, strict=True):
                if result is not None:
                    left.remove(index)
                    yield index, result
    others = sorted(left)
    for index, result in batch_results([scenes[index] for index in others], kinds, energy=energy, fewest=fewest):
        yield others[index], result


def compiling() -> tuple[int, float]:
    """Returns how many programs were compiled in this process, and how many seconds that took."""
    programs = _programs().PROGRAMS
    return programs.count, programs.seconds


def _is_worth_compiling(scene: Scene, members: int, least: int) -> bool:
    if needs_chain(scene) or (scene.accelerometer and accelerometer_is_used(scene)):
        return False
    asked = _programs().PROGRAMS.asked
    asked[structure(scene)] += members * Timebase.from_scene(scene).ticks
    return asked[structure(scene)] >= least


def _together(scenes: list[Scene], kinds: Kinds, energy: bool, most: int) -> list[Summary | None]:
    """Returns the results of scenes of one structure; None where a scene has to be run by ``batch_results``."""
    from haploop.launch.batch.jax.batch import CompiledBatch
    from haploop.launch.batch.jax.tick import NotCompilable

    size = next(most // part for part in _PARTS if len(scenes) <= most // part)
    programs = _programs()
    try:
        with programs.in_double():
            batch = CompiledBatch(scenes, kinds, energy=energy, size=size, programs=programs.PROGRAMS)
            batch.run()
        return with_verdicts(batch, scenes)
    except (ElementError, NotCompilable):
        return [None] * len(scenes)


def _programs() -> Any:
    try:
        return import_module("haploop.launch.batch.jax.programs")
    except ImportError as error:
        raise ImportError("Compiled runs need jax; install it with: pip install 'haploop[jax]'") from error
