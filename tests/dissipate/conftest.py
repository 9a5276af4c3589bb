"""A plain recording for all tests of what is made of text files."""

from pathlib import Path

import pytest

from helpers.data.recordings import T, X, write


@pytest.fixture
def plain(tmp_path: Path) -> Path:
    return write(tmp_path / "plain.csv", {"t": T, "x": X})
