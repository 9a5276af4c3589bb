"""The run that the runs of these tests are compared with, and a scene with the brake of a plugin."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.logger import read
from haploop.logger.log.recording import Recording
from helpers.live.foreign import PLAIN, Started
from helpers.live.launched import SCENE, SCENES, Run


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """The log of 30 s of figure 6(c), run in one process to its end."""
    kinds = registry()
    out = tmp_path_factory.mktemp("undisturbed")
    run_in_process(load(SCENE, ["duration=30"], kinds), kinds, out=out)
    return read(out)


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(f'extends = "{SCENES / "fig6a.toml"}"\n[[dissipation]]\nkind = "brake"\nacts = "always"\n')
    return path


@pytest.fixture
def started(tmp_path: Path) -> Iterator[Started]:
    """Starts runs of figure 6(c) with the plain controller, and leaves none behind."""
    runs: list[Run] = []

    def start(*options: str, node: str | None = PLAIN, sets: tuple[str, ...] = (), **more: Any) -> Run:
        nodes = ("--node", f"controller={node}") if node else ()
        sets = ("duration=3", *sets)
        runs.append(Run(tmp_path / f"out{len(runs)}", *nodes, *options, sets=sets, **{"pace": (), **more}))
        return runs[-1]

    yield start
    for run in runs:
        run.clear_away()
