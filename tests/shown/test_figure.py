"""The figure of a run shows what its log and summary hold, in units, whatever is left of the run."""

from __future__ import annotations

import json
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.launch.runs.start import prepare, run
from haploop.logger import read
from haploop.tools.figure.data import TOGETHER, FigureError, History, RunData
from haploop.tools.figure.loops import force_position_loop, momentum_loop
from haploop.tools.figure.run_figure import draw, event_lines, key_numbers, make_figure
from haploop.tools.figure.scene_units import element_units
from haploop.tools.figure.time import extremes
from helpers.live.launched import first_and_slowly
from helpers.scenes.least import WALL, scene
from helpers.shown import artists

SCENES = Path(__file__).parents[2] / "launch/scenes"
PNG = b"\x89PNG"
NO_WALL = """
title = "no wall"
duration = 0.3
[device]
mass = 0.1
damping = 0.5
velocity = 0.1
[[dissipation]]
kind = "damping"
damping = 1.0
acts = "always"
"""
# Two elements that move to other places, settings, and swaps back and forth.
BUSY = f"""
extends = "{SCENES.as_posix()}/fig6b.toml"
duration = 1.5
event = [
  {{ at = 0.95, element = 1, swap = {{ kind = "unidirectional-inertia", mass = 0.002 }} }},
  {{ at = 1.0, set = {{ "wall.stiffness" = 120.0, "wall.position" = -0.0601 }} }},
  {{ at = 1.1, element = 0, swap = {{ kind = "none" }} }},
  {{ at = 1.2, set = {{ "dissipation.0.mass" = 0.004 }} }},
  {{ at = 1.3, element = 1, swap = {{ kind = "damping", damping = 0.5 }} }},
]
"""


def made(directory: Path, name: str, *overrides: str) -> Path:
    """A run of a scene that comes with haploop, or of a TOML text."""
    path = SCENES / f"{name}.toml"
    if "\n" in name:
        path = directory.parent / f"{directory.name}.toml"
        path.write_text(name, encoding="utf-8")
    run(prepare(path, overrides, out=directory), in_process=True)
    return directory


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    base = tmp_path_factory.mktemp("runs")
    return {
        "swap": made(base / "swap", "swap"),
        "tap": made(base / "tap", "tap"),
        "busy": made(base / "busy", BUSY),
        "no-wall": made(base / "no-wall", NO_WALL),
        "diverged": made(base / "diverged", "fig6b", "wall.stiffness=50000"),
        "no-hand": made(base / "no-hand", NO_WALL, "wall.position=0.005", "wall.stiffness=500", "wall.occupies=above"),
        "ticks": made(base / "ticks", "fig6c", 'run.log="ticks"', "duration=1.2"),
        "never-there": made(base / "never-there", "fig6c", "duration=0.2"),
    }


OTHERS = ("busy", "no-wall", "diverged", "no-hand", "ticks")


def axes(figure: Any) -> list[Any]:
    return [ax for part in figure.subfigs for ax in part.axes if ax.axison]


@pytest.mark.parametrize("name", ["never-there", *first_and_slowly("swap", "tap", *OTHERS)])
def test_every_kind_of_run_draws_and_every_axis_has_its_unit(runs: dict[str, Path], name: str) -> None:
    figure = make_figure(RunData.from_directory(runs[name]))
    assert len(axes(figure)) >= 6
    for ax in axes(figure):
        for label in (ax.get_xlabel(), ax.get_ylabel()):
            assert any(f"({unit})" in label for unit in ("s", "mm", "N", "m/s", "g m/s", "J", "mJ", "µJ", "nJ"))


@pytest.mark.slow
def test_the_figure_is_written_where_it_is_asked_for(runs: dict[str, Path], tmp_path: Path) -> None:
    assert draw(runs["tap"]) == runs["tap"] / "figure.png"
    assert (runs["tap"] / "figure.png").read_bytes().startswith(PNG)
    target = draw(runs["tap"], tmp_path / "other.svg")
    assert "<svg" in target.read_text(encoding="utf-8")
    with pytest.raises(FigureError, match="cannot be written"):
        draw(runs["tap"], tmp_path / "figure.nonsense")


