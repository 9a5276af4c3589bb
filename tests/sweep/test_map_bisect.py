"""A bisecting sweep is drawn as its boundaries with their brackets; the program's own sweeps as their tables are."""

from __future__ import annotations

import math
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from haploop.tools.cli.app import app
from haploop.tools.figure.data import FigureError
from haploop.tools.sweep.map.data import AMPLITUDE, VERDICTS, MapData, make_map_data
from haploop.tools.sweep.map.edges import State, find_edges
from haploop.tools.sweep.map.figure import MOST_LINES, bisect_figure, draw_map
from haploop.tools.sweep.table import read
from helpers import shown
from helpers.data.sweep_tables import UNITS, said
from helpers.shown import artists

K, B, KIND = "wall.stiffness", "dissipation.0.damping", "dissipation.0.kind"
DELAY = "clock.round_trip_delay"
SCENES = Path(__file__).parents[2] / "launch/scenes"
Ends = Mapping[tuple[Any, ...], float | str]
POINTS = [100.0, 200.0, 400.0, 800.0]


def bisected(others: dict[str, list[Any]], boundary: Ends, points: list[float] | None = None) -> MapData:
    """A sweep whose boundaries are given by the other axes' values and the seed: a stiffness, or why there is none."""
    points = points or POINTS
    keys = [*others, "seed"]
    rows: list[dict[str, Any]] = []
    edges: list[dict[str, Any]] = []
    rising = points[-1] > points[0]
    for place, end in boundary.items():
        place = dict(zip(keys, place, strict=False))
        place = {"seed": 1, **place}
        for k in points:
            holds = end == "all" or (not isinstance(end, str) and (k < end) == rising)
            result = said(None) if end == "failed" else said("steady" if holds else "limit-cycle", 1e-4)
            rows.append({**place, K: k, **result})
        known = not isinstance(end, str)
        low, high = (0.99 * end, 1.01 * end) if known else (math.nan, math.nan)
        edges.append({**place, "low": low, "high": high, "boundary": end if known else math.nan, "changes": int(known)})
    columns: dict[str, list[Any]] = {key: [row[key] for row in rows] for key in (*keys, K)}
    columns["verdict"] = [row.get("verdict") for row in rows]
    columns[AMPLITUDE] = [row.get("window", {}).get("oscillation_m") for row in rows]
    columns["why"] = [row.get("why", "") for row in rows]
    columns["scene"] = [None] * len(rows)
    found = {name: [edge[name] for edge in edges] for name in edges[0]}
    axes = {**others, K: points}
    sweep = {"title": "bisected", "base": {"title": "a base"}, "axes": axes, "bisect": {"axis": K, "holds": "steady"}}
    return make_map_data(columns, UNITS, sweep, found)


def words(drawn: Any, gid: str) -> str:
    return " ".join(shown.words(drawn, gid))


def test_every_boundary_stands_at_its_place_with_its_bracket() -> None:
    given = {(0.1,): 150.0, (0.2,): 300.0, (0.4,): 700.0}
    drawn = bisect_figure(bisected({B: [0.1, 0.2, 0.4]}, given))
    [line] = artists(drawn, "boundary")
    assert line.get_ydata().tolist() == pytest.approx([0.99 * end for end in given.values()]), "seen to be steady"
    [bars] = artists(drawn, "brackets")
    for (_, end), segment in zip(given.items(), bars.get_segments(), strict=True):
        assert segment[:, 1].tolist() == pytest.approx([0.99 * end, 1.01 * end])
    assert words(drawn, "star words") == "steady up to 693 N/m"
    assert "boundaries: 3 found" in words(drawn, "description")


