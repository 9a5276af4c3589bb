"""Short scenes that differ in what the processes have to say to each other."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from haploop.protocol.scene.scene import Scene
from helpers.scenes.least import scene

_DEVICE = {"mass": 0.01, "damping": 0.1, "velocity": -0.8}
_WALL = {"position": -0.01, "stiffness": 400.0}
_DAMPING = {"kind": "damping", "damping": 0.4}
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


@lru_cache
def scene_of(name: str) -> Scene:
    """The resolved scene of a name."""
    return scene(duration=0.07, device=_DEVICE, **_TABLES[name])