@pytest.mark.parametrize("name", ["swap", "tap", "busy", "no-wall"])
def test_every_energy_ends_with_the_value_of_its_true_book(runs: dict[str, Path], name: str) -> None:
    data = RunData.from_directory(runs[name])
    figure = make_figure(data)
    energy = json.loads((runs[name] / "summary.json").read_text())["energy"]
    ends = {"wall": energy["wall"]} if data.history.walls else {}
    ends |= dict(zip([span.name for span in data.history.elements], energy["elements"], strict=True))
    assert [span.element.name for span in data.history.elements] == [element["kind"] for element in energy["elements"]]
    largest = max(float(np.abs([book.true_J, book.sampled_J]).max()) for book in data.books())
    factor = 1e-3 if largest >= 1e-3 else 1e-6
    for account, end in ends.items():
        for side in ("true", "sampled"):
            (line,) = artists(figure, f"{account}.{side}")
            assert line.get_ydata()[-1] * factor == pytest.approx(end[f"{side}_J"], rel=1e-12, abs=1e-20)


@pytest.mark.parametrize("name", ["swap", "busy", "no-wall"])
def test_history_covers_the_ticks_of_the_summary_and_finds_the_forces_that_add_up(
    runs: dict[str, Path], name: str
) -> None:
    """The forces found by following the events add up, with the wall's, to the total that was logged."""
    data = RunData.from_directory(runs[name])
    elements = json.loads((runs[name] / "summary.json").read_text())["energy"]["elements"]
    total = data.controller["wall"].copy()
    for span, element in zip(data.history.elements, elements, strict=True):
        times, force = data.element_force(span)
        assert (span.from_tick, len(times)) == (element["from_tick"], element["to_tick"] - element["from_tick"])
        assert {"acts": span.element.acts, **span.element.parameters} == element["parameters"]
        total[np.rint(times * data.control_rate).astype(int)] += force
    np.testing.assert_allclose(total, data.controller["total"], atol=1e-15)


def test_the_energies_of_wall_and_elements_add_up_to_the_line_together(runs: dict[str, Path]) -> None:
    *parts, together = RunData.from_directory(runs["busy"]).books()
    assert together.name == TOGETHER
    assert together.ends_J[0] == pytest.approx(sum(book.ends_J[0] for book in parts), rel=1e-12)
    at = int(np.searchsorted(together.t_s, 1.25))
    counted = [book.true_J[np.searchsorted(book.t_s, together.t_s[at])] for book in parts if book.t_s[0] <= 1.25]
    assert len(counted) < len(parts)
    assert together.true_J[at] == pytest.approx(sum(counted), rel=1e-12)


def test_the_force_position_loop_is_the_log_and_its_area_the_true_books(runs: dict[str, Path]) -> None:
    """Choi et al. 2022, Fig. 3: on a tap the loop is closed and encloses what the wall gave."""
    data, log = RunData.from_directory(runs["tap"]), read(runs["tap"])["/plant"]
    depth, force = force_position_loop(data, data.span_s)
    np.testing.assert_array_equal(depth, -(log["x"] + 0.005))
    np.testing.assert_array_equal(force, log["force"])
    wall = data.summary["energy"]["wall"]["true_J"]
    assert wall < 0
    assert np.sum(force[:-1] * np.diff(depth)) == pytest.approx(wall, rel=1e-9)


def test_the_drawn_loop_is_the_loop_of_the_close_view(runs: dict[str, Path]) -> None:
    data = RunData.from_directory(runs["tap"])
    depth, force = force_position_loop(data, data.close_s())
    figure = make_figure(data)
    drawn = [line.get_xydata() for name in ("pressing", "releasing") for line in artists(figure, name)]
    points = {tuple(point) for line in drawn for point in line if np.isfinite(point).all()}
    assert points == set(zip(depth * 1e3, force, strict=True))


def test_the_area_of_the_momentum_loop_is_the_sampled_book_of_the_inertia(runs: dict[str, Path]) -> None:
    """Choi et al. 2022, eq. 8: E = sum of m v[k] (v[k-1] - v[k-2]), with backward differences for v and a."""
    data = RunData.from_directory(runs["swap"])
    span = data.history.elements[1]
    _, velocity, momentum = momentum_loop(data, span)
    area = np.sum(momentum[1:] * np.diff(velocity))
    assert area == pytest.approx(data.summary["energy"]["elements"][1]["sampled_J"], rel=1e-9)


