"""The map of a sweep shows what its table holds: every cell in its place, the worst of its seeds, and the answer."""

from __future__ import annotations

import dataclasses
import itertools
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.protocol.scene.scene import Scene
from haploop.tools.figure.data import FigureError
from haploop.tools.figure.style import write_figure
from haploop.tools.linear.one_tick import OneTickMap
from haploop.tools.linear.stiffness_limit import pressed_deep
from haploop.tools.sweep.map.data import AMPLITUDE, NOT_RUN, VERDICTS, WIDTH, MapData, make_map_data
from haploop.tools.sweep.map.edges import stiffest_steady
from haploop.tools.sweep.map.figure import make_figure
from haploop.tools.sweep.map.legend import LOOKS
from helpers.data.sweep_tables import cells_of, ran, said, table
from helpers.scenes.least import scene
from helpers.shown import artists

K, B = "wall.stiffness", "dissipation.0.damping"
STIFFNESSES, DAMPINGS = [100.0, 200.0, 300.0, 400.0], [0.1, 0.2, 0.5, 1.0, 2.0]
WITH_DAMPING = scene(
    title="a base", wall={"position": -0.001, "stiffness": 100.0}, dissipation=[{"kind": "damping", "damping": 0.1}]
)


def all_kinds(cell: dict[str, Any]) -> dict[str, Any]:
    """A result of every kind, by place."""
    k, b = cell[K], cell[B]
    if b == 2.0:
        return said(None)
    if k == 400.0:
        return said("diverged", math.inf)
    if k / b > 1000.0:
        return said("limit-cycle", 1e-6 * k / b)
    return said("no-contact" if k == 100.0 else "steady", 1e-7)


def with_all_kinds(title: str = "a sweep") -> MapData:
    axes = {K: STIFFNESSES, B: DAMPINGS}
    cells = cells_of(axes)
    return table(axes, cells, [all_kinds(cell) for cell in cells], [WITH_DAMPING] * len(cells), title)


@pytest.fixture(scope="module")
def data() -> MapData:
    return with_all_kinds()


@pytest.fixture(scope="module")
def figure(data: MapData) -> Any:
    return make_figure(data)


def words(figure: Any, gid: str) -> list[str]:
    return [text.get_text() for text in artists(figure, gid)]


def legend(figure: Any) -> str:
    return " ".join(words(figure, "legend"))


def test_every_cell_has_the_verdict_of_its_row_with_stiffness_upwards(data: MapData, figure: Any) -> None:
    (mesh,) = artists(figure, "verdicts")
    shown = mesh.get_array().reshape(len(STIFFNESSES), len(DAMPINGS))
    for (j, k), (i, b) in itertools.product(enumerate(STIFFNESSES), enumerate(DAMPINGS)):
        expected = all_kinds({K: k, B: b}).get("verdict", "failed")
        assert VERDICTS[shown[j, i]] == expected
    (ax, *_) = figure.axes
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("dissipation.0.damping (N s/m)", "wall.stiffness (N/m)")


def test_limit_cycles_alone_have_the_colour_of_their_amplitude(figure: Any) -> None:
    (mesh,) = artists(figure, "amplitudes")
    shown = mesh.get_array().reshape(len(STIFFNESSES), len(DAMPINGS))
    for (j, k), (i, b) in itertools.product(enumerate(STIFFNESSES), enumerate(DAMPINGS)):
        result = all_kinds({K: k, B: b})
        if result.get("verdict") == "limit-cycle":
            assert shown[j, i] == result["window"]["oscillation_m"]
        else:
            assert np.ma.is_masked(shown[j, i])
    assert mesh.norm.vmin <= 1.5e-3 < 3e-3 <= mesh.norm.vmax


def test_a_limit_cycle_is_as_wide_as_it_swings_on_after_its_push_and_all_else_as_it_ended(data: MapData) -> None:
    width_m = [1e-6 * k for k in data.columns[K]]
    judged = dataclasses.replace(data, columns={**data.columns, WIDTH: width_m})
    cycles = data.verdicts == VERDICTS.index("limit-cycle")
    np.testing.assert_array_equal(judged.amplitudes_m(), np.where(cycles, width_m, data.amplitudes_m()))
    assert cycles.any()
    assert not cycles.all()


def test_cells_lie_around_their_values_on_a_logarithmic_axis_too(figure: Any) -> None:
    (mesh,) = artists(figure, "verdicts")
    x, y = mesh.get_coordinates()[0, :, 0], mesh.get_coordinates()[:, 0, 1]
    assert all(low < value < high for low, value, high in zip(x, DAMPINGS, x[1:], strict=False))
    assert all(low < value < high for low, value, high in zip(y, STIFFNESSES, y[1:], strict=False))
    assert figure.axes[0].get_xscale() == "log"
    assert x[1] / 0.1 == pytest.approx(0.2 / x[1])


