"""The lines over a map: the exact limit where the loop is linear, the bounds where they speak of the scene."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from haploop.protocol.scene.paths import with_value, without
from haploop.protocol.scene.scene import ElementTable, Scene
from haploop.tools.linear.bounds import bounds_of
from haploop.tools.linear.one_tick import NotLinear, OneTickMap
from haploop.tools.sweep.map.axis import Axis
from haploop.tools.sweep.map.figure import make_figure
from haploop.tools.sweep.map.lines import EXACT, bound_lines, exact_limit
from haploop.tools.sweep.map.plane import Plane, zero_lines
from helpers.data.sweep_tables import UNITS, cells_of, said, table
from helpers.scenes.least import scene
from helpers.shown import artists, words

K, B, M, DELAY = "wall.stiffness", "dissipation.0.damping", "dissipation.0.mass", "clock.round_trip_delay"
WALL = {"position": -0.001, "stiffness": 100.0}
DEVICE = {"mass": 0.02, "damping": 0.3}
ON = (True, True)


def loop(**tables: Any) -> Scene:
    return scene(**{"device": DEVICE, "wall": WALL, "dissipation": [{"kind": "damping", "damping": 0.1}], **tables})


def axis(key: str, values: list[float]) -> Axis:
    return Axis.from_column(key, UNITS.get(key, ""), values)


def plane(made: Scene, **axes: list[float]) -> Plane:
    names = {"k": K, "b": B, "m": M, "delay": DELAY, "rate": "clock.control_rate"}
    return Plane(made, [axis(names[name], values) for name, values in axes.items()])


def points(lines: list[np.ndarray]) -> np.ndarray:
    return np.concatenate(lines)


def with_values(made: Scene, **values: float) -> Scene:
    for name, value in values.items():
        made = with_value(made, {"b": B, "m": M, "delay": DELAY}[name], value)
    return made


@pytest.mark.slow
@pytest.mark.parametrize("values", [[0.05, 0.1, 0.2, 0.4], [0.01, 0.1, 1.0, 10.0], [0.0, 0.01, 0.1, 1.0]])
@pytest.mark.parametrize("delay", [0.0, 0.002])
def test_every_point_of_the_exact_limit_is_the_stiffness_limit_there(values: list[float], delay: float) -> None:
    made = loop(clock={"round_trip_delay": delay})
    stiffnesses = np.linspace(20.0, 2000.0, 7).tolist()
    found = points(exact_limit(plane(made, b=values, k=stiffnesses)).pieces)
    assert len(found) > 10
    for b, k in found[:: max(1, len(found) // 12)]:
        ranges = OneTickMap.from_scene(with_values(made, b=b)).stable_ranges()
        assert min(abs(k - end) for pair in ranges for end in pair) <= 1e-7 * k


def test_a_wall_a_little_stiffer_than_the_line_grows_and_a_softer_one_decays() -> None:
    made = loop()
    for b, k in points(exact_limit(plane(made, b=[0.05, 0.2, 0.8], k=[50.0, 500.0, 1000.0])).pieces)[::8]:
        growth = OneTickMap.from_scene(with_values(made, b=b)).growth
        assert growth(0.999 * k) < 1.0 < growth(1.001 * k)


def test_the_limit_over_delay_is_exact_at_whole_steps_and_only_there_asked_for() -> None:
    made = loop()
    found = points(exact_limit(plane(made, delay=[0.0, 0.001, 0.002], k=[50.0, 300.0, 1000.0])).pieces)
    at_steps = [(d, k) for d, k in found if abs(d * 1e4 - round(d * 1e4)) < 1e-9]
    assert at_steps
    for d, k in at_steps:
        assert k == pytest.approx(
            OneTickMap.from_scene(with_values(made, delay=round(d * 1e4) / 1e4)).stiffness_limit()
        )
    assert (np.diff(found[np.argsort(found[:, 0]), 1]) < 0).all()


@pytest.mark.slow
def test_without_a_stiffness_axis_the_line_is_where_the_scene_s_own_wall_is_at_its_limit() -> None:
    made = loop(clock={"round_trip_delay": 0.001})
    found = points(exact_limit(plane(made, b=[0.01, 0.1, 1.0], delay=[0.0, 0.002, 0.004, 0.006])).pieces)
    for b, d in found[::7]:
        ends = [math.floor(d * 1e4 + 1e-6), math.ceil(d * 1e4 - 1e-6)]
        growths = [OneTickMap.from_scene(with_values(made, b=b, delay=end / 1e4)).growth(100.0) for end in ends]
        assert min(growths) <= 1.0 + 1e-9
        assert max(growths) >= 1.0 - 1e-9


def test_the_stable_windows_of_an_inertia_are_all_outlined() -> None:
    made = loop(dissipation=[{"kind": "bidirectional-inertia", "mass": 0.005}])
    found = exact_limit(plane(made, m=[0.001, 0.005, 0.01, 0.02], k=np.geomspace(10.0, 1e5, 9).tolist()))
    for m, k in points(found.pieces)[::6]:
        ranges = OneTickMap.from_scene(with_values(made, m=m)).stable_ranges()
        assert min(abs(k - end) for pair in ranges for end in pair) <= 1e-7 * k


def test_one_axis_has_its_limit_as_a_place_on_it() -> None:
    made = loop()
    [[[k]]] = exact_limit(plane(made, k=[50.0, 100.0, 5000.0])).pieces
    assert k == pytest.approx(OneTickMap.from_scene(made).stiffness_limit(), rel=1e-9)


def test_rates_are_only_asked_for_at_their_own_values() -> None:
    made = loop()
    found = points(exact_limit(plane(made, rate=[500.0, 1000.0, 2000.0], k=[10.0, 500.0, 5000.0])).pieces)
    assert {x for x, _ in found} <= {500.0, 1000.0, 2000.0}
    for rate, k in found:
        there = with_value(made, "clock.control_rate", int(rate))
        assert k == pytest.approx(OneTickMap.from_scene(there).stiffness_limit(), rel=1e-7)


@pytest.mark.parametrize(
    ("tables", "why"),
    [
        ({"friction": {"kinetic": 0.1}}, r"\[friction\]"),
        ({"dissipation": [{"kind": "unidirectional-inertia", "mass": 0.01}]}, "the element unidirectional-inertia"),
    ],
)
def test_a_loop_that_is_not_linear_has_no_line_and_the_figure_says_why(tables: dict[str, Any], why: str) -> None:
    made = loop(**tables)
    with pytest.raises(NotLinear, match=why):
        exact_limit(plane(made, k=[50.0, 100.0, 5000.0], delay=[0.0, 0.001]))
    drawn = figure_over(made, {K: [50.0, 100.0, 5000.0], DELAY: [0.0, 0.001]})
    assert not artists(drawn, f"boundary {EXACT}")
    assert why.replace("\\", "") in legend(drawn)
    assert "not linear" in legend(drawn)


def test_a_limit_that_runs_outside_the_panel_is_told() -> None:
    drawn = figure_over(loop(), {K: [1.0, 2.0], DELAY: [0.0, 0.001]})
    assert not artists(drawn, f"boundary {EXACT}")
    assert f"Outside the panel: {EXACT}" in legend(drawn)


def test_a_scene_without_a_wall_or_of_a_plugin_has_no_lines() -> None:
    assert "there is no wall" in legend(figure_over(without(loop(), "wall"), {B: [0.1, 0.2], DELAY: [0.0, 0.001]}))
    foreign = replace(loop(), dissipation=(ElementTable(name="brake", parameters={"damping": 0.1}),))
    assert "the element brake comes from a plugin" in legend(figure_over(foreign, {K: [1.0, 2.0], DELAY: [0.0, 0.001]}))


def figure_over(made: Scene, axes: dict[str, list[float]]) -> Any:
    cells = cells_of(axes)
    return make_figure(table(axes, cells, [said("steady", 1e-7)] * len(cells), [made] * len(cells)))


def legend(drawn: Any) -> str:
    return " ".join(words(drawn, "legend"))


def test_bounds_are_drawn_where_they_apply_at_the_stiffness_they_allow() -> None:
    made = loop(clock={"round_trip_delay": 0.001})
    found = {bound.name: bound for bound in bound_lines(plane(made, b=[0.02, 0.05, 0.1, 0.2], k=[5.0, 500.0]))}
    assert {"Colgate & Schenkel 1997", "Gil et al. 2009"} <= set(found)
    assert "Abbott & Okamura 2005" not in found
    for name, boundary in found.items():
        for b, k in points(boundary.pieces)[::5] if boundary.pieces else ():
            [bound] = [one for one in bounds_of(with_values(made, b=b)) if one.name == name]
            assert bound.stiffness_N_m == pytest.approx(k, rel=1e-6)


@pytest.mark.slow
def test_a_line_has_its_name_beside_it_in_its_own_colour() -> None:
    drawn = figure_over(loop(), {B: [0.05, 0.1, 0.2, 0.4], K: np.linspace(20.0, 1500.0, 9).tolist()})
    named = {text.get_text(): text.get_color() for text in artists(drawn, "name of a line")}
    assert EXACT in named
    for name, colour in named.items():
        assert artists(drawn, f"boundary {name}")[0].get_color() == colour


def test_zero_lines_of_a_circle_lie_on_it_and_stop_where_there_is_no_level() -> None:
    """x^2 + y^2 = 1 on a coarse grid, known for y >= -0.5 alone."""
    grid = np.linspace(-1.3, 1.4, 12)

    def level(x: float, y: float) -> float:
        return x * x + y * y - 1.0 if y >= -0.5 else math.nan

    [line] = zero_lines(level, grid, grid, ON)
    on_edges = np.abs(np.hypot(line[:, 0], line[:, 1]) - 1.0)
    assert on_edges.max() < 1e-9
    assert line[:, 1].min() > -0.8
    assert np.abs(line).max() <= 1.0 + 1e-9


def test_points_between_values_that_are_no_scenes_are_left_where_the_grid_has_them() -> None:
    grid = np.array([0.0, 1.0, 2.0])
    [line] = zero_lines(lambda x, y: x * x - 0.5 + 0.0 * y, grid, grid, (False, False))
    assert line[:, 0].tolist() == pytest.approx([0.5] * len(line))