def test_events_are_marked_at_their_times_and_named(runs: dict[str, Path]) -> None:
    data = RunData.from_directory(runs["busy"])
    times = {0.95, 1.0, 1.1, 1.2, 1.3}
    figure = make_figure(data)
    marks = [line.get_xdata()[0] for line in artists(figure, "event")]
    assert set(marks) == times
    assert len(marks) == 3 * len(times)
    labels = [text.get_text() for text in artists(figure, "event-label")]
    assert labels == ["1", "2", "3", "4", "5"]
    (words,) = event_lines(data)[:1]
    assert "1 at 0.95 s: element 1 becomes unidirectional-inertia (mass 0.002 kg)" in words
    assert "3 at 1.1 s: element 0 is removed" in " ".join(event_lines(data))


def test_the_close_view_is_of_a_time_of_which_the_plant_was_logged(runs: dict[str, Path]) -> None:
    data = RunData.from_directory(runs["busy"])
    assert data.close_s()[0] > 1.1
    first, last = replace(data, t_s=data.t_s[data.t_s < 1.1]).close_s()
    assert first < 1.1 <= last + 0.2


def test_what_events_set_is_told_with_the_unit_that_it_has_at_that_time() -> None:
    before = scene(wall=WALL, dissipation=[{"kind": "damping", "damping": 1.0}])
    inertia = {"kind": "unidirectional-inertia", "mass": 0.002}
    events: list[dict[str, Any]] = [
        {"timestamp": 0.1, "set": {"wall.stiffness": 200.0, "dissipation.0.damping": 2.0}},
        {"timestamp": 0.2, "swap": inertia, "element": 0},
        {"timestamp": 0.3, "set": {"dissipation.0.mass": 0.001, "clock.round_trip_delay": 0.002}},
    ]
    data: Any = SimpleNamespace(scene=before, events=events, units=element_units())
    told = " ".join(event_lines(data))
    assert "set wall.stiffness = 200 N/m, dissipation.0.damping = 2 N s/m" in told
    assert "set dissipation.0.mass = 0.001 kg, clock.round_trip_delay = 0.002 s" in told


@pytest.mark.parametrize("count", [2, 12])
def test_key_numbers_that_are_too_long_for_a_line_take_two_and_none_is_cut(
    runs: dict[str, Path], monkeypatch: pytest.MonkeyPatch, count: int
) -> None:
    words = [f"a number of {number} millimetres" for number in range(count)]
    monkeypatch.setattr("haploop.tools.figure.run_figure.key_numbers", lambda _run: words)
    (numbers,) = artists(make_figure(RunData.from_directory(runs["busy"])), "numbers")
    assert all(word in numbers.get_text() for word in words)
    assert numbers.get_text().count("\n") == (count > 2)


def test_a_change_that_was_refused_leaves_history_as_it_was() -> None:
    before = scene(dissipation=[{"kind": "damping", "damping": 1.0}])
    swap = {"tick": 5, "timestamp": 0.005, "element": 0, "swap": {"kind": "none"}}
    refusal = {
        "tick": 7,
        "timestamp": 0.007,
        "refused": "No.",
        "change": {"tick": 5, "element": 0, "swap": swap["swap"]},
    }
    assert [span.to_tick for span in History(before, [swap]).elements] == [5]
    assert [span.to_tick for span in History(before, [swap, refusal]).elements] == [np.inf]


def test_the_wall_is_drawn_where_it_stood(runs: dict[str, Path]) -> None:
    data = RunData.from_directory(runs["busy"])
    position, stiffness = data.wall_at(np.array([0.0, 0.999, 1.0, 1.4]))
    assert position.tolist() == [-0.06, -0.06, -0.0601, -0.0601]
    assert stiffness.tolist() == [150.0, 150.0, 120.0, 120.0]


def test_the_approach_is_left_out_and_said_so_where_it_dwarfs_the_contact(runs: dict[str, Path]) -> None:
    swap, tap = (axes(make_figure(RunData.from_directory(runs[name])))[0] for name in ("swap", "tap"))
    assert "(approach not shown)" in swap.get_title(loc="left")
    assert max(swap.get_ylim()) < -50
    assert tap.get_title(loc="left") == "Position"


def test_the_header_tells_verdict_and_numbers(runs: dict[str, Path]) -> None:
    data = RunData.from_directory(runs["swap"])
    figure = make_figure(data)
    assert [text.get_text() for text in artists(figure, "verdict")] == [data.summary["verdict"]]
    assert [text.get_text() for text in artists(figure, "title")] == [data.scene.title]
    assert any("residual" in words for words in key_numbers(data))
    assert any(words.startswith("displayed stiffness") for words in key_numbers(data))
    swing = {"rate_1_s": 0.0, "width_m": 5.2e-3, "spread_m": 1e-4, "frequency_Hz": 7.5, "felt": True, "chaotic": False}
    data.summary["stability"] = swing
    assert "pushed, it swings 5.20 mm +- 100 µm peak to peak, at 7.50 Hz, felt" in key_numbers(data)
    data.summary["stability"] = swing | {"width_m": 0.0}
    assert "pushed, it swings less than 1 nm peak to peak, felt" in key_numbers(data)


