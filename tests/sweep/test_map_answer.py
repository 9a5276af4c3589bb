"""The answer of a map, and its other words: what was swept, the stiffest steady wall, what is missing."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.protocol.scene.scene import Scene
from haploop.tools.linear.one_tick import OneTickMap
from haploop.tools.linear.stiffness_limit import pressed_deep
from haploop.tools.sweep.map.data import AMPLITUDE, VERDICTS, MapData
from haploop.tools.sweep.map.edges import stiffest_steady
from haploop.tools.sweep.map.figure import make_figure
from helpers.data.sweep_tables import (
    DAMPINGS,
    STIFFNESSES,
    B,
    K,
    cells_of,
    ran,
    said,
    table,
    with_all_kinds,
)
from helpers.scenes.least import scene
from helpers.shown import artists, words


@pytest.fixture(scope="module")
def data() -> MapData:
    return with_all_kinds()


@pytest.fixture(scope="module")
def figure(data: MapData) -> Any:
    return make_figure(data)


def legend(figure: Any) -> str:
    return " ".join(words(figure, "legend"))


def test_the_line_below_the_title_says_what_was_swept_from_what_and_what_came_of_it(figure: Any) -> None:
    assert words(figure, "title") == ["a sweep"]
    (line,) = words(figure, "description")
    for part in ("a base", "wall.stiffness 100–400 N/m (4)", "dissipation.0.damping 0.1–2 N s/m (5)", "seed 1"):
        assert part in line
    assert "20 cells: 5 steady, 4 no contact, 4 failed, 3 limit cycle, 4 diverged" in line


def test_failed_cells_say_why(figure: Any) -> None:
    assert "4 failed: A plugin raised." in legend(figure)


def test_the_stiffest_wall_below_which_all_are_steady_is_marked(figure: Any) -> None:
    """300 N/m is steady at 0.5 and 1 N s/m, the middle of which is the second; no contact below is no harm."""
    (star,) = artists(figure, "star")
    assert (star.get_xdata()[0], star.get_ydata()[0]) == (1.0, 300.0)
    assert words(figure, "star words") == ["steady up to 300 N/m"]
    assert "Stiffest steady wall: 300 N/m" in legend(figure)


def test_what_a_steady_verdict_rests_on_is_told_with_the_answer_and_counted() -> None:
    """The stiffest steady wall is held by friction alone, and so is another one."""
    axes = {K: STIFFNESSES[:3], B: [0.1, 0.2]}
    held = {"provisos": ["only friction holds it"]}
    results = [said("steady"), said("steady") | held, said("limit-cycle", 1e-3), said("steady") | held]
    results += [said("limit-cycle", 1e-3), said("limit-cycle", 1e-3)]
    told = legend(make_figure(table(axes, cells_of(axes), results, [None] * 6)))
    assert "Stiffest steady wall: 200 N/m at dissipation.0.damping 0.2 N s/m" in told
    assert "Condition: only friction holds it." in told
    assert "Conditions of the steady runs: only friction holds it (2)." in told
    assert "No run was pushed" not in told
    assert "Every run has the hand and the hold of its scene; haploop advise tries others." in told
    assert "was not recorded" not in told


def test_of_a_table_without_what_its_verdicts_rest_on_the_map_says_so() -> None:
    data = table({K: STIFFNESSES}, cells_of({K: STIFFNESSES}), [said("steady")] * 4, [None] * 4)
    columns = {name: column for name, column in data.columns.items() if name != "stability.provisos"}
    told = legend(make_figure(dataclasses.replace(data, columns=columns)))
    assert "What the steady runs rest on was not recorded." in told


@pytest.mark.slow
def test_a_map_of_cheap_verdicts_says_that_no_run_was_pushed(data: MapData) -> None:
    cheap = dataclasses.replace(data, sweep={**data.sweep, "base": {"title": "a base", "run": {"verdict": "window"}}})
    told = legend(make_figure(cheap))
    assert "No run was pushed: the words describe its last half second" in told
    assert "Stiffest wall on which no swing was seen: 300 N/m" in told
    assert "swinging: swing, peak to peak" in told
    assert not any(word in told for word in ("steady", "limit cycle:"))


@given(verdicts=st.lists(st.sampled_from(VERDICTS), min_size=12, max_size=12))
def test_an_island_of_steady_walls_above_others_that_are_not_is_no_answer(verdicts: list[str]) -> None:
    axes = {K: STIFFNESSES, B: [0.1, 0.2, 0.5]}
    results = [said(None if word == "failed" else word, 1e-3) for word in verdicts]
    data = table(axes, cells_of(axes), results, [None] * 12)
    found = stiffest_steady(data.axes, data.cells())
    best = -1
    for i in range(3):
        column = verdicts[i::3]
        harmless = list(itertools.takewhile(lambda word: word in ("steady", "no-contact"), column))
        best = max([best, *(j for j, word in enumerate(harmless) if word == "steady")])
    if found is None:
        assert best == -1
    else:
        assert found.index[0] == best
        assert found.open_end == (best == 3)


def test_the_answer_is_not_written_on_cells_that_are_not_steady() -> None:
    """Of five columns the last alone is steady, too narrow for the long words."""
    axes = {K: STIFFNESSES, B: [0.0, 2.0, 4.0, 6.0, 8.0]}
    results = [said("steady" if b == 8.0 else "limit-cycle", 1e-3) for _ in STIFFNESSES for b in axes[B]]
    drawn = make_figure(table(axes, cells_of(axes), results, [None] * len(results)))
    (label,) = artists(drawn, "star words")
    assert label.get_text() == f"≥ {STIFFNESSES[-1]:.0f} N/m"
    assert label.axes.transData.inverted().transform(label.get_window_extent().min)[0] > 7.0


def test_all_failed_says_so_and_marks_no_answer() -> None:
    axes = {K: STIFFNESSES, B: DAMPINGS}
    drawn = make_figure(table(axes, cells_of(axes), [said(None)] * 20, [None] * 20))
    assert not artists(drawn, "star")
    assert "20 failed: A plugin raised." in legend(drawn)
    assert "No wall is steady" in legend(drawn)


@pytest.mark.slow
def test_amplitudes_that_were_not_recorded_are_missed_aloud(data: MapData) -> None:
    columns = {name: column for name, column in data.columns.items() if name != AMPLITUDE}
    drawn = make_figure(dataclasses.replace(data, columns=columns))
    assert not artists(drawn, "amplitudes")
    assert "How far limit cycles swing was not recorded." in legend(drawn)


def test_no_text_of_the_figure_covers_another(figure: Any) -> None:
    texts = [text for gid in ("title", "description", "legend", "star words") for text in artists(figure, gid)]
    texts += artists(figure, "name of a line")
    boxes = [text.get_window_extent() for text in texts]
    for (a, one), (b, other) in itertools.combinations(zip(texts, boxes, strict=True), 2):
        assert not one.overlaps(other), (a.get_text(), b.get_text())
    width, height = figure.bbox.width, figure.bbox.height
    assert all(box.x0 >= 0 and box.x1 <= width and box.y0 >= 0 and box.y1 <= height for box in boxes)


def test_the_figure_is_a_screen_wide(figure: Any) -> None:
    assert figure.get_figwidth() * figure.dpi == pytest.approx(1280, abs=2)


def test_runs_of_the_program_make_a_map_that_the_exact_limit_divides() -> None:
    """Walls well below the limit of their linear loop come out steady, well above it not."""

    def made(cell: dict[str, Any]) -> Scene:
        loop = scene(device={"mass": 0.02, "damping": 0.4}, dissipation=[{"kind": "damping", "damping": cell[B]}])
        return pressed_deep(loop, cell[K] * OneTickMap.from_scene(loop).stiffness_limit())

    data = ran({K: [0.5, 0.8, 1.2, 1.5], B: [0.1, 0.5]}, made)
    assert data.cells().verdict[:2].max() == VERDICTS.index("steady")
    assert data.cells().verdict[2:].min() >= VERDICTS.index("limit-cycle")
