"""Every test has a place of its own for live runs."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def live_runs_here(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A short directory: the path of a socket must not be long."""
    with tempfile.TemporaryDirectory(prefix="hl", dir="/tmp") as directory:
        monkeypatch.setenv("XDG_RUNTIME_DIR", directory)
        yield Path(directory)
