"""Every test has a place of its own for live runs, so that none meets another's, nor one of the user's."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from faults.launched import SCENE, Launched, Run

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.logger import read
from haploop.logger.log.recording import Recording


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """The log of 30 s of figure 6(c), run in one process to its end."""
    kinds = registry()
    out = tmp_path_factory.mktemp("undisturbed")
    run_in_process(load(SCENE, ["duration=30"], kinds), kinds, out=out)
    return read(out)


@pytest.fixture(autouse=True)
def live_runs_here(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A short directory: the path of a socket must not be long."""
    with tempfile.TemporaryDirectory(prefix="hl", dir="/tmp") as directory:
        monkeypatch.setenv("XDG_RUNTIME_DIR", directory)
        yield Path(directory)


@pytest.fixture
def launched() -> Iterator[Callable[..., Launched]]:
    """Start haploop; whatever the test leaves running is ended."""
    started: list[Launched] = []

    def start(*arguments: Any, **options: Any) -> Launched:
        started.append(Launched(*arguments, **options))
        return started[-1]

    yield start
    for process in started:
        process.clear_away()


@pytest.fixture
def running(tmp_path: Path) -> Iterator[Callable[..., Run]]:
    """Start a run, by default a long one of figure 6(c), into a directory of its own; ended like the above."""
    started: list[Run] = []

    def start(*arguments: str, **options: Any) -> Run:
        started.append(Run(tmp_path / f"out{len(started) or ''}", *arguments, **options))
        return started[-1]

    yield start
    for run in started:
        run.clear_away()
