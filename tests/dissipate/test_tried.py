"""Without an element those at hand are tried, at sizes of equal largest force."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from haploop.tools.cli.app import app
from haploop.tools.dissipate.outcome import EQUAL_N
from haploop.tools.dissipate.report import make_report
from helpers.data.recordings import T, X, outcome, write
from helpers.shown import shown


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return write(tmp_path / "swing.csv", {"t": T, "x": X})


def test_each_is_tried_at_the_size_of_the_same_largest_force_and_takes_what_it_does_where_it_is_named(
    path: Path,
) -> None:
    tried = {each.kind: each for each in outcome(path).tried}
    assert set(tried) == {"damping", "bidirectional-inertia", "unidirectional-inertia"}
    for each in tried.values():
        [size] = (value for name, value in each.parameters.items() if name != "acts")
        named: dict[str, Any] = {"dampings" if each.kind == "damping" else "masses": [str(size)]}
        [again] = (one for one in outcome(path, **named).elements if one.kind == each.kind)
        assert again.strongest_N == pytest.approx(EQUAL_N, rel=0.01)
        assert again.true_J == pytest.approx(each.true_J, rel=0.01)
        assert again.label == each.label


def test_they_are_told_best_first_and_only_where_no_element_was_named(path: Path) -> None:
    found = outcome(path)
    assert [each.true_J for each in found.tried] == sorted((each.true_J for each in found.tried), reverse=True)
    assert found.tried[0].kind == "damping"
    said = shown(make_report(found), 200)
    assert "100 mN at most" in said
    assert all(each.label in said for each in found.tried)
    named = outcome(path, dampings=["2"])
    assert named.tried == ()
    assert "at most" not in shown(make_report(named), 200)
    data = json.loads(CliRunner().invoke(app, ["dissipate", str(path), "--json"]).stdout)
    assert [each["kind"] for each in data["tried"]] == [each.kind for each in found.tried]


def test_damping_on_the_way_in_is_tried_where_there_is_a_wall_and_nothing_on_a_device_at_rest(
    tmp_path: Path, path: Path
) -> None:
    assert "unidirectional-damping" in {each.kind for each in outcome(path, wall="0").tried}
    still = write(tmp_path / "still.csv", {"t": T, "x": np.zeros(len(T))})
    assert outcome(still).tried == ()
