"""The undisturbed run: the same scene and events in one process, without sockets; whatever went on must equal it."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
from simulation.scenes import scene_of

import haploop.logger
from haploop.launch.runs.in_process import run_in_process
from haploop.logger.log.recording import MemoryLog, Recording
from haploop.protocol.changes import Event, is_change
from helpers.scenes.least import KINDS


@lru_cache(maxsize=256)
def _undisturbed(name: str, packed: bytes) -> tuple[dict[str, Any], Recording]:
    memory = MemoryLog()
    events = [(tick, event) for tick, event in msgpack.unpackb(packed)]
    return run_in_process(scene_of(name), dict(KINDS), events=events, memory=memory), memory.recording()


def logged_ticks(log: Path) -> int:
    """Number of whole ticks in a log."""
    recording = haploop.logger.read(log)
    return len(recording["/controller"]["x"]) if "/controller" in recording else 0


def difference(
    name: str, events: list[tuple[int, Event]], summary: dict[str, Any] | None, log: Path | None, granted: int
) -> list[str]:
    """Returns in what a run differs from the undisturbed one with the same events: its result, and its log if given.

    Args:
        summary: None for a run that failed, whose log holds the beginning of it.
        granted: the last tick that it was allowed to work on is the one before.
    """
    told = [(tick, event) for tick, event in events if is_change(event) or event.get("stop")]
    if summary is None:
        told = [(tick, event) for tick, event in told if not event.get("stop")]
    undisturbed, recording = _undisturbed(name, msgpack.packb(told))
    if summary is not None:
        for key in ("trajectory_sha256", "ticks", "ended"):
            if summary[key] != undisturbed[key]:
                return [f"{key} is {summary[key]}, that of the undisturbed run {undisturbed[key]}"]
    if log is None or not log.exists() or (summary is None and not log.stat().st_size):
        return [] if summary is None or log is None else ["there is no log"]
    kept = haploop.logger.read(log)
    if summary is not None and kept.truncated:
        return [f"the log of a run that ended in order is cut: {kept.cut}"]
    for topic in ("/plant", "/controller"):
        for column, values in kept.get(topic, {}).items():
            if summary is None:
                values = values[:-1]  # the last row of a log that was cut knows only what was held before it
            expected = recording[topic][column][: len(values)]
            if not np.array_equal(values, expected, equal_nan=True):
                return [f"{topic} {column} of the log is not that of the undisturbed run"]
    ticks = len(kept["/controller"]["x"]) if "/controller" in kept else 0
    if ticks > granted:
        return [f"the log holds {ticks} ticks, of which {granted} were granted"]
    if summary is not None and ticks != summary["ticks"]:
        return [f"the log holds {ticks} ticks of {summary['ticks']}"]
    return []
