"""Scenes of the paper's figures that are runs of the program."""

from __future__ import annotations

import copy
from functools import cache
from typing import Any

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.logger.log.memory import MemoryLog
from haploop.logger.log.recording import Recording
from haploop.tools.cost.grid import scenes_folder

SPEED_M_S = 0.1


@cache
def _resolved(name: str) -> dict[str, Any]:
    return load(scenes_folder() / name)


def fig6(panel: str) -> dict[str, Any]:
    """The resolved scene of a panel of Fig. 6, "a", "b" or "c", in our base reading. Not to be changed: copy it."""
    return _resolved(f"fig6{panel}.toml")


def single_contact(title: str, **tables: Any) -> dict[str, Any]:
    """The paper's device, hand attached but slack, coasts at 0.1 m/s into the 0.15 N/mm wall and out again.

    Without encoder and delay unless ``tables``, laid over the scene, say so.
    """
    scene = copy.deepcopy(fig6("b"))
    for table in ("encoder", "noise", "dissipation", "velocity", "acceleration"):
        scene.pop(table, None)
    position = scene["wall"]["position"]
    scene["title"], scene["duration"] = title, 0.1
    scene["clock"] |= {"round_trip_delay": tables.pop("delay_s", 0.0)}
    scene["device"] |= {"position": position + 0.0004, "velocity": -SPEED_M_S, "damping": 0.0}
    scene["hand"] = {**scene["hand"], "stiffness": 0.0, "damping": 0.0}
    scene["hand"].pop("force")
    return scene | tables


def pushed_and_braked(**tables: Any) -> dict[str, Any]:
    """The paper's device and hand in the open, pushed for 24 ms and braked for as long; no spring, no damping."""
    scene = single_contact("Pushed, then braked")
    scene.pop("wall")
    scene["duration"] = 0.06
    scene["device"] |= {"position": 0.0, "velocity": 0.0}
    scene["hand"]["force"] = {
        "kind": "trace",
        "time": [0.0, 0.012, 0.024, 0.036, 0.048],
        "force": [0.0, 0.25, 0.0, -0.25, 0.0],
    }
    return scene | tables


def run(scene: dict[str, Any]) -> tuple[dict[str, Any], Recording]:
    """Run a resolved scene in this process; its summary, and its log by channel."""
    memory = MemoryLog()
    summary = run_in_process(scene, registry(), memory=memory)
    return summary, memory.recording()