def test_verdicts_are_told_apart_without_colour(figure: Any) -> None:
    """Each but steady and limit cycle has a hatching; the lightest limit cycle is darker than steady, and outlined."""
    for verdict in ("no-contact", "failed", "diverged"):
        (patch,) = artists(figure, f"hatch {verdict}")
        assert patch.get_hatch() == LOOKS[VERDICTS.index(verdict)].hatch
    hatches = [look.hatch for look in LOOKS.values() if look.hatch]
    assert len(set(hatches)) == len(hatches) == 5
    (mesh,) = artists(figure, "amplitudes")
    lightest = max(lightness(mesh.cmap(share)) for share in np.linspace(0.0, 1.0, 9))
    assert lightness(LOOKS[0].fill) - lightest > 0.15
    assert artists(figure, "edge of steady")
    assert len({look.marker for look in LOOKS.values()}) == len(LOOKS)


def lightness(colour: Any) -> float:
    """Relative luminance, 0 to 1."""
    from matplotlib.colors import to_rgb

    return float(np.dot(to_rgb(colour), (0.2126, 0.7152, 0.0722)))


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


def test_a_cell_shows_its_worst_seed_and_how_many_agree_where_they_do_not() -> None:
    axes = {K: [100.0, 200.0], B: [0.1, 0.2]}
    cells = cells_of(axes, seeds=3)

    def result(cell: dict[str, Any]) -> dict[str, Any]:
        if cell[K] == 200.0 and cell["seed"] <= (1 if cell[B] == 0.1 else 2):
            return said("limit-cycle", cell["seed"] * 1e-3)
        return said("steady", 1e-7)

    data = table(axes, cells, [result(cell) for cell in cells], [None] * len(cells))
    drawn = make_figure(data)
    assert sorted(words(drawn, "seeds disagree")) == ["1/3", "2/3"]
    shown = [VERDICTS[number] for number in artists(drawn, "verdicts")[0].get_array().ravel()]
    assert shown == ["steady", "steady", "limit-cycle", "limit-cycle"]
    assert artists(drawn, "amplitudes")[0].get_array().compressed().tolist() == [1e-3, 2e-3]
    assert "3 seeds" in words(drawn, "description")[0]


def test_rows_in_any_order_and_a_sweep_that_still_runs_give_the_cells_that_are_there(data: MapData) -> None:
    order = np.random.default_rng(1).permutation(20)[:13]
    columns = {name: [column[row] for row in order] for name, column in data.columns.items()}
    part = make_map_data(columns, {K: "N/m"}, data.sweep)
    whole, some = data.cells(), part.cells()
    there = some.verdict != NOT_RUN
    assert there.sum() == 13
    assert (some.verdict[there] == whole.verdict[there]).all()
    drawn = make_figure(part)
    assert np.ma.count_masked(artists(drawn, "verdicts")[0].get_array()) == 7
    assert "7 not run yet" in words(drawn, "description")[0]


def test_names_and_third_axes_make_panels_with_one_scale() -> None:
    kinds = ["damping", "bidirectional-inertia", "unidirectional-inertia"]
    axes = {"dissipation.0.kind": kinds, K: STIFFNESSES, B: DAMPINGS}
    cells = cells_of(axes)
    results = [said("limit-cycle", 1e-6 * cell[K] * (1 + kinds.index(cell["dissipation.0.kind"]))) for cell in cells]
    drawn = make_figure(table(axes, cells, results, [None] * len(cells)))
    meshes = artists(drawn, "amplitudes")
    assert len(meshes) == 3
    assert len({(mesh.norm.vmin, mesh.norm.vmax) for mesh in meshes}) == 1
    for number, mesh in enumerate(meshes):
        assert mesh.get_array().max() == pytest.approx(4e-4 * (number + 1))
    titles = [ax.get_title(loc="left") for ax in drawn.axes[:3]]
    assert [kind in title for kind, title in zip(kinds, titles, strict=True)] == [True] * 3


def test_more_panels_than_have_room_are_left_out_and_counted() -> None:
    axes = {K: STIFFNESSES[:2], B: DAMPINGS[:2], "dissipation.0.kind": [f"kind-{number}" for number in range(14)]}
    cells = cells_of(axes)
    drawn = make_figure(table(axes, cells, [said("steady", 1e-7)] * len(cells), [None] * len(cells)))
    assert len(artists(drawn, "verdicts")) == 12
    assert "The first 12 of 14 panels are drawn." in legend(drawn)


