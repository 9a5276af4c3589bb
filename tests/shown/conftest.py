"""Runs that figures are drawn of, made once for all tests of a worker."""

from __future__ import annotations

from pathlib import Path

import pytest

from helpers.runs.drawn import BUSY, NO_WALL, made


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    base = tmp_path_factory.mktemp("runs")
    return {
        "swap": made(base / "swap", "swap"),
        "tap": made(base / "tap", "tap"),
        "busy": made(base / "busy", BUSY),
        "no-wall": made(base / "no-wall", NO_WALL),
        "diverged": made(base / "diverged", "fig6b", "wall.stiffness=50000"),
        "no-hand": made(base / "no-hand", NO_WALL, "wall.position=0.005", "wall.stiffness=500", "wall.occupies=above"),
        "ticks": made(base / "ticks", "fig6c", 'run.log="ticks"', "duration=1.2"),
        "never-there": made(base / "never-there", "fig6c", "duration=0.2"),
    }
