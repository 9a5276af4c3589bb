"""Sweep files over a short press into a wall, and their results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from haploop.launch.scene.mistakes import SceneError
from haploop.tools.sweep.cells import Sweep
from haploop.tools.sweep.command import Request, sweep
from haploop.tools.sweep.sweep_file import load
from haploop.tools.sweep.table import SweepTable, read

PRESS = """
duration = 0.05
seed = 7
[device]
mass = 0.01
damping = 0.1
[hand]
mass = 0.01
stiffness = 10.0
damping = 0.01
[hand.force]
kind = "ramp"
value = -0.8
rise_time = 0.02
[encoder]
resolution = 1e-5
[wall]
position = -0.001
stiffness = 150.0
[[dissipation]]
kind = "damping"
damping = 0.5
[run]
verdict = "window"
"""
GRID = """
[axes]
"wall.stiffness" = { from = 100, to = 400, step = 100 }
"dissipation.0.damping" = { from = 0.01, to = 1.0, count = 5, scale = "log" }
"""


def sweep_file(folder: Path, text: str = GRID, press: str = PRESS) -> Path:
    """A sweep file beside its scene."""
    (folder / "press.toml").write_text(press)
    path = folder / "sweep.toml"
    path.write_text(f'scene = "press.toml"\n{text}')
    return path


def loaded(folder: Path, text: str = GRID, overrides: Sequence[str] = (), press: str = PRESS) -> Sweep:
    """The sweep of such a file."""
    return load(sweep_file(folder, text, press), overrides)


def mistakes(folder: Path, text: str, overrides: Sequence[str] = ()) -> list[str]:
    """Returns the mistakes of such a file, without its name and their lines."""
    try:
        loaded(folder, text, overrides)
    except SceneError as error:
        return [
            str(replace(mistake, line=None)).removeprefix(f"{folder / 'sweep.toml'}: ") for mistake in error.mistakes
        ]
    return []


def swept(folder: Path, text: str = GRID, press: str = PRESS, **options: Any) -> SweepTable:
    """The table of such a sweep, run in this process."""
    out = options.pop("out", folder / "out")
    sweep(Request(sweep_file(folder, text, press), out=out, **{"workers": 1, **options}), as_json=False)
    return read(out)
