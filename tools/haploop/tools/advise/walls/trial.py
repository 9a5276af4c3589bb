"""The trial of walls: each with an element, in many cases at once, until one of them buzzes; and the results."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Self

import numpy as np

from haploop.controller.dissipation import ElementError
from haploop.protocol.scene.scene import Scene, Wall
from haploop.tools.advise.walls.cases import LASTS_S, Case, slowness
from haploop.tools.advise.walls.felt import Buzz, Threshold, buzz, felt_force_N, slow_swing_m
from haploop.tools.advise.walls.loops import LoneLoop, Loops, is_plain, make_loops
from haploop.tools.advise.walls.store import Failure, Job, Store, Tried
from haploop.tools.executor.executors import Executor, InlineExecutor, make_executor, map_parallel
from haploop.tools.linear.linearity import installed_kinds

# Length of the stretches in which a run is examined, s, and when the first one begins: by then what the tap caused is
# gone, or is dying away.
STRETCH_S, FROM_S = 0.25, 0.75
# A swing dies away if each stretch is at most this share of the one before; what then is still dying is watched this
# many times as long.
_DYING, _LONGER = 0.8, 4
# Slower swings, and bounces, appear only in several stretches together, of which so many samples each are kept; one
# wider than this, m, at the end of that longer time is not borne. It is felt from 2 Hz on.
_TOGETHER, _KEPT, _SLOW_M = 4, 100, 1e-3
# The failure of a wall about which no case tells anything.
_NO_CONTACT = "cannot be judged: in no case is the device still at the wall after {0:g} s"
# Members that are worth a worker of their own.
_PART = 150


class Trial:
    """Tries walls, on several cores where that is worth it, and remembers the results; a context manager.

    Args:
        store: results of an earlier, interrupted advice, and where to keep these.
        workers: number of processes; one per core when None.
        on_progress: called with the number of runs so far.

    Attributes:
        runs: number of loops that were run.
    """

    def __init__(
        self, store: Store, workers: int | None = 1, on_progress: Callable[[int], object] = lambda runs: None
    ) -> None:
        self._store, self._told, self.runs = store, on_progress, 0
        self._here, self._there = InlineExecutor(), make_executor(workers)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._there.close(at_once=kind is not None)

    def failures(self, loop: Scene, walls: Sequence[Tried], cases: Sequence[Case]) -> list[Failure | None]:
        """Returns for each wall the case that it does not bear; None where it bears all."""
        return self.of_jobs([Job(loop, tuple(walls), tuple(cases))])[0]

    def of_jobs(self, jobs: Sequence[Job]) -> list[list[Failure | None]]:
        """Returns the failures of each job's walls, in order."""
        keys = [[self._store.key(job.loop, wall, job.cases) for wall in job.walls] for job in jobs]
        new = {
            key: Job(job.loop, (wall,), job.cases)
            for job, of_job in zip(jobs, keys, strict=True)
            for key, wall in zip(of_job, job.walls, strict=True)
            if key not in self._store.known
        }
        parts = self._parts(new)
        executor: Executor = self._there if len(parts) > 1 else self._here
        work = [[new[key] for key in part] for part in parts]
        for part, found in zip(parts, map_parallel(executor, run_jobs, work), strict=True):
            self._store.add(dict(zip(part, found, strict=True)), new)
            self.runs += sum(len(new[key].cases) for key in part)
            self._told(self.runs)
        return [[self._store.known[key] for key in of_job] for of_job in keys]

    def _parts(self, new: Mapping[str, Job]) -> list[list[str]]:
        """Returns the keys of walls that run in one array together; a large array is shared by the workers."""
        together: dict[str, list[str]] = {}
        late = {id(loop): slowness(loop) for loop in {id(job.loop): job.loop for job in new.values()}.values()}
        for key, job in new.items():
            elements = job.walls[0].elements
            kinds = "plain" if is_plain(elements) else [element.name for element in elements]
            together.setdefault(repr((kinds, job.loop.clock, late[id(job.loop)])), []).append(key)
        parts: list[list[str]] = []
        for keys in together.values():
            members = sum(len(new[key].cases) for key in keys)
            count = min(max(1, members // _PART), self._there.count, len(keys))
            parts += [keys[part::count] for part in range(count)]
        return parts


def run_jobs(jobs: Sequence[Job]) -> list[Failure | None]:
    """Tries one wall of each job in all its cases, with loops that are equally slow.

    A wall that fails is removed from the arrays with all its cases.
    """
    slow = slowness(jobs[0].loop)
    made: dict[tuple[int, Case], Scene] = {}
    members = [(index, place) for index, job in enumerate(jobs) for place in range(len(job.cases))]
    scenes: list[Scene] = []
    for index, place in members:
        job = jobs[index]
        [wall], case = job.walls, job.cases[place]
        if (id(job.loop), case) not in made:
            made[id(job.loop), case] = case.scene(job.loop, slow)
        held = Wall(position=0.0, stiffness=float(wall.stiffness_N_m))
        seed = job.loop.seed + place
        scenes.append(replace(made[id(job.loop), case], seed=seed, wall=held, dissipation=wall.elements))
    failed: dict[int, Failure] = {}
    touched: set[int] = set()
    felt = {id(job.loop): job.loop for job in jobs}
    thresholds = {of: felt_force_N(loop) for of, loop in felt.items()}
    for group, loops in make_loops(scenes, installed_kinds()):
        _watch(jobs, loops, [members[index] for index in group], failed, touched, thresholds)
    from_s = FROM_S * slow
    untold = Failure(_NO_CONTACT.format(from_s), from_s, gone=False)
    return [failed.get(index, None if index in touched else untold) for index in range(len(jobs))]


def _watch(
    jobs: Sequence[Job], loops: Loops | LoneLoop, members: list[tuple[int, int]], failed: dict[int, Failure],
    touched: set[int], thresholds: Mapping[int, Threshold],
) -> None:  # fmt: skip
    """Follows loops to their end, or until every wall among them has failed; notes failed walls and touched ones."""
    rate, late = jobs[0].loop.clock.control_rate, slowness(jobs[0].loop)

    def felt_N(frequency_Hz: np.ndarray) -> np.ndarray:
        of_loop = np.array([id(jobs[index].loop) for index, _ in members])
        found = np.empty(len(members))
        for loop, threshold in thresholds.items():
            found[of_loop == loop] = threshold(frequency_Hz[of_loop == loop])
        return found

    usual, first = round(LASTS_S / STRETCH_S), round(FROM_S / STRETCH_S)
    before = np.full(len(members), math.inf)
    past, width_m = np.zeros((_TOGETHER, _KEPT, len(members))), np.zeros(len(members))
    for stretch in range(_LONGER * usual):
        kept = np.array([wall not in failed for wall, _ in members])
        kept &= (before > 0.0) | (stretch < usual) | (width_m > _SLOW_M)
        if not kept.any():
            return
        if not kept.all():
            loops.select(kept)
            members = [member for member, stays in zip(members, kept, strict=True) if stays]
            before, past, width_m = before[kept], past[..., kept], width_m[kept]
        try:
            seen = loops.go_on(round(STRETCH_S * late * rate))
        except (ArithmeticError, ElementError):
            failed.update((wall, _failure(jobs[wall].cases[case], 0.0, True, None, 0)) for wall, case in members)
            return
        bad, found, is_last = seen.gone, None, stretch == _LONGER * usual - 1
        past = np.roll(past, -1, axis=0)
        past[-1] = seen.x[np.linspace(0, len(seen.x) - 1, _KEPT).astype(int)]
        if stretch >= usual - 1:
            width_m = slow_swing_m(past.reshape(-1, len(members)))
        if stretch >= first:
            touched.update(members[place][0] for place in np.flatnonzero((seen.command != 0.0).any(axis=0)))
        if stretch >= first and not bad.all():
            found = buzz(seen.x, seen.measured, seen.command, rate, felt_N)
            felt = found.times_felt >= 1.0
            bad = bad | (felt & ((found.times_felt > _DYING * before) | is_last))
            before = np.where(felt, found.times_felt, 0.0)
        swings = ~bad & is_last & (width_m > _SLOW_M)
        for place in np.flatnonzero(bad | swings).tolist():
            wall, case = members[place]
            failure = _failure(jobs[wall].cases[case], (stretch + 1) * STRETCH_S * late, seen.gone[place], found, place)
            failure = replace(failure, within_s=STRETCH_S * late)
            if swings[place]:
                wide_m = float(width_m[place])
                failure = replace(failure, motion_m=wide_m, frequency_Hz=0.0, times_felt=wide_m / _SLOW_M)
            worst = failed.setdefault(wall, failure)
            if worst.at_s == failure.at_s and worst.times_felt < failure.times_felt:
                failed[wall] = failure


def _failure(case: Case, at_s: float, gone: bool, found: Buzz | None, place: int) -> Failure:
    if gone or found is None:
        return Failure(case.words, at_s, gone=True, tried=case)
    motion_m, force_N, frequency_Hz, times_felt = (float(column[place]) for column in found[1:5])
    by_force = bool(found.by_force[place])
    other_felt, is_line, turns = float(found.other_felt[place]), bool(found.is_line[place]), int(found.turns[place])
    numbers = motion_m, force_N, frequency_Hz, times_felt, by_force
    return Failure(case.words, at_s, False, *numbers, case, other_felt, is_line, turns)
