"""Runs that figures are drawn of, each made once for all tests of a worker that draw it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from haploop.launch.runs.start import prepare, run
from haploop.launch.scene.bundled import bundled
from helpers.runs.drawn import BUSY, NO_WALL, made

# Scene and settings of each.
_RUNS = {
    "swap": ("swap",),
    "tap": ("tap",),
    "busy": (BUSY,),
    "no-wall": (NO_WALL,),
    "diverged": ("fig6b", "wall.stiffness=50000"),
    "no-hand": (NO_WALL, "wall.position=0.005", "wall.stiffness=500", "wall.occupies=above"),
    "ticks": ("fig6c", 'run.log="ticks"', "duration=1.2"),
    "never-there": ("fig6c", "duration=0.2"),
}


class Runs(dict[str, Path]):
    """Directories of runs by name, each run when it is asked for first."""

    def __init__(self, base: Path) -> None:
        super().__init__()
        self._base = base

    def __missing__(self, name: str) -> Path:
        self[name] = made(self._base / name, *_RUNS[name])
        return self[name]


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return Runs(tmp_path_factory.mktemp("runs"))


@pytest.fixture(scope="session")
def swap(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The summary of a run that swaps its element."""
    return run(prepare(bundled("scenes")["swap"], out=tmp_path_factory.mktemp("run") / "swap"), in_process=True)
