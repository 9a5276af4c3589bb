"""A scene file that every method can run."""

from pathlib import Path

import pytest

from helpers.scenes.cost_scene import SMOOTH


@pytest.fixture
def smooth(tmp_path: Path) -> Path:
    """A scene file without anything that switches."""
    path = tmp_path / "smooth.toml"
    path.write_text(SMOOTH)
    return path
