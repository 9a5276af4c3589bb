"""Short scenes, and work that separate processes can import."""

from __future__ import annotations

import os
from typing import Any

from haploop.protocol.scene.scene import Scene
from helpers.scenes.least import scene

PUSH = {"mass": 0.01, "stiffness": 10.0, "damping": 0.01, "force": {"kind": "ramp", "value": -0.8, "rise_time": 0.02}}


def pressed(stiffness: float, **tables: Any) -> Scene:
    """A short press into a wall."""
    wall = {"position": -0.001, "stiffness": stiffness}
    return scene(**{"duration": 0.05, "hand": PUSH, "encoder": {"resolution": 1e-5}, "wall": wall, **tables})


def of_stiffness(k: int) -> Scene:
    """A press by number; there is no number 2."""
    if k == 2:
        raise ValueError("no such scene")
    return pressed(100.0 + k)


def threads(*_: Any) -> str:
    """Returns the number of threads that linear algebra may use here."""
    return os.environ["OMP_NUM_THREADS"]
