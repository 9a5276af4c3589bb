"""The measurements of ``haploop cost``: taken from the store if known, else made; put together for cost.json."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path

from pydantic import TypeAdapter

from haploop.plant.chain.chain import Chain
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.tools.cost import times
from haploop.tools.cost.alike import timed_alike
from haploop.tools.cost.data import AlikeScene, Cost, Point, ReferenceNote, SceneCost, Spread, Step
from haploop.tools.cost.findings import COMPILED, EXACT, advice
from haploop.tools.cost.grid import Candidate, Grid, Outcome, errors_made_with, outcome, times_made_with, true_swings
from haploop.tools.cost.prices import Prices
from haploop.tools.cost.reference import Reference, reference_for
from haploop.tools.cost.times import IN_PROCESS, PROCESSES, Job, Store
from haploop.tools.machine import commit, machine, versions
from haploop.tools.render.progress import Stage

# Far enough for some ticks more, near enough for squares to stay finite.
_FAR_M = 1e40
# Shorter blocks cost more than what is in them.
_LEAST_BLOCK = 20
_OUTCOME, _REFERENCE, _ALIKE = "outcome", "reference", "steps alike"


class Measurement:
    """The measurements of some grids, kept in an existing directory.

    ``repeats`` is how often each time in one process is measured, ``processes_repeats`` each other price as processes,
    0 for not at all. ``find_reference`` makes or finds what the runs of a scene, given by its file and resolved, are
    compared with.
    """

    def __init__(
        self,
        grids: list[Grid],
        out: Path,
        repeats: int,
        processes_repeats: int,
        find_reference: Callable[[Path, Scene], Reference] = reference_for,
    ) -> None:
        self._grids, self._find_reference, self._store = grids, find_reference, Store(out)
        self._repeats = {IN_PROCESS: repeats, PROCESSES: processes_repeats}
        self._errors_made_with, self._times_made_with = errors_made_with(), times_made_with()

    def _error_key(self, of: Candidate | Grid) -> str:
        return of.key(*self._errors_made_with)

    def _time_key(self, of: Candidate | Grid) -> str:
        return of.key(*self._times_made_with)

    def errors(self, stage: Stage) -> None:
        """Runs and compares every candidate not known yet, in random order, so that the time left is estimated well."""
        for grid in self._grids:
            left = [c for c in grid.candidates if not self._store.has(_OUTCOME, self._error_key(c))]
            if not left and self._store.has(_REFERENCE, self._error_key(grid)):
                continue
            advance = stage(f"{grid.path.stem}: errors", len(left))
            reference = self._find_reference(grid.path, grid.scene)
            note = ReferenceNote(reference.how, reference.error_m, reference.pointwise)
            self._store.add(_REFERENCE, self._error_key(grid), asdict(note))
            swings = () if reference.pointwise else true_swings(grid.scene)
            for candidate in random.Random(0).sample(left, len(left)):
                came = outcome(candidate, reference, swings)
                self._store.add(_OUTCOME, self._error_key(candidate), asdict(came))
                advance()

    def times(self, stage: Stage) -> None:
        """Makes every measurement of time that is missing; errors come first."""
        times.measure(self._store, self._jobs(), self._repeats[IN_PROCESS], f"times, {IN_PROCESS}", stage)
        for grid in self._grids:
            if not (grid.scene.friction or self._store.has(_ALIKE, self._time_key(grid))):
                advance = stage(f"{grid.path.stem}: steps alike", 1)
                steps = timed_alike(grid.scene, self._repeats[IN_PROCESS])
                self._store.add(_ALIKE, self._time_key(grid), [asdict(step) for step in steps])
                advance()

    @cached_property
    def other_prices(self) -> Prices:
        """The prices of books, log, effects, processes, delay and control rate."""
        return Prices(self._store, self._repeats)

    def _jobs(self) -> list[Job]:
        ways = [(c, is_compiled) for grid in self._grids for c in grid.candidates for is_compiled in self._ways(c)]
        return [job for candidate, is_compiled in ways if (job := self._job(candidate, is_compiled))]

    @staticmethod
    def _ways(candidate: Candidate) -> tuple[bool, ...]:
        """Returns whether a candidate is timed as machine code: without it, and also with it if its motion has some."""
        has_loops = candidate.method == EXACT and candidate.scene and candidate.scene.friction and find_spec("numba")
        return (False, True) if has_loops else (False,)

    def _job(self, candidate: Candidate, is_compiled: bool) -> Job | None:
        """Makes a job from a candidate whose run had a tick.

        A run that diverges has only a few ticks: it may go on far beyond where it is otherwise stopped, in blocks so
        short that there is more than one if possible.
        """
        came, scene = self._outcome(candidate), candidate.scene
        key = _compiled(self._time_key(candidate), is_compiled)
        if scene is None or came is None or not (ticks := came.ticks):
            return None
        measured = scene
        if came.error is None:
            short = replace(scene.run, block_ticks=max(_LEAST_BLOCK, ticks // 2))
            measured = replace(scene, diverged_beyond=_FAR_M, run=short)
        family = candidate.path, candidate.method, is_compiled
        return Job(IN_PROCESS, family, key, measured, lambda: times.loop_us(measured), is_compiled)

    def _outcome(self, candidate: Candidate) -> Outcome | None:
        record = self._store.get(_OUTCOME, self._error_key(candidate))
        return record and TypeAdapter(Outcome).validate_python(record)

    def cost(self, tolerance_m: float) -> Cost:
        return Cost(
            machine=machine(),
            versions=versions(),
            commit=commit(),
            repeats=self._repeats[IN_PROCESS],
            processes_repeats=self._repeats[PROCESSES],
            tolerance_m=tolerance_m,
            yardstick=times.YARDSTICK,
            load=times.quiet(self._store, self._jobs(), self._repeats[IN_PROCESS]),
            scenes=[made for grid in self._grids if (made := self._scene_cost(grid, tolerance_m))],
            prices=self.other_prices.groups(),
            alike=[made for grid in self._grids if (made := self._alike(grid))],
        )

    def _alike(self, grid: Grid) -> AlikeScene | None:
        found = self._store.get(_ALIKE, self._time_key(grid))
        states = len(Chain.from_scene(grid.scene).states)
        return found and AlikeScene(grid.path.stem, states, TypeAdapter(list[Step]).validate_python(found))

    def _scene_cost(self, grid: Grid, tolerance_m: float) -> SceneCost | None:
        """Returns what is known of a scene, with advice once that is complete; None before its reference exists."""
        if (note := self._store.get(_REFERENCE, self._error_key(grid))) is None:
            return None
        points = [point for candidate in grid.candidates if (point := self._point(candidate, False))]
        ways = [candidate for candidate in grid.candidates if True in self._ways(candidate)]
        compiled = [point for candidate in ways if (point := self._point(candidate, True))]
        scene, ticks = grid.scene, Timebase.from_scene(grid.scene).ticks
        about = *grid.own, scene.clock.control_rate, ticks, ReferenceNote(**note)
        made = SceneCost(grid.path.stem, scene.title, *about, points, compiled=compiled)
        untimed = times.missing(self._store, self._jobs(), self._repeats[IN_PROCESS])
        complete = len(points) == len(grid.candidates) and not untimed
        return replace(made, advice=advice(made, tolerance_m)) if complete else made

    def _point(self, candidate: Candidate, is_compiled: bool) -> Point | None:
        if (came := self._outcome(candidate)) is None:
            return None
        key = _compiled(self._time_key(candidate), is_compiled)
        values = self._store.all(IN_PROCESS, key, self._repeats[IN_PROCESS])
        known = [value for value in values if value is not None]
        time = Spread.from_values(known) if known else None
        method = COMPILED if is_compiled else candidate.method
        return Point(method, candidate.plant_rate, came.error, came.failure, time)


def _compiled(key: str, is_compiled: bool) -> str:
    """Returns the name in the store of a time, of machine code or not."""
    return f"{key} compiled" if is_compiled else key
