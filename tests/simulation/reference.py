"""Short scenes that differ in what the processes have to say to each other, and their undisturbed runs.

The undisturbed run is that of the same scene and events in one process, without sockets; what went on must equal it.
"""

from __future__ import annotations

from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgpack
import numpy as np

import haploop.logger
from haploop.controller.dissipation.registry import load_source
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.check import resolve_event
from haploop.launch.scene.mistakes import SceneError
from haploop.logger.log.recording import MemoryLog, Recording
from haploop.protocol.changes import Event, is_change
from haploop.protocol.scene.scene import Scene
from helpers.scenes.least import KINDS, scene
from simulation.plugins import SOUND

_DEVICE = {"mass": 0.01, "damping": 0.1, "velocity": -0.8}
_WALL = {"position": -0.01, "stiffness": 400.0}
_DAMPING = {"kind": "damping", "damping": 0.4}
_KINDS = KINDS | load_source(SOUND[0], "brake.py")
DEADLINE_S = 2.0


def _run(block_ticks: int, window_blocks: int, log: str = "ticks") -> dict[str, Any]:
    return {"block_ticks": block_ticks, "window_blocks": window_blocks, "log": log, "deadline": DEADLINE_S}


_TABLES: dict[str, dict[str, Any]] = {
    "least": {"run": _run(16, 2)},
    "wall": {"wall": _WALL, "dissipation": [_DAMPING], "run": _run(10, 3, "steps")},
    "delayed": {"wall": _WALL, "dissipation": [_DAMPING], "clock": {"round_trip_delay": 0.0043}, "run": _run(7, 4)},
    "events": {
        "wall": _WALL,
        "dissipation": [_DAMPING],
        "event": [
            {"at": 0.021, "swap": {"kind": "unidirectional-damping", "damping": 0.2}, "element": 0},
            {"at": 0.033, "set": {"wall.stiffness": 300.0}},
        ],
        "run": _run(12, 2),
    },
    "diverging": {"diverged_beyond": 0.03, "run": _run(9, 2, "none")},
}
NAMES = tuple(_TABLES)


def _prepare() -> None:
    """Loads what tells mistakes, which is no work of the first command that makes one."""
    with suppress(SceneError):
        resolve_event({"swap": {"kind": ""}, "at": 0.0}, scene_of("least"), _KINDS)


@lru_cache
def scene_of(name: str) -> Scene:
    """The resolved scene of a name."""
    return scene(duration=0.07, device=_DEVICE, **_TABLES[name])


@lru_cache(maxsize=256)
def _undisturbed(name: str, packed: bytes) -> tuple[dict[str, Any], Recording]:
    memory = MemoryLog()
    events = [(tick, event) for tick, event in msgpack.unpackb(packed)]
    return run_in_process(scene_of(name), dict(_KINDS), events=events, memory=memory), memory.recording()


def logged_ticks(log: Path) -> int:
    """Number of whole ticks in a log."""
    recording = haploop.logger.read(log)
    return len(recording["/controller"]["x"]) if "/controller" in recording else 0


def _packed(events: list[tuple[int, Event]], with_stops: bool) -> bytes:
    """The events that change something, as bytes."""
    told = [(tick, event) for tick, event in events if is_change(event) or (with_stops and event.get("stop"))]
    return msgpack.packb(told) or b""


def second_difference(name: str, events: list[tuple[int, Event]], summary: dict[str, Any], log: Path) -> str:
    """In what the log of a second logger differs from the undisturbed run, from where it begins; "" in nothing."""
    if summary["lost"]["telemetry_gaps"]:
        return "a second logger has gaps"
    _, recording = _undisturbed(name, _packed(events, True))
    if not log.exists() or "/controller" not in (kept := haploop.logger.read(log)):
        return ""
    begin = kept["/controller"]["timestamp"][:1]
    first = int(np.searchsorted(recording["/controller"]["timestamp"], begin)[0]) if len(begin) else 0
    for column in ("x", "total"):
        values = kept["/controller"][column]
        if not np.array_equal(values, recording["/controller"][column][first : first + len(values)]):
            return f"{column} of a second logger, from tick {first} on, is not that of the undisturbed run"
    return ""


def difference(
    name: str, events: list[tuple[int, Event]], summary: dict[str, Any] | None, log: Path | None, granted: int
) -> list[str]:
    """Returns in what a run differs from the undisturbed one with the same events: its result, and its log if given.

    Args:
        summary: None for a run that failed, whose log holds the beginning of it.
        granted: the last tick that it was allowed to work on is the one before.
    """
    undisturbed, recording = _undisturbed(name, _packed(events, summary is not None))
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


_prepare()
