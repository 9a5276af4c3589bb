"""Words of a figure, and the figure of a run of which only a part is left."""

from __future__ import annotations

import shutil
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from haploop.launch.runs.start import prepare, run
from haploop.launch.scene.bundled import of_name
from haploop.logger import read
from haploop.tools.draw import draw_any
from haploop.tools.figure.data import FigureError, RunData
from haploop.tools.figure.run_figure import draw, event_lines, key_numbers, make_figure
from haploop.tools.render.report import summary_table
from haploop.tools.render.scene_units import element_units
from helpers.runs.drawn import made
from helpers.scenes.least import WALL, scene
from helpers.shown import artists, axes, shown

PNG = b"\x89PNG"


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


@pytest.mark.slow
def test_the_first_note_on_a_scene_stands_below_its_figure_with_how_many_there_are(runs: dict[str, Path]) -> None:
    data = RunData.from_directory(runs["swap"])
    [below] = artists(make_figure(data), "events")
    assert "note" not in below.get_text()
    assert data.scene.wall
    assert data.scene.hand
    soft = replace(data.scene, wall=replace(data.scene.wall, stiffness=15.0))
    [below] = artists(make_figure(replace(data, scene=soft)), "events")
    assert below.get_text().startswith("A note on its scene: wall.stiffness is 15 N/m; is that the unit")
    more = replace(soft, duration=1e6)
    [below] = artists(make_figure(replace(data, scene=more)), "events")
    assert below.get_text().startswith("2 notes on its scene; the first: wall.stiffness is 15 N/m")


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


@pytest.mark.slow
@pytest.mark.parametrize("count", [2, 12])
def test_key_numbers_that_are_too_long_for_a_line_take_two_and_none_is_cut(
    runs: dict[str, Path], monkeypatch: pytest.MonkeyPatch, count: int
) -> None:
    words = [f"a number of {number} millimetres" for number in range(count)]
    monkeypatch.setattr("haploop.tools.figure.run_figure.key_numbers", lambda _run: words)
    (numbers,) = artists(make_figure(RunData.from_directory(runs["busy"])), "numbers")
    assert all(word in numbers.get_text() for word in words)
    assert numbers.get_text().count("\n") == (count > 2)


def test_the_header_tells_verdict_and_numbers(runs: dict[str, Path]) -> None:
    data = RunData.from_directory(runs["swap"])
    figure = make_figure(data)
    assert [text.get_text() for text in artists(figure, "verdict")] == [data.summary["verdict"]]
    assert [text.get_text() for text in artists(figure, "title")] == [data.scene.title]
    assert any("residual" in words for words in key_numbers(data))
    assert data.summary["verdict"] == "limit-cycle"
    assert not any("displayed stiffness" in words for words in key_numbers(data))
    assert "displayed stiffness" not in shown(summary_table(data.summary))
    rests = data.summary | {"verdict": "steady"}
    assert any(words.startswith("displayed stiffness") for words in key_numbers(replace(data, summary=rests)))
    assert "displayed stiffness" in shown(summary_table(rests))
    swing = {"rate_1_s": 0.0, "width_m": 5.2e-3, "spread_m": 1e-4, "frequency_Hz": 7.5, "felt": True, "chaotic": False}
    data.summary["stability"] = swing
    assert "held still and pushed, it swings 5.20 mm +- 100 µm peak to peak, at 7.50 Hz, felt" in key_numbers(data)
    data.summary["stability"] = swing | {"width_m": 0.0}
    assert "held still and pushed, it swings less than 1 nm peak to peak, felt" in key_numbers(data)


def test_the_header_tells_the_window_as_the_end_only_where_it_is(runs: dict[str, Path]) -> None:
    """Of a run that failed the log may hold more than the logger had summed up."""
    data = RunData.from_directory(runs["swap"])
    assert key_numbers(data)[0].startswith("in the last 0.5 s: ")
    data.summary |= {"duration_s": 0.7, "window": {**data.summary["window"], "from_s": 0.2}}
    assert key_numbers(data)[0].startswith("from 0.2 to 0.7 s: ")


def test_the_loop_of_a_run_that_never_touches_its_wall_says_so_and_has_no_legend(tmp_path: Path) -> None:
    away = ["duration=0.2", "wall.position=-1", 'run.verdict="window"']
    run(prepare(of_name("fig6c", "scenes") or Path(), away, out=tmp_path / "away"), in_process=True)
    figure = make_figure(RunData.from_directory(tmp_path / "away"))
    ax = next(ax for ax in figure.get_axes() if "Force against" in ax.get_title("left"))
    assert [text.get_text() for text in ax.texts] == ["The device does not touch the wall."]
    assert ax.get_legend() is None


@pytest.mark.slow
def test_dollars_in_names_and_titles_are_drawn_as_they_are_written(tmp_path: Path) -> None:
    for name in ("$\\foo$", "stiff $x_1$"):
        of = [f'title="{name}"'.replace("\\", "\\\\"), "duration=0.1", 'run.verdict="window"']
        run(prepare(of_name("fig6c", "scenes") or Path(), of, out=tmp_path / name), in_process=True)
    assert draw(tmp_path / "$\\foo$").read_bytes().startswith(PNG)
    assert draw_any([tmp_path / "$\\foo$", tmp_path / "stiff $x_1$"]).read_bytes().startswith(PNG)


def test_the_figure_of_a_run_that_failed_says_so_and_why(runs: dict[str, Path]) -> None:
    data = RunData.from_directory(runs["swap"])
    data.summary |= {
        "ended": "failed",
        "why": "The controller failed: Element 0 (mine) gave no force.",
        "verdict": "undecided",
    }
    figure = make_figure(data)
    assert [text.get_text() for text in artists(figure, "verdict")] == ["failed"]
    [footer] = artists(figure, "events")
    assert footer.get_text().startswith("The controller failed: Element 0 (mine) gave no force.")


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
