"""The panels of a map: one for each combination of further axes, the oscillation along one axis, single cells."""

from __future__ import annotations

import math
from typing import Any

import pytest

from haploop.tools.sweep.map.data import VERDICTS
from haploop.tools.sweep.map.figure import make_figure
from haploop.tools.sweep.map.looks import LOOKS
from helpers.data.sweep_tables import (
    DAMPINGS,
    STIFFNESSES,
    WITH_DAMPING,
    B,
    K,
    cells_of,
    said,
    table,
)
from helpers.shown import artists, words


def legend(figure: Any) -> str:
    return " ".join(words(figure, "legend"))


@pytest.mark.slow
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


@pytest.mark.slow
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


def test_what_does_not_swing_lies_below_every_number_and_is_called_none() -> None:
    results = [said("steady", 0.0), said("steady", 1e-16), said("limit-cycle", 1e-3), said("limit-cycle", 2e-3)]
    drawn = make_figure(table({K: STIFFNESSES}, cells_of({K: STIFFNESSES}), results, [None] * 4))
    (steady,) = artists(drawn, "cells steady")
    (none,) = artists(drawn, "none")
    assert set(steady.get_ydata()) == {none.get_position()[1]}
    assert none.get_position()[1] < 0.5e-3
    drawn.draw_without_rendering()
    labelled = [tick for tick in drawn.axes[0].yaxis.get_major_ticks() if tick.label1.get_text()]
    assert min(tick.get_loc() for tick in labelled) > none.get_position()[1]
    swinging = make_figure(table({K: STIFFNESSES}, cells_of({K: STIFFNESSES}), results[2:] * 2, [None] * 4))
    assert not artists(swinging, "none")


@pytest.mark.parametrize("axes", [{K: STIFFNESSES[:2], B: DAMPINGS[:2]}, {K: STIFFNESSES}])
def test_steady_cells_with_a_proviso_are_hatched_and_counted(axes: dict[str, list[float]]) -> None:
    """Of the cells the first is plainly steady, the second rests on friction, the others swing."""
    held = {"provisos": ["only friction holds it"]}
    results = [said("steady", 1e-7), said("steady", 1e-7) | held, *[said("limit-cycle", 1e-4)] * 2]
    drawn = make_figure(table(axes, cells_of(axes), results, [WITH_DAMPING] * 4))
    assert "of these with a condition: 1" in legend(drawn)
    if len(axes) == 2:
        (patch,) = artists(drawn, "hatch with a proviso")
        assert len(patch.get_path().vertices) == 5  # one rectangle
        return
    assert [bool(span.get_hatch()) for span in artists(drawn, "steady")] == [False, True]
