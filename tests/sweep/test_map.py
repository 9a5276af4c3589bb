"""The map of a sweep shows what its table holds: every cell in its place, and the worst of its seeds."""

from __future__ import annotations

import dataclasses
import itertools
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from haploop.tools.figure.data import FigureError
from haploop.tools.figure.style import write_figure
from haploop.tools.sweep.map.data import NOT_RUN, VERDICTS, WIDTH, MapData, make_map_data
from haploop.tools.sweep.map.figure import make_figure
from haploop.tools.sweep.map.looks import LOOKS
from helpers.data.sweep_tables import (
    DAMPINGS,
    STIFFNESSES,
    B,
    K,
    cells_of,
    result_of,
    said,
    table,
    with_all_kinds,
)
from helpers.shown import artists, words


@pytest.fixture(scope="module")
def data() -> MapData:
    return with_all_kinds()


@pytest.fixture(scope="module")
def figure(data: MapData) -> Any:
    return make_figure(data)


def test_every_cell_has_the_verdict_of_its_row_with_stiffness_upwards(data: MapData, figure: Any) -> None:
    (mesh,) = artists(figure, "verdicts")
    shown = mesh.get_array().reshape(len(STIFFNESSES), len(DAMPINGS))
    for (j, k), (i, b) in itertools.product(enumerate(STIFFNESSES), enumerate(DAMPINGS)):
        expected = result_of({K: k, B: b}).get("verdict", "failed")
        assert VERDICTS[shown[j, i]] == expected
    (ax, *_) = figure.axes
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("dissipation.0.damping (N s/m)", "wall.stiffness (N/m)")


def test_limit_cycles_alone_have_the_colour_of_their_amplitude(figure: Any) -> None:
    (mesh,) = artists(figure, "amplitudes")
    shown = mesh.get_array().reshape(len(STIFFNESSES), len(DAMPINGS))
    for (j, k), (i, b) in itertools.product(enumerate(STIFFNESSES), enumerate(DAMPINGS)):
        result = result_of({K: k, B: b})
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


@pytest.mark.slow
def test_forty_thousand_cells_are_one_mesh() -> None:
    axes = {K: np.linspace(1.0, 200.0, 200).tolist(), B: np.geomspace(0.01, 10.0, 200).tolist()}
    cells = cells_of(axes)
    results = [said("steady" if cell[K] < 100.0 * cell[B] else "limit-cycle", 1e-3) for cell in cells]
    drawn = make_figure(table(axes, cells, results, [None] * len(cells)))
    (mesh,) = artists(drawn, "verdicts")
    shown = mesh.get_array().reshape(200, 200)
    expected = np.greater.outer(axes[K], 0) & (np.array(axes[K])[:, None] < 100.0 * np.array(axes[B]))
    assert ((shown == VERDICTS.index("steady")) == expected).all()


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


@pytest.mark.slow
def test_the_file_of_a_map_is_a_picture(data: MapData, tmp_path: Path) -> None:
    assert write_figure(make_figure(data), tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
