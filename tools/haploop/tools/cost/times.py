"""Times of a simulated tick over that of a yardstick: warm, in random order, repeated, without garbage collection.

A round times every candidate once, in an order drawn for each round from a fixed seed, and the yardstick before and
after it: drift and disturbances affect all of them alike. In one process, processor time is measured, which stands
still while another program has the processor. Each ratio is stored at once, so that a stopped command can continue.
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
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from haploop.controller.dissipation import ElementError, registry
from haploop.launch.runs.in_process import Loop
from haploop.launch.runs.start import prepare, run
from haploop.launch.scene.bundled import bundled_folder
from haploop.launch.scene.events import scene_events
from haploop.launch.scene.file import load
from haploop.launch.spec import RunFailed
from haploop.logger.books import segments
from haploop.logger.session import open_session
from haploop.plant.chain import motion as chain_motion
from haploop.plant.friction import motion, projected
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.tools.cost.data import Load
from haploop.tools.render.progress import Stage

T = TypeVar("T")
IN_PROCESS, PROCESSES = "in one process", "as processes"
YARDSTICK = (
    "a tick of fig6a.toml without delay in one process: one mass, a wall, the exact flow at 10 kHz, all energy books"
)
_SEED = 20_220_711
_QUIET = "quiet for "
_YARDSTICK_S = 1.5


class Store:
    """DIR/points.jsonl: records by (what, key, repeat), a line each, only appended.

    A line that was cut off when the program was killed is skipped: its record is measured again.
    """

    def __init__(self, directory: Path) -> None:
        self._path = directory / "points.jsonl"
        self._records: dict[tuple[str, str, int], Any] = {}
        text = self._path.read_text(encoding="utf-8") if self._path.exists() else ""
        for line in text.splitlines():
            with suppress(ValueError, LookupError, TypeError):
                record = json.loads(line)
                self._records[record["what"], record["key"], record["repeat"]] = record["value"]
        if text and not text.endswith("\n"):
            self._append("\n")

    def add(self, what: str, key: str, value: Any, repeat: int = 0) -> None:
        """Keeps a record, on disk at once."""
        self._records[what, key, repeat] = value
        self._append(json.dumps({"what": what, "key": key, "repeat": repeat, "value": value}) + "\n")

    def _append(self, text: str) -> None:
        with self._path.open("a", encoding="utf-8") as file:
            file.write(text)

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

    One job of a ``family``, run untimed beforehand, warms up all of it. ``key`` is its name in the store. ``clock``
    runs it once and returns the time of a tick, µs; None where the run failed. ``is_compiled``: with loops of machine
    code, as in a long run in one process; a short one, and a node, do without.
    """

    way: str
    family: Hashable
    key: str
    scene: Scene
    clock: Callable[[], float | None]
    is_compiled: bool = False

    def timed(self) -> float | None:
        """Returns the time of a tick, µs; None where the run failed."""
        _have_machine_code(self.is_compiled)
        try:
            return self.clock()
        finally:
            _have_machine_code(False)


def _have_machine_code(is_compiled: bool) -> None:
    """Makes the next run in this process use loops of machine code from its start, or none of them."""
    for loops in (chain_motion.LOOPS, motion.LOOPS, projected.LOOPS, segments.LOOPS):
        loops.asked = int(loops.pays) if is_compiled else 0


def loop_us(scene: Scene) -> float | None:
    """Returns the time of a tick in this process, with books, without log, µs; None where the run could not go on.

    Building plant and controller is not counted. A method that blows up overflows: the caller silences its warnings.
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

    The first block, which builds what later ones only use, is not counted; a run of a single block is counted whole.
    """
    took_s, goes_on = timed(block)
    ticks = tick()
    if goes_on:
        took_s, _ = timed(lambda: deque(iter(block, False), maxlen=0))
        ticks = tick() - ticks
    return took_s / ticks * 1e6 if ticks else None


def timed(work: Callable[[], T]) -> tuple[float, T]:
    """Returns the processor time of some work, s, with the garbage collector off, and its result."""
    gc.collect()
    gc.disable()
    try:
        began = time.process_time()
        result = work()
        return time.process_time() - began, result
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
    """Makes every missing measurement of jobs of one way, as a stage of this name if there are any.

    Each ratio is stored together with the yardstick's time around it, µs, and the load of the machine.
    """
    if not (count := missing(store, jobs, repeats)):
        return
    way, advance = jobs[0].way, stage(name, count)
    plain = yardstick()
    with _still():
        if way == IN_PROCESS:
            _warm(store, jobs, repeats)
        loop_us(plain)
        for repeat in range(repeats):
            before = loop_us(plain)
            for job in random.Random(_SEED + repeat).sample(jobs, len(jobs)):
                if not store.has(way, job.key, repeat):
                    took, after = job.timed(), loop_us(plain)
                    assert before
                    assert after
                    mean = (before + after) / 2.0
                    # How many processes ran or waited for a core in the last minute, where that can be known.
                    is_known = way == IN_PROCESS and hasattr(os, "getloadavg")
                    seen = {"yardstick_us": mean, "load": os.getloadavg()[0] if is_known else None}
                    store.add(_QUIET + way, job.key, seen, repeat)
                    store.add(way, job.key, took and took / mean, repeat)
                    before = after
                    advance()


def yardstick() -> Scene:
    overrides = [f"duration={_YARDSTICK_S}", "diverged_beyond=1e9", "clock.round_trip_delay=0.0", "run.log=none"]
    return load(bundled_folder("scenes") / "fig6a.toml", overrides)


@contextmanager
def _still() -> Iterator[None]:
    """Keeps the garbage collector away from what is alive now, and silences the warnings of runs that blow up."""
    gc.collect()
    gc.freeze()
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore", RuntimeWarning)
            yield
    finally:
        gc.unfreeze()


def _warm(store: Store, jobs: Sequence[Job], repeats: int) -> None:
    """Runs the first of every family once untimed: imports, first calls, the interpreter's adaptive code."""
    for job in {job.family: job for job in reversed(jobs) if missing(store, [job], repeats)}.values():
        job.timed()


def quiet(store: Store, jobs: Sequence[Job], repeats: int) -> Load | None:
    """Returns the yardstick and the load of the machine around these jobs; None where nothing was measured."""
    seen = [one for job in jobs for one in store.all(_QUIET + job.way, job.key, repeats)]
    if len(seen) < 2:
        return None
    q1, median, q3 = statistics.quantiles([one["yardstick_us"] for one in seen], n=4, method="inclusive")
    loads = [one["load"] for one in seen if one["load"] is not None]
    return Load(median, (q3 - q1) / median, statistics.median(loads) if loads else None)
