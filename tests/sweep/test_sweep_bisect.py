"""Bisections of sweeps: the boundary that the theory gives, rows without one, and one that was stopped."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from haploop.protocol.scene.paths import with_value
from haploop.tools.linear.one_tick import OneTickMap
from helpers.runs.sweep_runs import engine_run, rows
from helpers.scenes.sweep_files import PRESS, loaded, swept

# Gently into the wall, so that what swings in the end has grown there.
PRESSED = (
    PRESS.replace("duration = 0.05", "duration = 12.0").replace("rise_time = 0.02", "rise_time = 2.0")
    .replace("[encoder]\nresolution = 1e-5\n", "").replace("-0.001", "0.0")
)  # fmt: skip
EXACT = """
[axes]
"dissipation.0.damping" = [0.5, 1.5]
"clock.round_trip_delay" = ["0.5 ms"]
"wall.stiffness" = { from = 50, to = 12800, count = 9, scale = "log" }
[bisect]
axis = "wall.stiffness"
relative = 0.005
"""


@pytest.mark.slow
def test_bisect_finds_where_the_spectral_radius_of_a_linear_loop_is_one(tmp_path: Path) -> None:
    """The verdict follows it as closely as twelve seconds can tell growth from decay."""
    table = swept(tmp_path, EXACT, PRESSED)
    found, made = table.boundary, loaded(tmp_path, EXACT, press=PRESSED)
    assert len(found["boundary"]) == 2
    for k in range(2):
        scene = made.scene(0)
        for key in ("dissipation.0.damping", "clock.round_trip_delay"):
            scene = with_value(scene, key, found[key][k])
        limit = OneTickMap.from_scene(scene).stiffness_limit()
        assert found["boundary"][k] == pytest.approx(limit, rel=0.03)
        assert found["high"][k] - found["low"][k] <= 0.005 * found["high"][k]
    assert (found["changes"] == 1).all()
    assert table.units["wall.stiffness"] == "N/m"


SHORT_BISECT = """
repeat = 2
[axes]
"wall.position" = [-0.001, -0.002, -0.1]
"hand.force.value" = { from = 0, to = -2, count = 5 }
[bisect]
axis = "hand.force.value"
tolerance = 0.01
holds = "no-contact"
"""


def test_a_row_without_a_change_says_on_which_side_it_is_and_the_candidates_are_rows_of_the_table(
    tmp_path: Path,
) -> None:
    table = swept(tmp_path, SHORT_BISECT)
    found = table.boundary
    assert found["seed"].tolist() == [7, 8] * 3
    assert [bool(why) for why in found["why"]] == [False] * 4 + [True] * 2
    assert found["why"][5] == "no-contact at all 5 points, 0 to -2"
    known = found["why"] == ""
    assert (found["low"][known] < found["boundary"][known]).all()
    assert np.isnan(found["boundary"][~known]).all()
    # Six halvings from 0.5 N to 0.01 N of each of the four rows that change.
    assert len(table) == 3 * 5 * 2 + 6 * 4
    near = table["hand.force.value"][table["verdict"] == "no-contact"]
    for low, high in zip(found["low"][known], found["high"][known], strict=True):
        assert {low, high} <= set(table["hand.force.value"])
        assert high in near


@pytest.mark.parametrize("stop_after", [30, *(pytest.param(n, marks=pytest.mark.slow) for n in (3, 37))])
def test_a_bisection_that_was_stopped_goes_on_without_running_a_cell_twice(stop_after: int, tmp_path: Path) -> None:
    made = loaded(tmp_path, SHORT_BISECT)
    whole, found = engine_run(made, tmp_path / "whole")
    first, _ = engine_run(made, tmp_path / "cut", stop_after)
    second, again = engine_run(made, tmp_path / "cut")
    assert 0 < len(first.cells) < len(whole.cells)
    assert sorted(first.cells + second.cells) == sorted(whole.cells)
    assert repr(again) == repr(found)
    assert rows(tmp_path / "cut") == rows(tmp_path / "whole")
