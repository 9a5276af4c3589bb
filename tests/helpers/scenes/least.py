"""Scenes made in the tests: a least scene, and ways to read one from text or from tables."""

from pathlib import Path
from typing import Any

from haploop.controller.dissipation import registry
from haploop.launch.scene.check import resolve
from haploop.launch.scene.file import load
from haploop.launch.scene.mistakes import SceneError
from haploop.launch.scene.reading.layers import Layers
from haploop.protocol.scene.scene import Scene

KINDS = registry()
LEAST: dict[str, Any] = {"title": "least", "duration": 1.0, "device": {"mass": 0.01, "damping": 0.1}}
WALL = {"position": -0.06, "stiffness": 150.0}
# A device that a hand presses into a wall, with a delay: tables for ``scene``.
PRESSED: dict[str, Any] = {
    "duration": 0.3,
    "seed": 5,
    "device": {"mass": 0.01, "damping": 0.1, "velocity": -0.05},
    "hand": {"mass": 0.01, "stiffness": 10.0, "force": {"kind": "constant", "value": -0.5}},
    "wall": {**WALL, "position": -1e-3},
    "clock": {"round_trip_delay": 0.0013},
}
# A device in the hand that is pressed onto a wall at 0, without a delay.
HELD: dict[str, Any] = {
    "device": {"mass": 0.05, "damping": 0.1, "position": 0.001},
    "wall": {"position": 0.0, "stiffness": 500.0},
    "hand": {"force": {"kind": "constant", "value": -0.5}},
}


def scene(**tables: Any) -> Scene:
    """The least scene with these tables, resolved; judged the cheap way unless its tables say how."""
    given = tables.get("run", {})
    if isinstance(given, dict):
        tables = {**tables, "run": {"verdict": "window", **given}}
    return resolve(Layers(Path("scene.toml"), {**LEAST, **tables}), KINDS)


def typed(**tables: Any) -> Scene:
    """The least scene with these tables as they are, arrays of a batch among them."""
    return Scene.from_dict({**LEAST, **tables})


def mistakes(**tables: Any) -> list[str]:
    """Returns the mistakes of the least scene with these tables, without the name of the file."""
    try:
        scene(**tables)
    except SceneError as error:
        return [str(mistake).removeprefix("scene.toml: ") for mistake in error.mistakes]
    return []


def file_mistakes(path: Path, *overrides: str) -> list[str]:
    """Returns the mistakes of a scene file."""
    try:
        load(path, overrides)
    except SceneError as error:
        return str(error).splitlines()
    return []


LEAST_TOML = "duration = 1.0\n[device]\nmass = 0.01\ndamping = 0.1\n"
