"""One history: played in a directory of its own, and what came of it."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
import traceback
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from haploop.launch.clock import plugin_swap
from simulation.plan import Plan
from simulation.plugins import SimTrial
from simulation.sim import Sim


@dataclass
class Outcome:
    """What came of a plan: the broken promise, "" for none, the last of the history, how it ended, and its faults."""

    broken: str
    history: list[tuple[float, str]] = field(default_factory=list)
    how: str = ""
    kinds: list[str] = field(default_factory=list)


@contextlib.contextmanager
def _seen_through(sim: Sim) -> Iterator[None]:
    """Takes note of what a node would print as a traceback, and lets processes meet between two looks at the disk."""
    kept, kept_iterdir = traceback.print_exc, Path.iterdir

    def iterdir(path: Path) -> Iterator[Path]:
        found = list(kept_iterdir(path))
        if path == sim.out and sim.world.running:
            sim.world.running.may_lose_the_processor()
        return iter(found)

    def note(*_: Any, **__: Any) -> None:
        sim.watch.fail("a traceback was printed:\n" + traceback.format_exc())

    traceback.print_exc, Path.iterdir = note, iterdir  # pyright: ignore[reportAttributeAccessIssue]
    kept_trial, plugin_swap.PluginTrial = plugin_swap.PluginTrial, partial(SimTrial, sim)  # pyright: ignore
    try:
        yield
    finally:
        plugin_swap.PluginTrial = kept_trial
        traceback.print_exc, Path.iterdir = kept, kept_iterdir  # pyright: ignore[reportAttributeAccessIssue]


def play(plan: Plan, reads_log: bool = True) -> Outcome:
    """Plays a plan in a directory of its own, which is removed."""
    directory = Path(tempfile.mkdtemp(prefix="sim-", dir="/dev/shm" if Path("/dev/shm").is_dir() else None))
    try:
        sim = Sim(plan, directory)
        with _seen_through(sim):
            sim.play()
        broken = sim.judge(reads_log)
        sim.world.clear_away()
        error = sim.run.launcher.error
        how = type(error).__name__ if error else "in order" if sim.was_in_order else "launcher killed"
        return Outcome(broken, list(sim.world.history), how, [type(fault).__name__ for fault in sim.happened])
    finally:
        shutil.rmtree(directory)