def test_where_there_is_no_boundary_the_edge_of_the_panel_says_on_which_side() -> None:
    data = bisected({B: [0.1, 0.2, 0.4, 0.8]}, {(0.1,): "none", (0.2,): 300.0, (0.4,): "all", (0.8,): "failed"})
    assert find_edges(data).state.tolist() == [State.NONE_HOLDS, State.FOUND, State.ALL_HOLD, State.UNKNOWN]
    drawn = bisect_figure(data)
    for state, x in ((State.NONE_HOLDS, 0.1), (State.ALL_HOLD, 0.4), (State.UNKNOWN, 0.8)):
        [line] = artists(drawn, f"state {state}")
        assert line.get_xdata().tolist() == [x]
    (bottom, top), (failed,) = drawn.axes[0].get_ylim(), artists(drawn, f"state {State.UNKNOWN}")
    assert artists(drawn, f"state {State.ALL_HOLD}")[0].get_ydata().tolist() == [top]
    assert failed.get_ydata().tolist() == [bottom]
    for part in ("1 found", "1 steady throughout", "1 not steady at 100 N/m", "1 unknown"):
        assert part in words(drawn, "description")
    assert words(drawn, "star words") == "steady up to 800 N/m and perhaps beyond"
    assert "failed: A plugin raised." in words(drawn, "legend")


def test_a_line_for_every_value_of_the_second_axis_each_with_a_look_of_its_own() -> None:
    given: Ends = {
        (b, kind): 100.0 + 1000.0 * b + 50.0 * number
        for b in (0.1, 0.2)
        for number, kind in enumerate(("damping", "inertia"))
    }
    drawn = bisect_figure(bisected({B: [0.1, 0.2], KIND: ["damping", "inertia"]}, given))
    lines = artists(drawn, "boundary")
    assert [line.get_ydata().tolist() for line in lines] == [
        pytest.approx(0.99 * np.array(ends)) for ends in ([200.0, 300.0], [250.0, 350.0])
    ]
    assert len({line.get_color() for line in lines}) == len({line.get_marker() for line in lines}) == 2
    assert "inertia" in words(drawn, "legend")


def test_of_several_seeds_the_one_that_holds_least_far_is_drawn_and_the_bar_covers_all() -> None:
    given: Ends = {(0.1, 1): 300.0, (0.1, 2): 200.0, (0.2, 1): 500.0, (0.2, 2): "none"}
    edges = find_edges(bisected({B: [0.1, 0.2]}, given))
    assert edges.nearest[0] == pytest.approx(198.0)
    assert (edges.low[0], edges.high[0]) == (pytest.approx(198.0), pytest.approx(303.0))
    assert edges.state.tolist() == [State.FOUND, State.NONE_HOLDS]
    downwards = find_edges(bisected({B: [0.1]}, {(0.1, 1): 300.0, (0.1, 2): 200.0}, POINTS[::-1]))
    assert not downwards.rising
    assert downwards.nearest[0] == pytest.approx(303.0)


@pytest.mark.parametrize(
    ("points", "told"), [(POINTS, "steady up to 122.2 N/m"), (POINTS[::-1], "steady down to 124.8 N/m")]
)
def test_no_digit_of_what_is_told_lies_beyond_the_last_value_that_was_steady(points: list[float], told: str) -> None:
    """Those are 122.2806 and 124.7509 N/m."""
    data = bisected({B: [0.1]}, {(0.1,): 123.51575757575758}, points)
    assert words(bisect_figure(data), "star words") == told


@pytest.mark.slow
def test_more_lines_than_can_be_told_apart_are_left_out_and_counted() -> None:
    masses = [0.01 * number for number in range(1, 11)]
    given: Ends = {(b, m): 300.0 for b in range(1, 12) for m in masses}
    drawn = bisect_figure(bisected({B: [float(b) for b in range(1, 12)], "device.mass": masses}, given))
    assert len(artists(drawn, "boundary")) == MOST_LINES
    assert f"The first {MOST_LINES} of 10 lines are drawn." in words(drawn, "legend")


def test_a_search_that_goes_on_is_drawn_as_the_map_of_its_planned_points() -> None:
    data = bisected({B: [0.1, 0.2]}, {(0.1,): 150.0, (0.2,): 300.0})
    columns = {name: [*column] for name, column in data.columns.items()}
    for name, column in columns.items():
        column.append(173.2 if name == K else column[-1])
    running = make_map_data(columns, UNITS, data.sweep)
    assert not running.has_edges
    assert running.cells().verdict.shape == (2, 4)


