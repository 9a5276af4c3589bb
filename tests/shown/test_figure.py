"""The figure of a run shows what its log and summary hold, in units."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.logger import read
from haploop.tools.figure.data import TOGETHER, FigureError, History, RunData
from haploop.tools.figure.loops import force_position_loop, momentum_loop
from haploop.tools.figure.run_figure import draw, make_figure
from haploop.tools.figure.time import extremes
from helpers.scenes.least import scene
from helpers.shown import artists, axes
from helpers.slowly import first_and_slowly

PNG = b"\x89PNG"


OTHERS = ("busy", "no-wall", "diverged", "no-hand", "ticks")


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


def test_the_close_view_is_of_a_time_of_which_the_plant_was_logged(runs: dict[str, Path]) -> None:
    data = RunData.from_directory(runs["busy"])
    assert data.close_s()[0] > 1.1
    first, last = replace(data, t_s=data.t_s[data.t_s < 1.1]).close_s()
    assert first < 1.1 <= last + 0.2
    first, last = replace(data, t_s=data.t_s[data.t_s < 0.05]).close_s()
    assert first < 0.05 < last < 0.052, "without contact so far"


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


@pytest.mark.slow
def test_the_approach_is_left_out_and_said_so_where_it_dwarfs_the_contact(runs: dict[str, Path]) -> None:
    swap, tap = (axes(make_figure(RunData.from_directory(runs[name])))[0] for name in ("swap", "tap"))
    assert "(approach not shown)" in swap.get_title(loc="left")
    assert max(swap.get_ylim()) < -50
    assert tap.get_title(loc="left") == "Position"


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
