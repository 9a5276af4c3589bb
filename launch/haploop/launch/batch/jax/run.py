"""Many scenes at once by the same code compiled, on a CPU or a GPU (needs the extra ``haploop[jax]``)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import Any

from haploop.controller.dissipation import ElementError
from haploop.launch.batch.run import FEWEST, Kinds, Scene, groups, results_of
from haploop.launch.batch.stacking import structure
from haploop.plant.choose import needs_chain
from haploop.plant.sensing.encoder import accelerometer_is_used
from haploop.protocol.ticks import Timebase

# Arrays are of the greatest size, or of a half, a quarter or an eighth of it: few sizes have to be compiled.
_PARTS = (8, 4, 2, 1)
# Intervals of loops in arrays that take about as long as compiling a program does.
LEAST = 5_000_000


def results_of_compiled(
    scenes: Sequence[Scene], kinds: Kinds, *, energy: bool = True, fewest: int = FEWEST, most: int | None = None,
    least: int = LEAST,
) -> Iterator[tuple[int, dict[str, Any]]]:  # fmt: skip
    """As ``results_of``, by one compiled program for all scenes that differ in numbers alone.

    Sensor, estimators, wall, elements, line, motion and books are the objects of a single loop, run once on jax's
    placeholders; what comes out is compiled and kept for as long as the process lives. The first ticks and those after
    a change are done by ``Batch``. What is random comes from the same streams. It runs where jax does by default;
    on GPUs it has been compiled, but never yet run.

    **Tolerance.** Every operation is the same in float64, but for products and sums that the compiler makes in one
    rounding. Positions stay within 1e-11 of the largest excursion of the scene alone while no rounding of the encoder,
    contact, gate or window of an estimator falls to the other side; where one does, the loop is another of the same
    kind from there on, so in long limit cycles it is amplitude and energies that agree, not instants. The books
    balance as well as alone.

    Args:
        scenes, kinds, energy, fewest: as there. A scene whose loop cannot be compiled goes there: bodies in a row,
            friction, jitter, loss, an element that asks what its numbers are.
        most: loops in an array; what suits the device where it is None.
        least: scenes of a structure are compiled when so many ticks of them have been asked for in this process.

    Yields:
        As there, without ``trajectory_sha256``.

    Raises:
        ImportError: jax is not installed.
    """
    suits: int = _programs().most()  # asked for in any case: it also tells jax how to compile
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
    for index, result in results_of([scenes[index] for index in others], kinds, energy=energy, fewest=fewest):
        yield others[index], result


def compiling() -> tuple[int, float]:
    """How many programs were compiled in this process, and how many seconds that took."""
    programs = _programs().PROGRAMS
    return programs.count, programs.seconds


def _is_worth_compiling(scene: Scene, loops: int, least: int) -> bool:
    if needs_chain(scene) or ("accelerometer" in scene and accelerometer_is_used(scene)):
        return False
    asked = _programs().PROGRAMS.asked
    asked[structure(scene)] += loops * Timebase.from_clock(scene["clock"], scene["duration"]).ticks
    return asked[structure(scene)] >= least


def _together(scenes: list[Scene], kinds: Kinds, energy: bool, most: int) -> list[dict[str, Any] | None]:
    """The results of scenes of one structure; None where a scene has to be run by ``results_of``."""
    from haploop.launch.batch.jax.batch import CompiledBatch
    from haploop.launch.batch.jax.tick import NotCompilable

    size = next(most // part for part in _PARTS if len(scenes) <= most // part)
    programs = _programs()
    try:
        with programs.in_double():
            loops = CompiledBatch(scenes, kinds, energy=energy, size=size, programs=programs.PROGRAMS)
            loops.run()
    except (ElementError, NotCompilable):
        return [None] * len(scenes)
    return loops.results[: len(scenes)]


def _programs() -> Any:
    """The module that has to do with jax, which is imported only when it is used."""
    try:
        return import_module("haploop.launch.batch.jax.programs")
    except ImportError as error:
        raise ImportError("Compiled runs need jax; install it with: pip install 'haploop[jax]'") from error