SWEEP = """
title = "A sweep of the program's own"
scene = "{scenes}/fig6b.toml"
[set]
duration = 0.6
"run.verdict" = "window"
"hand.force.rise_time" = 0.1
[axes]
"dissipation.0.damping" = [0.05, 0.2, 0.8]
"wall.stiffness" = {{ from = 50, to = 1600, count = 6, scale = "log" }}
"""


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    base = tmp_path_factory.mktemp("sweeps")
    made = {}
    for name, more in (("grid", ""), ("search", '[bisect]\naxis = "wall.stiffness"\nrelative = 0.02\n')):
        file = base / f"{name}.toml"
        file.write_text(SWEEP.format(scenes=SCENES.as_posix()) + more, encoding="utf-8")
        made[name] = base / name
        done = CliRunner().invoke(app, ["sweep", str(file), "--out", str(made[name]), "--workers", "1"])
        assert done.exit_code == 0, done.output
    return made


@pytest.mark.slow
def test_a_sweep_of_runs_that_are_not_pushed_calls_none_steady(swept: dict[str, Path]) -> None:
    """In its table, its boundaries, its map and its own file; ``holds`` is steady unless it says otherwise."""
    found = read(swept["search"])
    assert {"no-swing-seen", "swinging"} <= set(found["verdict"].tolist()) <= {*VERDICTS, "no-swing-seen", "swinging"}
    assert not {"steady", "limit-cycle"} & set(found["verdict"].tolist())
    assert np.isfinite(found.boundary["boundary"]).any()
    assert 'holds = "no-swing-seen"' in (swept["search"] / "sweep.toml").read_text()
    data = make_map_data(found.columns, found.units, found.sweep, found.boundary)
    told = " ".join(words(bisect_figure(data), gid) for gid in ("description", "star words", "legend"))
    assert "“no swing seen” up to" in told
    assert "steady" not in told


@pytest.mark.slow
@pytest.mark.parametrize("name", ["grid", "search"])
def test_haploop_plot_draws_a_sweep_of_haploop_sweep(swept: dict[str, Path], name: str) -> None:
    done = CliRunner().invoke(app, ["plot", str(swept[name])])
    assert done.exit_code == 0, done.output
    assert done.stdout.splitlines()[-1] == str(swept[name] / "figure.png")
    assert (swept[name] / "figure.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_boundaries_drawn_are_those_of_the_program_s_table(swept: dict[str, Path]) -> None:
    found = read(swept["search"])
    data = make_map_data(found.columns, found.units, found.sweep, found.boundary)
    [line] = artists(bisect_figure(data), "boundary")
    assert np.array_equal(line.get_ydata(), found.boundary["low"], equal_nan=True)


@pytest.mark.slow
def test_a_sweep_that_still_runs_is_drawn_from_its_parts(swept: dict[str, Path], tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    shutil.copy(swept["grid"] / "sweep.toml", tmp_path)
    shutil.copy(swept["grid"] / "table.parquet", tmp_path / "parts/0.parquet")
    assert draw_map(tmp_path, tmp_path / "map.svg").stat().st_size > 0


def test_a_sweep_without_any_part_has_no_map_and_a_message(swept: dict[str, Path], tmp_path: Path) -> None:
    shutil.copy(swept["grid"] / "sweep.toml", tmp_path)
    with pytest.raises(FigureError, match="no finished cell yet"):
        draw_map(tmp_path)
    done = CliRunner().invoke(app, ["plot", str(tmp_path)])
    assert done.exit_code == 2
    assert "no finished cell yet" in done.output


def test_a_boundary_of_a_delay_is_told_in_milliseconds() -> None:
    data = bisected({B: [0.1, 0.2]}, {(0.1,): 0.0015, (0.2,): 0.0034}, [0.0, 0.002, 0.004])
    columns = {DELAY if name == K else name: column for name, column in data.columns.items()}
    sweep = {**data.sweep, "axes": {B: [0.1, 0.2], DELAY: [0.0, 0.002, 0.004]}, "bisect": {"axis": DELAY}}
    drawn = bisect_figure(make_map_data(columns, UNITS, sweep, data.boundary))
    assert words(drawn, "star words") == "steady up to 3.366 ms"
    assert drawn.axes[0].get_ylabel() == "clock.round_trip_delay (ms)"
    assert artists(drawn, "boundary")[0].get_ydata().tolist() == pytest.approx([1.485, 3.366])
