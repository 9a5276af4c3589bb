"""The work-precision figure shows every point that was measured, where it belongs, and says what is wrong with it."""

from __future__ import annotations

import dataclasses
import itertools
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from haploop.tools.cost.data import Cost, Point, Spread
from haploop.tools.cost.figure import LOOKS, drawn_m, figure_of
from haploop.tools.cost.findings import is_told_apart, takes_away
from haploop.tools.figure.data import FigureError
from haploop.tools.figure.labels import Label, place_labels
from haploop.tools.figure.style import write_figure
from helpers.data.costs import DOUBT_M, METHODS, RATES, SCENES, fake_cost, fake_point
from helpers.shown import artists


@pytest.fixture(scope="module")
def cost() -> Cost:
    return fake_cost()


@pytest.fixture(scope="module")
def figure(cost: Cost) -> Any:
    return figure_of(cost)


def of(ax: Any, gid: str) -> list[Any]:
    return artists(ax, gid)


def panels(figure: Any, cost: Cost) -> list[tuple[Any, Any]]:
    return list(zip(figure.axes, cost.scenes, strict=False))


def xy(marks: list[Any]) -> set[tuple[float, float]]:
    return {(float(mark.get_xdata()[0]), float(mark.get_ydata()[0])) for mark in marks}


def test_every_scene_has_a_panel_and_every_method_a_line_of_its_own_look(figure: Any, cost: Cost) -> None:
    for ax, scene in panels(figure, cost):
        assert ax.get_title(loc="left") == scene.title
        assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
        for method in METHODS:
            (line,) = of(ax, f"line {method}")
            assert line.get_color() == LOOKS[method][0]
    looks = [LOOKS[method] for method in METHODS]
    assert len({colour for colour, _ in looks}) == len({marker for _, marker in looks}) == len(METHODS)


def test_every_point_stands_at_its_median_time_and_its_error(figure: Any, cost: Cost) -> None:
    for ax, scene in panels(figure, cost):
        good = {(point.time.median, drawn_m(point, scene)) for point in scene.points if point.error and point.time}
        assert xy(of(ax, "point") + of(ax, "at most")) == good
        in_doubt = [p for p in scene.points if p.error and p.error.doubt_m and not is_told_apart(p.error)]
        assert len(of(ax, "at most")) == len(in_doubt)
        assert bool(in_doubt) != scene.reference.pointwise
        assert len(of(ax, "interval of time")) == len(scene.points)


def test_an_error_of_means_has_its_interval_or_is_drawn_at_the_most_that_it_may_be(figure: Any, cost: Cost) -> None:
    (panel,) = [(ax, scene) for ax, scene in panels(figure, cost) if not scene.reference.pointwise]
    ax, scene = panel
    told = [point.error for point in scene.points if point.error and is_told_apart(point.error)]
    bars = [bar.get_ydata() for bar in of(ax, "interval of error")]
    assert len(bars) == len(told) > 0
    assert {(round(b - a, 12)) for a, b in bars} == {round(2 * DOUBT_M, 12)}
    assert all(y == pytest.approx(1e-4, rel=1.0) and y > DOUBT_M for _, y in xy(of(ax, "at most")))


def test_one_sentence_says_what_to_take_from_it(figure: Any, cost: Cost) -> None:
    assert figure.get_suptitle() == takes_away(cost)


def test_failures_are_crosses_at_the_top_edge_at_the_time_they_took(figure: Any, cost: Cost) -> None:
    seen = 0
    for ax, scene in panels(figure, cost):
        failed = [point for point in scene.points if point.error is None]
        crosses = of(ax, "failure")
        assert {cross.get_marker() for cross in crosses} <= {"x"}
        assert sorted(x for x, _ in xy(crosses)) == sorted(p.time.median for p in failed if p.time)
        highest = max(drawn_m(point, scene) for point in scene.points if point.error)
        assert all(highest < y < ax.get_ylim()[1] for _, y in xy(crosses))
        assert all(tick <= max(highest * 100, 1e-6) for tick in ax.get_yticks()) or not crosses
        seen += len(crosses)
    assert seen == sum(point.error is None for scene in cost.scenes for point in scene.points) > 0


def test_a_line_breaks_where_its_method_failed(figure: Any, cost: Cost) -> None:
    ax, scene = panels(figure, cost)[3]
    (line,) = of(ax, "line euler")
    failed = [point.error is None for point in scene.points if point.method == "euler"]
    assert np.isnan(line.get_ydata()).tolist() == failed
    assert any(failed)


