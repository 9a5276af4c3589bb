"""Runs for tests of figures."""

from __future__ import annotations

from pathlib import Path

from haploop.launch.runs.start import prepare, run

SCENES = Path(__file__).parents[3] / "launch/scenes"
NO_WALL = """
title = "no wall"
duration = 0.3
[device]
mass = 0.1
damping = 0.5
velocity = 0.1
[[dissipation]]
kind = "damping"
damping = 1.0
acts = "always"
"""
# Two elements that move to other places, settings, and swaps back and forth.
BUSY = f"""
extends = "{SCENES.as_posix()}/fig6b.toml"
duration = 1.5
event = [
  {{ at = 0.95, element = 1, swap = {{ kind = "unidirectional-inertia", mass = 0.002 }} }},
  {{ at = 1.0, set = {{ "wall.stiffness" = 120.0, "wall.position" = -0.0601 }} }},
  {{ at = 1.1, element = 0, swap = {{ kind = "none" }} }},
  {{ at = 1.2, set = {{ "dissipation.0.mass" = 0.004 }} }},
  {{ at = 1.3, element = 1, swap = {{ kind = "damping", damping = 0.5 }} }},
]
"""


def made(directory: Path, name: str, *overrides: str) -> Path:
    """A run of a scene that comes with haploop, or of a TOML text."""
    path = SCENES / f"{name}.toml"
    if "\n" in name:
        path = directory.parent / f"{directory.name}.toml"
        path.write_text(name, encoding="utf-8")
    run(prepare(path, overrides, out=directory), in_process=True)
    return directory
