"""Scene files that extend or name one another, in a directory to work in."""

import pytest


@pytest.fixture
def files(tmp_path, monkeypatch):
    """Write files by name and work in their directory."""
    monkeypatch.chdir(tmp_path)

    def write(**texts):
        for name, text in texts.items():
            (tmp_path / f"{name}.toml").write_text(text)
        return tmp_path / f"{next(iter(texts))}.toml"

    return write
