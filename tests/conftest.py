"""Fixtures of all tests. No test fails for being slow (the machine that runs it may be busy), nor for being run in the
background; and every test has a place of its own for live runs, so that none meets another's, nor one of the user's."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer.main
import typer.testing
from hypothesis import HealthCheck, settings

from haploop.plant.where_it_pays import WhereItPays
from helpers.live.launched import Launched, Run

# The same examples every time: a test fails for what was changed, never by chance; the profile explore draws new ones.
settings.register_profile(
    "haploop", deadline=None, derandomize=True, max_examples=40, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("explore", settings.get_profile("haploop"), derandomize=False, max_examples=400)
settings.register_profile("quick", settings.get_profile("haploop"), max_examples=20)
settings.load_profile("haploop")
# Tests start hundreds of processes. Where the environment forbids bytecode, as container images do, each of them would
# compile all of haploop anew, a third of the time of a short run.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
# Typer makes all commands of a program anew for every call, forty times as long as most calls take.
typer.testing._get_command = cache(typer.main.get_command)  # pyright: ignore[reportPrivateUsage, reportPrivateImportUsage]
# A shell has its background jobs ignore Ctrl-C, and what they start inherits that.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: item.get_closest_marker("long") is None)


@pytest.fixture(autouse=True)
def live_runs_here(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A short directory: the path of a socket must not be long."""
    with tempfile.TemporaryDirectory(prefix="hl", dir="/tmp") as directory:
        monkeypatch.setenv("XDG_RUNTIME_DIR", directory)
        yield Path(directory)


@pytest.fixture
def machine_code() -> None:
    """Has loops of machine code where they pay in a test that is not slow; to make them takes up to half a minute."""


@pytest.fixture(autouse=True)
def nothing_waits_for_a_compiler(request: pytest.FixtureRequest) -> Iterator[None]:
    """Keeps tests that are not slow to NumPy, which has the same bits, but for those with ``machine_code``."""
    with ExitStack() as without:
        if not request.node.get_closest_marker("slow") and "machine_code" not in request.fixturenames:
            without.enter_context(WhereItPays.none())
        yield


@pytest.fixture
def launched() -> Iterator[Callable[..., Launched]]:
    """Starts haploop as a process; whatever the test leaves running is ended."""
    started: list[Launched] = []

    def start(*arguments: Any, **options: Any) -> Launched:
        started.append(Launched(*arguments, **options))
        return started[-1]

    yield start
    for process in started:
        process.clear_away()


@pytest.fixture
def running(tmp_path: Path) -> Iterator[Callable[..., Run]]:
    """Starts a run, by default a long one of figure 6(c), into a directory of its own; it is ended with the test."""
    started: list[Run] = []

    def start(*arguments: str, **options: Any) -> Run:
        started.append(Run(tmp_path / f"out{len(started) or ''}", *arguments, **options))
        return started[-1]

    yield start
    for run in started:
        run.clear_away()
