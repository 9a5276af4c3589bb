"""The measurements of ``haploop cost``: out of the store where known, else made; put together for cost.json."""

from __future__ import annotations

import dataclasses
import random
from collections.abc import Callable, Iterable
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from haploop.tools.cost import times
from haploop.tools.cost.advice import advice
from haploop.tools.cost.data import Cost, Errors, Load, Point, ReferenceNote, SceneCost, Spread
from haploop.tools.cost.grid import Candidate, Grid, digest, scenes_folder
from haploop.tools.cost.points import Outcome, outcome
from haploop.tools.cost.prices.prices import Prices
from haploop.tools.cost.store import Store
from haploop.tools.cost.times import IN_PROCESS, PROCESSES, Job
from haploop.tools.machine import commit, machine, source_digest, versions
from haploop.tools.render.progress import Stage

if TYPE_CHECKING:
    from haploop.tools.reference.nearest import Reference

_OUTCOME, _REFERENCE = "outcome", "reference"
# What the errors and the times depend on, beside the scenes: packages whole, and of this one these files.
_PACKAGES = ("haploop.protocol", "haploop.plant", "haploop.controller", "haploop.logger", "haploop.launch")
_FILES = ("cost/points.py", "cost/times.py", "operations.py", "trajectory.py", "reference/nearest.py")
# From a scene file and its resolved scene to what its runs are compared with.
ReferenceFor = Callable[[Path, dict[str, Any]], "Reference"]


class Measurement:
    """The measurements of some grids, kept in a directory; a context manager.

    Args:
        grids: what to compare.
        out: the directory, made.
        repeats, processes_repeats: of each time in one process and as processes; 0 for not at all.
        reference_for: makes or finds a scene's reference; the stored ones and those made on the fly when None.
    """

    def __init__(
        self,
        grids: list[Grid],
        out: Path,
        repeats: int,
        processes_repeats: int,
        reference_for: ReferenceFor | None = None,
    ) -> None:
        self._grids = grids
        self._repeats = {IN_PROCESS: repeats, PROCESSES: processes_repeats}
        self._reference_for = reference_for
        self._made_with = [machine(), versions(), _sources()]
        self._store = Store(out)

    def __enter__(self) -> Self:
        self._store.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._store.__exit__(kind, error, traceback)

    def _key(self, candidate: Candidate) -> str:
        return candidate.key(*self._made_with)

    def _reference_key(self, grid: Grid) -> str:
        return digest([grid.scene, *self._made_with])

    def errors(self, stage: Stage) -> None:
        """Runs every candidate of which nothing is known, and compares it.

        The order is random, so that the time left is told well.
        """
        for grid in self._grids:
            left = [c for c in grid.candidates if not self._store.has(_OUTCOME, self._key(c))]
            if not left and self._store.has(_REFERENCE, self._reference_key(grid)):
                continue
            advance = stage(f"{grid.name}: errors", len(left))
            reference = self._find_reference(grid)
            for candidate in random.Random(0).sample(left, len(left)):
                came = outcome(candidate, reference)
                self._store.add(_OUTCOME, self._key(candidate), dataclasses.asdict(came))
                advance()

    def _find_reference(self, grid: Grid) -> Reference:
        if self._reference_for is None:
            from haploop.tools.reference.nearest import reference_for

            self._reference_for = reference_for
        reference = self._reference_for(grid.path, grid.scene)
        note = ReferenceNote(reference.how, reference.error_m, reference.pointwise, reference.verdict)
        self._store.add(_REFERENCE, self._reference_key(grid), dataclasses.asdict(note))
        return reference

    def times(self, stage: Stage) -> None:
        """Makes every measurement of time that is missing; errors come first."""
        for way, repeats in self._repeats.items():
            jobs = self._jobs(way)
            if count := times.missing(self._store, jobs, repeats):
                times.measure(self._store, jobs, repeats, stage(f"times, {way}", count))

    def other_prices(self, stage: Stage) -> None:
        """Measures the prices of books, log, effects, processes, delay and control rate."""
        self._prices().measure(stage)

    def _prices(self) -> Prices:
        return Prices(scenes_folder(), self._store, self._repeats)

    def _jobs(self, way: str) -> list[Job]:
        """Returns a job for every candidate whose run had a tick; as processes, for those that ended as planned."""
        found = [(c, self._key(c), self._outcome(c)) for grid in self._grids for c in grid.candidates]
        if way == PROCESSES:
            return [times.processes_job(c, key, came.ticks) for c, key, came in found if came and came.error]
        return [
            times.in_process_job(c, key, came.ticks, diverges=came.error is None)
            for c, key, came in found
            if came and came.ticks
        ]

    def _outcome(self, candidate: Candidate) -> Outcome | None:
        record = self._store.get(_OUTCOME, self._key(candidate))
        if record is None:
            return None
        error = Errors(**record["error"]) if record["error"] else None
        return Outcome(**{**record, "error": error})

    def cost(self, tolerance_m: float) -> Cost:
        """Returns all that is known so far, the prices included."""
        scenes = [self._scene_cost(grid, tolerance_m) for grid in self._grids if self._note(grid)]
        loads = [times.quiet(self._store, self._jobs(way), n) for way, n in self._repeats.items()]
        return Cost(
            machine=machine(),
            versions=versions(),
            commit=commit(),
            repeats=self._repeats[IN_PROCESS],
            processes_repeats=self._repeats[PROCESSES],
            tolerance_m=tolerance_m,
            load=_worst(load for load in loads if load),
            scenes=scenes,
            prices=self._prices().groups(),
        )

    def _note(self, grid: Grid) -> dict[str, Any] | None:
        return self._store.get(_REFERENCE, self._reference_key(grid))

    def _scene_cost(self, grid: Grid, tolerance_m: float) -> SceneCost:
        method, rate = grid.own
        note = ReferenceNote(**(self._note(grid) or {}))
        points = [point for candidate in grid.candidates if (point := self._point(candidate))]
        complete = len(points) == len(grid.candidates) and not self._untimed()
        ticks = round(grid.scene["duration"] * grid.scene["clock"]["control_rate"])
        made = SceneCost(grid.name, grid.scene["title"], method, rate, ticks, note, points)
        return dataclasses.replace(made, advice=advice(made, tolerance_m)) if complete else made

    def _untimed(self) -> int:
        return times.missing(self._store, self._jobs(IN_PROCESS), self._repeats[IN_PROCESS])

    def _point(self, candidate: Candidate) -> Point | None:
        came = self._outcome(candidate)
        if came is None:
            return None
        key = self._key(candidate)
        return Point(
            candidate.method,
            candidate.plant_rate,
            came.error,
            came.failure,
            us_per_tick=self._spread(IN_PROCESS, key),
            processes_us_per_tick=self._spread(PROCESSES, key),
            instructions_per_tick=came.instructions_per_tick,
        )

    def _spread(self, what: str, key: str) -> Spread | None:
        values = [value for value in self._store.all(what, key, self._repeats[what]) if value is not None]
        return Spread.from_values(values) if values else None


def _sources() -> str:
    here = Path(__file__).parents[1]
    return source_digest(_PACKAGES, [*(here / name for name in _FILES), *sorted((here / "reference/stored").glob("*"))])


def _worst(loads: Iterable[Load]) -> Load | None:
    """Returns the busiest."""
    return max(loads, key=lambda load: (load.busy, load.calibration_spread), default=None)
