"""Readings in files: the table of all of them, and scene files of one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from haploop.launch.scene.toml_writer import inline
from haploop.tools.studies.choi2022.simulation.reading import Reading, scene_of

_TITLES = {
    "a": "Fig. 6(a), the nearest reading: a 0.08 N/mm wall alone",
    "b": "Fig. 6(b), the nearest reading: a 0.15 N/mm wall with damping",
    "c": "Fig. 6(c), the nearest reading: a 0.15 N/mm wall with unidirectional inertia",
}
_ABOUT = """\
# {title}
# Choi et al. 2022, section V.A. Found by `haploop paper --figure 6`: of all readings of what the paper leaves open that
# were tried, the one under which its Fig. 6 comes out best (docs/paper.md). Masses, damping, springs, wall, element,
# 1 kHz and 2 ms are the paper's; each table here is an ASSUMPTION.
"""
# What a scene of a reading may hold beyond the paper's numbers.
_TABLES = ("encoder", "noise", "velocity", "acceleration")


def scene_text(reading: Reading, panel: str) -> str:
    """A scene file of the reading that extends the paper's scene of the panel."""
    scene = scene_of(reading, panel)
    lines = [
        _ABOUT.format(title=_TITLES[panel]).rstrip(),
        f"title = {inline(_TITLES[panel])}",
        f'extends = "../fig6{panel}.toml"',
        f"duration = {inline(scene['duration'])}",
        f"seed = {inline(scene['seed'])}",
        "",
        "[hand]",
        f"rest = {inline(scene['hand']['rest'])}",
        *_table("hand.force", scene["hand"]["force"]),
    ]
    for name in _TABLES:
        lines += _table(name, scene[name]) if name in scene else []
    for element in scene.get("dissipation", []):
        lines += ["", "[[dissipation]]", *(f"{key} = {inline(value)}" for key, value in element.items())]
    return "\n".join(lines) + "\n"


def _table(name: str, table: dict[str, Any]) -> list[str]:
    return ["", f"[{name}]", *(f"{key} = {inline(value)}" for key, value in table.items())]


def write_table(rows: Sequence[dict[str, Any]], path: Path) -> bool:
    """All readings as Parquet, one row each; False where pyarrow is missing.

    Numbers that a reading does not use are NaN; swings of runs that diverged are infinite.
    """
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        return False
    table = pyarrow.Table.from_pylist(list(rows))
    pyarrow.parquet.write_table(table, path)
    return True
