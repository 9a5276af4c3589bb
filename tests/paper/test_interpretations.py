"""Interpretations of what the paper leaves open: they keep what it states, and the measure tells how near they come."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.check import resolve
from haploop.launch.scene.file import load
from haploop.launch.scene.reading.layers import Layers
from haploop.protocol.scene.estimators import Acceleration
from haploop.protocol.scene.paths import without
from haploop.protocol.scene.scene import Scene
from haploop.tools.search.random import Point
from haploop.tools.studies.choi2022.figures.figure_6 import scene_text
from haploop.tools.studies.choi2022.figures.work import Work
from haploop.tools.studies.choi2022.interpretations import MOST, decider, options, share
from haploop.tools.studies.choi2022.runs import fig6
from haploop.tools.studies.choi2022.simulation import (
    BASE,
    CLAIMS,
    SMALL_M,
    SPACE,
    Extent,
    as_row,
    measure,
    over,
    scene_of,
)
from helpers.scenes.least import KINDS

SCENES = Path(__file__).parents[2] / "launch/scenes"
# What the paper leaves open (section V.A), beside title, duration, the encoder's step and where the elements act.
OPEN = ("seed", "noise", "velocity", "acceleration", "accelerometer", "hand.rest", "hand.force", "encoder.rounding")


def stated(scene: Scene) -> Scene:
    """The scene with all that the paper leaves open at one value."""
    assert scene.encoder
    encoder = replace(scene.encoder, resolution=1e-5)
    elements = tuple(replace(element, acts="always") for element in scene.dissipation)
    return without(replace(scene, title="", duration=3.0, encoder=encoder, dissipation=elements), *OPEN)


def drawn(seed: int = 1, structures: int = 30, each: int = 1) -> list[Point]:
    groups = SPACE.draw(np.random.default_rng(seed), structures, each)
    return [point for group in groups for point in group]


def test_our_own_interpretation_is_what_the_scene_files_say() -> None:
    for panel in "abc":
        assert scene_of(BASE, panel) == replace(fig6(panel), acceleration=Acceleration())


@pytest.mark.parametrize("panel", ["a", "b", "c"])
def test_no_interpretation_touches_what_the_paper_states_and_every_one_can_be_run(panel: str) -> None:
    for interpretation in drawn():
        scene = scene_of(interpretation, panel)
        assert stated(scene) == stated(fig6(panel))
        assert resolve(Layers(Path("scene.toml"), scene.as_dict()), KINDS) == scene


def test_interpretations_are_drawn_within_their_bounds_with_every_option_as_often_and_again_the_same() -> None:
    points = drawn(structures=60, each=2)
    assert points == drawn(structures=60, each=2) != drawn(seed=2, structures=60, each=2)
    for key, names in SPACE.choices.items():
        counts = [sum(point.choices[key] == name for point in points) for name in names]
        assert set(counts) == {len(points) // len(names)}
    near = [one for point in points for one in SPACE.neighbours(np.random.default_rng(3), point, 2.0, 1)]
    for point in [*points, *near]:
        assert all(low <= point.numbers[key] <= high for key, (low, high) in SPACE.bounds.items())


def test_numbers_that_an_interpretation_does_not_use_are_no_numbers_in_its_row() -> None:
    row = as_row(BASE)
    assert math.isnan(row["noise_m"])
    assert math.isnan(row["velocity_Hz"])
    assert (row["push_N"], row["rise_s"], row["resolution_m"]) == (0.05, 1.0, 1e-5)


def test_a_scene_file_of_an_interpretation_reads_back_to_its_scene(tmp_path: Path) -> None:
    for panel in "abc":
        (tmp_path / f"fig6{panel}.toml").write_text(f'extends = "{SCENES / f"fig6{panel}.toml"}"\n', encoding="utf-8")
    (tmp_path / "paper").mkdir()
    for interpretation in drawn(structures=12):
        for panel in "abc":
            file = tmp_path / "paper/scene.toml"
            file.write_text(scene_text(Work(tmp_path, 6), interpretation, panel), encoding="utf-8")
            read = without(load(file), "accelerometer")  # which is there where it is read, and ideal
            assert replace(read, title="") == replace(scene_of(interpretation, panel), title="")


def test_a_shortfall_is_the_logarithm_of_the_missing_factor() -> None:
    assert over(1.0, 2.0) == over(2.0, 2.0) == 0.0
    assert over(2.0 * math.e, 2.0) == pytest.approx(1.0)
    assert over(1e9, 1.0) == over(1.0, 0.0) == over(math.inf, 1.0) == MOST


def test_a_book_is_measured_by_its_end_its_least_and_its_greatest_fall() -> None:
    assert Extent.from_book(np.array([0.0, 3.0, 1.0, 5.0, -1.0, 4.0])) == (4.0, -1.0, 6.0)


def test_the_measure_finds_of_our_own_interpretation_what_its_runs_are_known_to_do() -> None:
    """(a) cycles 4.7 mm wide, (b) is steady, (c) cycles beyond the wall: as README.md tells."""
    [row] = measure([BASE])
    held = {claim for claim in CLAIMS if row[claim] == 0.0}
    assert {"a cycles", "a bounded", "a small", "wall unstable", "b bounded", "b helps"} <= held
    assert not {"b large", "b leaves", "c steadied", "c smaller"} & held
    assert row["swing a_m"] == pytest.approx(4.74e-3, abs=2e-5)
    assert row["swing b_m"] < 1e-4
    assert row["holding"] == len(held)
    assert row["distance"] == pytest.approx(sum(min(MOST, row[claim]) for claim in CLAIMS))


@pytest.mark.slow
def test_interpretations_together_come_to_what_each_comes_to_alone() -> None:
    group = SPACE.draw(np.random.default_rng(7), 1, 3)[0]
    assert measure(group) == [measure([one])[0] for one in group]


def row(**found: Any) -> dict[str, Any]:
    row = as_row(BASE) | dict.fromkeys(CLAIMS, 0.0) | found
    return row | {"all": float(any(row[name] for name in CLAIMS))}


def test_what_decides_is_the_dimension_whose_options_differ_most() -> None:
    rows = [row(velocity="low-passed") for _ in range(30)] + [row(**{"b large": 1.0}) for _ in range(30)]
    found = decider(options(rows, SPACE), "b large")
    assert found
    assert (found.best.dimension, found.best.name, found.worst.name) == ("velocity", "low-passed", "difference")
    assert found.shares == (1.0, 0.0)
    assert share(rows, "all") == 0.5


@pytest.mark.parametrize("panel", ["a", "b", "c"])
def test_the_scene_files_of_the_nearest_interpretation_keep_what_the_paper_states(panel: str) -> None:
    assert stated(load(SCENES / f"paper/fig6{panel}_nearest.toml")) == stated(fig6(panel))


@pytest.mark.slow
def test_under_the_nearest_interpretation_figure_6_comes_out_as_docs_paper_says() -> None:
    """(a) cycles and is small; (b) leaves the wall, but is no wider; (c) stays inside, half as wide as (b) or less."""
    runs = {panel: run_in_process(load(SCENES / f"paper/fig6{panel}_nearest.toml"), KINDS) for panel in "abc"}
    swing = {panel: summary["window"]["oscillation_m"] for panel, summary in runs.items()}
    assert runs["a"]["verdict"] == runs["b"]["verdict"] == "limit-cycle"
    assert swing["a"] <= SMALL_M
    assert swing["b"] < 2.0 * swing["a"]
    assert runs["b"]["window"]["outside_fraction"] > 0.0
    assert runs["c"]["window"]["outside_fraction"] == 0.0
    assert swing["c"] <= swing["b"] / 2.0
    assert runs["c"]["energy"]["elements"][0]["sampled_J"] > 0.0