def test_the_header_tells_the_window_as_the_end_only_where_it_is(runs: dict[str, Path]) -> None:
    """Of a run that failed the log may hold more than the logger had summed up."""
    data = RunData.from_directory(runs["swap"])
    assert key_numbers(data)[0].startswith("in the last 0.5 s: ")
    data.summary |= {"duration_s": 0.7, "window": {**data.summary["window"], "from_s": 0.2}}
    assert key_numbers(data)[0].startswith("from 0.2 to 0.7 s: ")


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.4, 0.8])
def test_a_run_that_was_killed_still_draws(runs: dict[str, Path], tmp_path: Path, share: float) -> None:
    """With half a log and no summary; even without the scene file, which the log holds too."""
    log = (runs["swap"] / "log.mcap").read_bytes()
    (tmp_path / "log.mcap").write_bytes(log[: int(len(log) * share)])
    data = RunData.from_directory(tmp_path)
    assert data.cut
    assert data.scene.title == RunData.from_directory(runs["swap"]).scene.title
    assert draw(tmp_path).read_bytes().startswith(PNG)
    assert key_numbers(data)[0].startswith("log cut off")


@pytest.mark.slow
def test_a_run_draws_whose_log_of_the_plant_ends_long_before_that_of_the_controller(runs: dict[str, Path]) -> None:
    """As where a run is killed: channels are written chunk by chunk. Its close view holds no plant step."""
    data = RunData.from_directory(runs["swap"])
    few = {name: getattr(data, name)[:50] for name in ("t_s", "x_m", "v_m_s", "force_N")}
    figure = make_figure(replace(data, **few, bodies_m={}, plant_forces_N={}))
    assert few["t_s"][-1] < data.close_s()[0]
    assert artists(figure, "position")


def test_a_log_of_ticks_alone_shows_what_the_controller_measured(runs: dict[str, Path]) -> None:
    data = RunData.from_directory(runs["ticks"])
    assert not data.every_step
    np.testing.assert_array_equal(data.x_m, read(runs["ticks"])["/controller"]["x"])
    assert "penetration as measured (mm)" in [ax.get_xlabel() for ax in axes(make_figure(data))]
    assert "penetration (mm)" in [ax.get_xlabel() for ax in axes(make_figure(RunData.from_directory(runs["swap"])))]


def test_a_run_without_log_or_without_ticks_says_so(tmp_path: Path) -> None:
    silent = made(tmp_path / "silent", "tap", 'run.log="none"')
    with pytest.raises(FigureError, match=r'run\.log = "none" and kept no log'):
        draw(silent)
    with pytest.raises(FigureError, match=r"holds no log\.mcap"):
        draw(tmp_path)
    with pytest.raises(FigureError, match="There is no"):
        draw(tmp_path / "nowhere")
    shutil.copytree(silent, tmp_path / "begun")
    begun = made(tmp_path / "whole", "tap") / "log.mcap"
    (tmp_path / "begun" / "log.mcap").write_bytes(begun.read_bytes()[:900])
    with pytest.raises(FigureError, match="holds no tick, so there is nothing to draw"):
        draw(tmp_path / "begun")


def test_without_matplotlib_the_error_says_what_to_install(
    runs: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(FigureError, match=r"pip install 'haploop\[plot\]'"):
        draw(runs["tap"])


@given(st.lists(st.floats(-1e9, 1e9) | st.sampled_from([np.nan, np.inf]), min_size=1, max_size=400), st.integers(1, 20))
def test_reducing_a_series_keeps_its_extremes_ends_and_order(values: list[float], buckets: int) -> None:
    y = np.array(values)
    keep = extremes(y, buckets)
    assert len(keep) <= max(2 * buckets + 2, min(len(y), 2 * buckets))
    assert (keep[0], keep[-1]) == (0, len(y) - 1)
    assert (np.diff(keep) > 0).all()
    finite = y[np.isfinite(y)]
    if len(finite):
        kept = y[keep][np.isfinite(y[keep])]
        assert (kept.min(), kept.max()) == (finite.min(), finite.max())
