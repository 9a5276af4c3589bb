"""Times of a simulated tick: warm, interleaved in random order, repeated, with the garbage collector off.

A round times every candidate once, in an order drawn anew for each round from a fixed seed: what drifts or disturbs
meets all of them alike. Each time is stored at once, so a round that was stopped goes on where it was.
"""

from __future__ import annotations

import gc
import os
import random
import statistics
import tempfile
import time
import warnings
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from haploop.controller.dissipation import ElementError, registry
from haploop.launch.runs.in_process import Loop, scene_events
from haploop.launch.runs.start import prepare, run
from haploop.launch.spec import RunFailed
from haploop.logger.session import open_session
from haploop.protocol.ticks import Timebase
from haploop.tools.cost.data import Load
from haploop.tools.cost.grid import Candidate
from haploop.tools.cost.store import Store

IN_PROCESS, PROCESSES = "us in one process", "us as processes"
_SEED = 20_220_711
# Far enough for some ticks more, near enough for squares to stay finite.
_FAR_M = 1e40
# Shorter blocks cost more than what is in them.
_LEAST_BLOCK = 20
_QUIET = "quiet for "
_STEPS = 100_000


@dataclass(frozen=True)
class Job:
    """A scene and a way to time its run.

    Attributes:
        way: ``IN_PROCESS`` or ``PROCESSES``.
        family: jobs of which one, run untimed beforehand, warms up all.
        key: its name in the store.
        scene: resolved.
        clock: runs it once and returns the time of a tick, µs; None where the run failed.
    """

    way: str
    family: Hashable
    key: str
    scene: dict[str, Any]
    clock: Callable[[], float | None]


def in_process_job(candidate: Candidate, key: str, ticks: int, diverges: bool) -> Job:
    """Makes a job of a candidate in this process.

    A run that diverges has but a few ticks: it is let go on far beyond where it is stopped otherwise, in blocks so
    short that there is more than the first one where it can be.
    """
    assert candidate.scene is not None
    scene = candidate.scene
    if diverges:
        short = {**scene["run"], "block_ticks": max(_LEAST_BLOCK, ticks // 2)}
        scene = {**scene, "diverged_beyond": _FAR_M, "run": short}
    return Job(IN_PROCESS, (candidate.path, candidate.method), key, scene, lambda: loop_us(scene))


def processes_job(candidate: Candidate, key: str, ticks: int) -> Job:
    """Makes a job of a candidate as processes, every plant step logged."""
    assert candidate.scene is not None
    overrides = [*candidate.overrides, "run.log=steps"]
    return Job(PROCESSES, "", key, candidate.scene, lambda: run_us(candidate.path, overrides, ticks))


def loop_us(scene: dict[str, Any]) -> float | None:
    """Returns the time of a tick in this process, with books, without log, µs; None where the run could not go on.

    Neither building plant and controller nor the first block is counted, which makes what later ones only use; a run of
    a single block is counted whole. A method that blows up overflows: its warnings are kept back by the caller.
    """
    base = Timebase.from_scene(scene)
    session = open_session(scene, base, None, {})
    loop = Loop(scene, base, registry(), session)
    loop.schedule(scene_events(scene, base))
    going: list[bool] = []
    try:
        took_s = timed_s(lambda: going.append(loop.block()))
        first = ticks = session.logger.tick
        if going[0]:
            took_s = timed_s(lambda: _finish(loop))
            ticks = session.logger.tick - first
    except (ElementError, ArithmeticError):
        return None
    return took_s / ticks * 1e6 if ticks else None


def _finish(loop: Loop) -> None:
    while loop.block():
        pass


def timed_s(work: Callable[[], object]) -> float:
    """Returns how long some work takes, s, with the garbage collector off."""
    gc.collect()
    gc.disable()
    try:
        began = time.perf_counter()
        work()
        return time.perf_counter() - began
    finally:
        gc.enable()


def run_us(path: Path, overrides: Sequence[str], ticks: int) -> float | None:
    """Returns the time of a tick as processes, starting up not included, µs; None where the run failed.

    Raises:
        KeyboardInterrupt: a signal ended the run.
    """
    with tempfile.TemporaryDirectory() as folder:
        try:
            summary = run(prepare(path, overrides, out=Path(folder, "out")))
        except RunFailed:
            return None
    if summary["ticks"] < ticks:
        raise KeyboardInterrupt
    return summary["wall_s"] / summary["ticks"] * 1e6


def missing(store: Store, jobs: Sequence[Job], repeats: int) -> int:
    """Returns how many measurements are still to be made."""
    return sum(not store.has(job.way, job.key, repeat) for job in jobs for repeat in range(repeats))


def time_job(job: Job) -> float | None:
    """Runs a job once and returns the time of a tick, µs; None where the run failed."""
    return job.clock()


def measure(store: Store, jobs: Sequence[Job], repeats: int, advance: Callable[[], None]) -> None:
    """Makes every measurement of jobs of one way that is missing; ``advance`` is called after each.

    With each goes into the store the load of the machine in its round.
    """
    if not missing(store, jobs, repeats):
        return
    way = jobs[0].way
    with _still():
        if way == IN_PROCESS:
            _warm(store, jobs, repeats)
        for repeat in range(repeats):
            seen = observe_machine(alone=way == IN_PROCESS)
            for job in random.Random(_SEED + repeat).sample(jobs, len(jobs)):
                if not store.has(way, job.key, repeat):
                    took = time_job(job)
                    store.add(_QUIET + way, job.key, seen, repeat)
                    store.add(way, job.key, took, repeat)
                    advance()


@contextmanager
def _still() -> Iterator[None]:
    """Keeps the garbage collector off what is alive now, and silences the warnings of runs that blow up."""
    gc.collect()
    gc.freeze()
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore", RuntimeWarning)
            yield
    finally:
        gc.unfreeze()


def _warm(store: Store, jobs: Sequence[Job], repeats: int) -> None:
    """Runs one of every family once untimed: imports, first calls, the interpreter's adaptive code."""
    for job in {job.family: job for job in jobs if missing(store, [job], repeats)}.values():
        time_job(job)


def quiet(store: Store, jobs: Sequence[Job], repeats: int) -> Load | None:
    """Returns the load of the machine in the rounds of these jobs; None where nothing was measured."""
    return machine_load(seen for job in jobs for seen in store.all(_QUIET + job.way, job.key, repeats))


def observe_machine(alone: bool) -> dict[str, Any]:
    """Returns the time of a fixed calibration loop, s, and the load average.

    Args:
        alone: this process is all that should run; otherwise the load average tells nothing.
    """
    return {"loop_s": _loop_s(), "load": _load_average() if alone else None}


def _loop_s() -> float:
    value = 1.0
    began = time.perf_counter()
    for _ in range(_STEPS):
        value = 0.5 * value + 0.25
    return time.perf_counter() - began


def _load_average() -> float | None:
    """Returns the processes running or waiting for a core in the last minute, where the system tells."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def machine_load(observations: Iterable[dict[str, Any]]) -> Load | None:
    """Returns the load that several observations come to; None for none."""
    seen = list(observations)
    if not seen:
        return None
    loops = [one["loop_s"] for one in seen]
    loads = [one["load"] for one in seen if one["load"] is not None]
    q1, middle, q3 = statistics.quantiles(loops, n=4, method="inclusive") if len(loops) > 1 else loops * 3
    return Load(statistics.median(loads) if loads else None, (q3 - q1) / middle)