def test_one_axis_shows_the_amplitude_of_every_cell_with_the_sign_of_its_verdict() -> None:
    results = [said("steady", 1e-6), said("limit-cycle", 1e-4), said("diverged", math.inf), said(None)]
    drawn = make_figure(table({K: STIFFNESSES}, cells_of({K: STIFFNESSES}), results, [None] * 4))
    seen = {}
    for verdict in VERDICTS:
        for line in artists(drawn, f"cells {verdict}"):
            assert line.get_marker() == LOOKS[VERDICTS.index(verdict)].marker
            seen |= {x: (verdict, y) for x, y in zip(line.get_xdata(), line.get_ydata(), strict=True)}
    assert [seen[k][0] for k in STIFFNESSES] == ["steady", "limit-cycle", "diverged", "failed"]
    assert [seen[k][1] for k in STIFFNESSES[:2]] == [1e-6, 1e-4]
    assert all(1e-4 < seen[k][1] < drawn.axes[0].get_ylim()[1] for k in STIFFNESSES[2:])
    assert len(artists(drawn, "steady")) == 1
    assert "steady up to 100 N/m" in words(drawn, "star words")[0]


@pytest.mark.parametrize("axes", [{K: [150.0]}, {K: [150.0], B: [0.5]}, {K: [100.0, 200.0], B: [0.5]}])
@pytest.mark.parametrize("result", [said("steady", 1e-7), said(None), said("limit-cycle", math.nan)])
def test_a_single_cell_or_column_and_cells_without_a_number_are_drawn(
    axes: dict[str, list[float]], result: dict[str, Any]
) -> None:
    cells = cells_of(axes)
    drawn = make_figure(table(axes, cells, [result] * len(cells), [WITH_DAMPING] * len(cells)))
    drawn.draw_without_rendering()
    assert not artists(drawn, "amplitudes")
    verdict = result.get("verdict", "failed").replace("-", " ")
    assert verdict in words(drawn, "description")[0]


def test_all_failed_says_so_and_marks_no_answer() -> None:
    axes = {K: STIFFNESSES, B: DAMPINGS}
    drawn = make_figure(table(axes, cells_of(axes), [said(None)] * 20, [None] * 20))
    assert not artists(drawn, "star")
    assert "20 failed: A plugin raised." in legend(drawn)
    assert "No wall is steady" in legend(drawn)


def test_forty_thousand_cells_are_one_mesh() -> None:
    axes = {K: np.linspace(1.0, 200.0, 200).tolist(), B: np.geomspace(0.01, 10.0, 200).tolist()}
    cells = cells_of(axes)
    results = [said("steady" if cell[K] < 100.0 * cell[B] else "limit-cycle", 1e-3) for cell in cells]
    drawn = make_figure(table(axes, cells, results, [None] * len(cells)))
    (mesh,) = artists(drawn, "verdicts")
    shown = mesh.get_array().reshape(200, 200)
    expected = np.greater.outer(axes[K], 0) & (np.array(axes[K])[:, None] < 100.0 * np.array(axes[B]))
    assert ((shown == VERDICTS.index("steady")) == expected).all()


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


def test_without_verdicts_or_rows_or_matplotlib_there_is_no_map_and_a_reason(
    data: MapData, monkeypatch: pytest.MonkeyPatch
) -> None:
    without = {name: column for name, column in data.columns.items() if name != "verdict"}
    with pytest.raises(FigureError, match='add "verdict" to its record'):
        make_map_data(without, {}, data.sweep)
    with pytest.raises(FigureError, match="no finished cell"):
        make_map_data({name: [] for name in data.columns}, {}, data.sweep)
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(FigureError, match=r"pip install 'haploop\[plot\]'"):
        make_figure(data)


def test_amplitudes_that_were_not_recorded_are_missed_aloud(data: MapData) -> None:
    columns = {name: column for name, column in data.columns.items() if name != AMPLITUDE}
    drawn = make_figure(dataclasses.replace(data, columns=columns))
    assert not artists(drawn, "amplitudes")
    assert "How far limit cycles swing was not recorded." in legend(drawn)


def test_the_file_of_a_map_is_a_picture(data: MapData, tmp_path: Path) -> None:
    assert write_figure(make_figure(data), tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")


def test_runs_of_the_program_make_a_map_that_the_exact_limit_divides() -> None:
    """Walls well below the limit of their linear loop come out steady, well above it not."""

    def made(cell: dict[str, Any]) -> Scene:
        loop = scene(device={"mass": 0.02, "damping": 0.4}, dissipation=[{"kind": "damping", "damping": cell[B]}])
        return pressed_deep(loop, cell[K] * OneTickMap.from_scene(loop).stiffness_limit())

    data = ran({K: [0.5, 0.8, 1.2, 1.5], B: [0.1, 0.5]}, made)
    assert data.cells().verdict[:2].max() == VERDICTS.index("steady")
    assert data.cells().verdict[2:].min() >= VERDICTS.index("limit-cycle")
