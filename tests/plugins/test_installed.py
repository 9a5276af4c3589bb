"""Installed packages whose entry points do not load: named, wherever they are met."""

from __future__ import annotations

import importlib.metadata
import subprocess
import sys
from pathlib import Path

import pytest

from haploop.protocol.installed import PluginError, loaded

GROUPS = ["dissipation", "walls", "estimators", "hand_forces", "effects"]


def test_what_an_entry_point_names_is_loaded_or_told_with_its_group_and_place() -> None:
    assert loaded(importlib.metadata.EntryPoint("path", "pathlib:Path", "haploop.walls")) is Path
    with pytest.raises(PluginError, match=r"names 'skin' \(no_such:Skin\) under haploop\.walls, .* No module named"):
        loaded(importlib.metadata.EntryPoint("skin", "no_such:Skin", "haploop.walls"))


@pytest.mark.slow
@pytest.mark.parametrize("group", GROUPS)
def test_a_command_that_meets_a_package_that_does_not_load_ends_with_one_sentence(group: str, tmp_path: Path) -> None:
    info = tmp_path / "lost-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: lost\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[haploop.{group}]\nskin = no_such:Skin\n")
    words = ["check", "demo", *(["--set", "wall.kind=skin"] if group == "walls" else [])]
    command = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from haploop.tools.cli.main import main; main()"
    done = subprocess.run([sys.executable, "-c", command, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    [line] = done.stderr.strip().splitlines()
    assert f"names 'skin' (no_such:Skin) under haploop.{group}, which does not load" in line
