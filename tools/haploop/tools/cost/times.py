"""Times of a simulated tick: warm, interleaved in random order, repeated, with the garbage collector off.

A round times every candidate once, in an order drawn anew for each round from a fixed seed: what drifts or disturbs
meets all of them alike. Each time is stored at once, so that a command that was stopped goes on where it was.
"""

from __future__ import annotations

import gc
import json
import os
import random
import statistics
import tempfile
import time
import warnings
from collections import deque
from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self, TypeVar

import numpy as np

from haploop.controller.dissipation import ElementError, registry
from haploop.launch.runs.in_process import Loop
from haploop.launch.runs.start import prepare, run
from haploop.launch.scene.events import scene_events
from haploop.launch.spec import RunFailed
from haploop.logger.session import open_session
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.tools.cost.data import Load, Spread
from haploop.tools.render.progress import Stage

T = TypeVar("T")
IN_PROCESS, PROCESSES = "us in one process", "us as processes"
_SEED = 20_220_711
_QUIET = "quiet for "
_STEPS = 100_000


class Store:
    """DIR/points.jsonl: records by (what, key, repeat), a line each, only appended; a context manager.

    A line that was cut off when the program was killed is passed over: its record is measured again.
    """

    def __init__(self, directory: Path) -> None:
        self._path = directory / "points.jsonl"
        self._records: dict[tuple[str, str, int], Any] = {}

    def __enter__(self) -> Self:
        text = self._path.read_text(encoding="utf-8") if self._path.exists() else ""
        for line in text.splitlines():
            try:
                record = json.loads(line)
                self._records[record["what"], record["key"], record["repeat"]] = record["value"]
            except (ValueError, LookupError, TypeError):
                continue
        self._file = self._path.open("a", encoding="utf-8")
        if text and not text.endswith("\n"):
            self._file.write("\n")
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def add(self, what: str, key: str, value: Any, repeat: int = 0) -> None:
        """Keeps a record, on disk at once."""
        self._records[what, key, repeat] = value
        record = {"what": what, "key": key, "repeat": repeat, "value": value}
        self._file.write(json.dumps(record) + "\n")
        self._file.flush()

    def get(self, what: str, key: str) -> Any:
        return self._records.get((what, key, 0))

    def has(self, what: str, key: str, repeat: int = 0) -> bool:
        return (what, key, repeat) in self._records

    def all(self, what: str, key: str, repeats: int) -> list[Any]:
        """Returns the records of the first ``repeats`` repeats, as far as there are any."""
        return [self._records[what, key, i] for i in range(repeats) if (what, key, i) in self._records]


@dataclass(frozen=True)
class Job:
    """A resolved scene and a way to time its run, ``IN_PROCESS`` or ``PROCESSES``.

    Of the jobs of one ``family`` one, run untimed beforehand, warms up all. ``key`` is its name in the store. ``clock``
    runs it once and returns the time of a tick, µs; None where the run failed.
    """

    way: str
    family: Hashable
    key: str
    scene: Scene
    clock: Callable[[], float | None]


def loop_us(scene: Scene) -> float | None:
    """Returns the time of a tick in this process, with books, without log, µs; None where the run could not go on.

    Building plant and controller is not counted. A method that blows up overflows: the caller keeps its warnings back.
    """
    base = Timebase.from_scene(scene)
    session = open_session(scene, base, None, {})
    loop = Loop(scene, base, registry(), session)
    loop.schedule(scene_events(scene, base))
    try:
        return tick_us(loop.block, lambda: session.logger.tick)
    except (ElementError, ArithmeticError):
        return None


def tick_us(block: Callable[[], bool], tick: Callable[[], int]) -> float | None:
    """Returns the time of a tick of a loop, µs; None where there was none. ``block`` is False when the run has ended.

    The first block, which makes what later ones only use, is not counted; a run of a single block is counted whole.
    """
    took_s, goes_on = timed(block)
    ticks = tick()
    if goes_on:
        took_s, _ = timed(lambda: deque(iter(block, False), maxlen=0))
        ticks = tick() - ticks
    return took_s / ticks * 1e6 if ticks else None


def timed(work: Callable[[], T]) -> tuple[float, T]:
    """Returns how long some work takes, s, with the garbage collector off, and its result."""
    gc.collect()
    gc.disable()
    try:
        began = time.perf_counter()
        result = work()
        return time.perf_counter() - began, result
    finally:
        gc.enable()


def run_us(path: Path, overrides: Sequence[str], ticks: int) -> float | None:
    """Returns the time of a tick as processes, starting up not included, µs; None where the run failed.

    Raises KeyboardInterrupt where a signal ended it.
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
    return sum(not store.has(job.way, job.key, repeat) for job in jobs for repeat in range(repeats))


def measure(store: Store, jobs: Sequence[Job], repeats: int, name: str, stage: Stage) -> None:
    """Makes every measurement of jobs of one way that is missing; where there are any, they are a stage of this name.

    With each goes into the store the load of the machine in its round.
    """
    if not (count := missing(store, jobs, repeats)):
        return
    way, advance = jobs[0].way, stage(name, count)
    with _still():
        if way == IN_PROCESS:
            _warm(store, jobs, repeats)
        for repeat in range(repeats):
            seen = _observe_machine(alone=way == IN_PROCESS)
            for job in random.Random(_SEED + repeat).sample(jobs, len(jobs)):
                if not store.has(way, job.key, repeat):
                    took = job.clock()
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
        job.clock()


def quiet(store: Store, jobs: Sequence[Job], repeats: int) -> Load | None:
    """Returns the load of the machine in the rounds of these jobs; None where nothing was measured."""
    seen = [one for job in jobs for one in store.all(_QUIET + job.way, job.key, repeats)]
    if not seen:
        return None
    loops = Spread.from_values([one["loop_s"] for one in seen])
    loads = [one["load"] for one in seen if one["load"] is not None]
    return Load(statistics.median(loads) if loads else None, (loops.q3 - loops.q1) / loops.median)


def _observe_machine(alone: bool) -> dict[str, float | None]:
    """Returns the time of a fixed calibration loop, s, and the load average, None where it cannot be known.

    The load average counts processes that run or wait for a core: it tells something only where this one is alone.
    """
    value = 1.0
    began = time.perf_counter()
    for _ in range(_STEPS):
        value = 0.5 * value + 0.25
    took_s = time.perf_counter() - began
    return {"loop_s": took_s, "load": os.getloadavg()[0] if alone and hasattr(os, "getloadavg") else None}
