"""The sweeps that come with haploop can be run, and say what they claim to say."""

from __future__ import annotations

from pathlib import Path

import pytest

from haploop.tools.sweep.sweep_file import load

SWEEPS = sorted((Path(__file__).parents[2] / "launch/sweeps").glob("*.toml"))


@pytest.mark.parametrize("path", SWEEPS, ids=lambda path: path.stem)
def test_every_corner_of_an_example_is_a_scene_that_can_be_run(path: Path) -> None:
    made = load(path)
    for cell in (0, made.count // 2, made.count - 1):
        assert made.scene(cell).title == made.base.title
    assert made.title != path.stem


def test_the_examples_show_a_grid_a_boundary_and_seeds_with_tables_as_an_axis() -> None:
    made = {path.stem: load(path) for path in SWEEPS}
    damping_stiffness, delay_boundary, elements = (
        made[name] for name in ("damping_stiffness", "delay_boundary", "elements")
    )
    assert [len(axis.values) for axis in damping_stiffness.axes] == [24, 40]
    assert delay_boundary.bisect
    assert delay_boundary.bisect.axis == "wall.stiffness"
    assert (elements.repeat, elements.axes[1].unit) == (5, None)
    assert elements.base.noise
