"""Axes of the map of a sweep: scale, unit, names, and the places of values."""

from __future__ import annotations

import numpy as np
import pytest

from haploop.launch.scene.toml_writer import inline
from haploop.tools.sweep.map.axis import Axis

K = "wall.stiffness"


@pytest.mark.parametrize(
    ("values", "scale"),
    [
        ([1.0, 2.0, 3.0], "linear"),
        ([0.01, 0.1, 1.0, 10.0], "log"),
        ([1.0, 2.0, 5.0, 10.0], "log"),
        ([0.0, 0.01, 0.1, 1.0], "even"),
        ([-2.0, -1.0, 0.0], "linear"),
        ([5.0], "linear"),
    ],
)
def test_the_scale_follows_the_values(values: list[float], scale: str) -> None:
    axis = Axis.from_column("wall.stiffness", "N/m", values)
    assert axis.scale == scale
    assert (np.diff(axis.edges) > 0).all()
    assert all(low < at < high for low, at, high in zip(axis.edges, axis.coordinates, axis.edges[1:], strict=False))


def test_no_cell_reaches_below_0_where_no_value_is() -> None:
    axis = Axis.from_column("dissipation.0.damping", "N s/m", [0.0, 2.0, 4.0])
    assert axis.edges.tolist() == [0.0, 1.0, 3.0, 5.0]
    assert Axis.from_column("wall.position", "m", [-1.0, 1.0, 3.0]).edges[0] == -2.0


def test_short_times_are_written_in_milliseconds_where_they_belong() -> None:
    axis = Axis.from_column("clock.round_trip_delay", "s", [0.0, 0.001, 0.002])
    assert axis.label == "clock.round_trip_delay (ms)"
    assert axis.coordinates.tolist() == pytest.approx([0.0, 1.0, 2.0])
    assert axis.word(2) == "2 ms"


def test_lists_of_elements_make_panels_with_names_that_can_be_read() -> None:
    lists = [[], [{"kind": "damping", "damping": 0.8}], [{"kind": "brake"}, {"kind": "damping", "damping": 0.25}]]
    axis = Axis.from_column("dissipation", "", [inline(one) for one in lists[:2]], lists)
    assert [axis.word(number) for number in range(3)] == ["none", "damping 0.8", "brake + damping 0.25"]
    assert axis.indices([inline(lists[1])]).tolist() == [1]


def test_switches_and_great_numbers_are_written_as_scenes_have_them() -> None:
    assert Axis.from_column("run.pin", "", [np.bool_(True), np.bool_(False)], [True, False]).names == ("true", "false")
    assert Axis.from_column(K, "N/m", [20_000.0]).word(0) == "20000 N/m"


def test_values_that_were_planned_but_not_run_have_their_place() -> None:
    axis = Axis.from_column(K, "N/m", [200.0], [100.0, 200.0, 300.0])
    assert axis.values.tolist() == [100.0, 200.0, 300.0]
    assert axis.indices([200.0]).tolist() == [1]