def test_the_references_own_uncertainty_is_shaded_up_to_its_error_bar(figure: Any, cost: Cost) -> None:
    for ax, scene in panels(figure, cost):
        (shade,) = of(ax, "uncertainty")
        low, high = shade.get_extents().transformed(ax.transData.inverted()).intervaly
        assert high == pytest.approx(scene.reference.error_m, rel=1e-6)
        assert low <= ax.get_ylim()[0] * 1.001


def test_an_error_below_the_references_uncertainty_is_drawn_within_the_shade(cost: Cost) -> None:
    scene = cost.scenes[0]
    none = dataclasses.replace(fake_point("wall_steady", "exact", 1000).error, rms_m=0.0)  # pyright: ignore
    point = Point("exact", 1000, none, None, Spread(25.0, 24.0, 26.0))
    assert 0.0 < drawn_m(point, scene) < scene.reference.error_m


def test_10_kHz_is_marked_for_every_method(figure: Any, cost: Cost) -> None:
    for ax, scene in panels(figure, cost):
        marked = {p.time.median for p in scene.points if p.plant_rate == 10_000 and p.time}
        assert {x for x, _ in xy(of(ax, "10 kHz"))} == marked
        assert len(of(ax, "10 kHz")) == len(METHODS)


@pytest.mark.slow
def test_every_rate_is_written_at_least_once_and_no_label_covers_another_or_a_point(figure: Any, cost: Cost) -> None:
    for ax, _ in panels(figure, cost):
        labels = of(ax, "rate")
        assert {label.get_text() for label in labels} == {f"{rate / 1000:g}" for rate in RATES}
        boxes = [label.get_window_extent() for label in labels]
        assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
        marks = ax.transData.transform(sorted(xy(of(ax, "point") + of(ax, "failure"))))
        assert not any(box.contains(*mark) for box in boxes for mark in marks)
        assert all(
            ax.get_window_extent().containsx(box.x0) and ax.get_window_extent().containsx(box.x1) for box in boxes
        )


def test_the_tolerance_is_drawn_and_the_signs_are_explained(figure: Any, cost: Cost) -> None:
    for ax, _ in panels(figure, cost):
        (line,) = of(ax, "tolerance")
        assert set(line.get_ydata()) == {cost.tolerance_m}
    legend = figure.axes[len(cost.scenes)].get_legend()
    words = {text.get_text() for text in legend.get_texts()}
    assert words >= {*METHODS, "at 10 kHz", "at most: not told apart from no error", "the reference's own uncertainty"}
    assert cost.machine in artists(figure, "words")[0].get_text()


@pytest.mark.slow
def test_one_scene_or_an_unknown_method_draws_too(cost: Cost, tmp_path: Path) -> None:
    other = dataclasses.replace(fake_point("stick_slip", "rk4", 5000), method="leapfrog")
    scene = dataclasses.replace(cost.scenes[2], points=[*cost.scenes[2].points, other])
    target = write_figure(figure_of(dataclasses.replace(cost, scenes=[scene])), tmp_path / "cost.png")
    assert target.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_figure_whose_name_has_no_suffix_is_a_png(figure: Any, tmp_path: Path) -> None:
    assert write_figure(figure, tmp_path / "cost") == tmp_path / "cost.png"
    assert (tmp_path / "cost.png").read_bytes().startswith(b"\x89PNG")


def test_what_cannot_be_drawn_says_why(
    figure: Any, cost: Cost, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    points = [dataclasses.replace(point, time=None) for point in cost.scenes[0].points]
    untimed = dataclasses.replace(cost, scenes=[dataclasses.replace(cost.scenes[0], points=points)])
    with pytest.raises(FigureError, match="nothing to draw"):
        figure_of(untimed)
    with pytest.raises(FigureError, match="cannot be written"):
        write_figure(figure, tmp_path / "cost.nonsense")
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(FigureError, match=r"pip install 'haploop\[plot\]'"):
        figure_of(cost)


def test_labels_in_a_crowd_keep_one_of_each_group_and_leave_out_the_rest() -> None:
    """Forty points at one place: the two groups are written once each, most others have no room."""
    from matplotlib.figure import Figure

    ax = Figure(figsize=(3, 3)).add_subplot()
    labels = [Label(0.5, 0.5, "100", "black", group=str(number % 2)) for number in range(40)]
    labels = [dataclasses.replace(label, x=0.5 + 1e-6 * number) for number, label in enumerate(labels)]
    place_labels(ax, labels, [])
    written = artists(ax, "rate")
    assert 2 <= len(written) < 40
    boxes = [text.get_window_extent() for text in written]
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))


def test_the_fake_data_hold_what_the_tests_look_for() -> None:
    assert set(SCENES) == {scene.name for scene in fake_cost().scenes}
