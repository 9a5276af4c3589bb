"""The model of the paper's experiments: scenes, exact limits, and the growth of a loop that eq. 9 switches."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from haploop.controller.dissipation import registry
from haploop.launch.in_process import run_in_process
from haploop.launch.scene_file import load
from haploop.tools.cost_grid import scenes_folder
from haploop.tools.one_tick import OneTickMap
from haploop.tools.paper.claims import Finding
from haploop.tools.paper.command import make_figure
from haploop.tools.paper.experiment.gated_map import GatedMap
from haploop.tools.paper.experiment.limits import first_end, gated_ends
from haploop.tools.paper.experiment.readings import Candidate, candidates, distance, draw, largest
from haploop.tools.paper.experiment.setup import KINDS, Setup, elements_of
from haploop.tools.paper.figure_11 import largest_steady
from haploop.tools.paper.figures import figure
from haploop.tools.stiffness_limit import smooth


def test_the_scene_file_is_the_nearest_reading() -> None:
    file, made = load(scenes_folder() / "premium_press.toml"), Setup().scene(5000.0, [])
    for table in ("clock", "device", "transmission", "accelerometer", "friction", "hand", "wall"):
        for key, value in made[table].items():
            expected = pytest.approx(value, rel=1e-3) if isinstance(value, float) else value
            assert key == "grip" or file[table][key] == expected, (table, key)


def test_the_drive_rings_where_the_setup_says() -> None:
    setup = Setup(mode_Hz=180.0, near_share=0.2)
    scene = setup.scene(1.0, [])
    near, far, k = scene["transmission"]["motor_mass"], scene["device"]["mass"], scene["transmission"]["stiffness"]
    assert math.sqrt(k * (near + far) / (near * far)) / (2.0 * math.pi) == pytest.approx(180.0)
    assert near + far == pytest.approx(0.0525)


def test_a_gate_without_inertia_leaves_the_exact_limit() -> None:
    """The gated map's first growth is rho(M) = 1 where the gate switches nothing."""
    setup = Setup()
    exact = first_end(setup, "nothing", 0.0)
    gated = GatedMap.of(setup.linear_scene([]))
    assert gated_ends(gated, np.array([0.0]))[0] == pytest.approx(exact, rel=0.02)


def test_the_gated_maps_growth_without_a_gate_is_that_of_the_eigenvalues() -> None:
    setup = Setup()
    gated, exact = GatedMap.of(setup.linear_scene([])), OneTickMap.of(setup.linear_scene([]))
    for stiffness in (1900.0, 2500.0):
        assert gated.growth(stiffness, 0.0) == pytest.approx(math.log(exact.growth(stiffness)), abs=1e-4)


@pytest.mark.parametrize(("share", "grows"), [(0.9, False), (1.15, True)])
def test_runs_of_the_program_grow_and_decay_as_the_gated_map_says(share: float, grows: bool) -> None:
    """Without encoder, noise and friction; deep enough that the contact is never left while it matters."""
    setup, mass = Setup(), 0.02
    limit = gated_ends(GatedMap.of(setup.linear_scene([])), np.array([mass]))[0]
    scene = smooth(replace(setup, friction_N=0.0).scene(share * limit, elements_of(KINDS[3], mass)))
    scene["device"] |= {"velocity": -0.01}
    result = run_in_process(scene, registry())
    assert (result["verdict"] != "steady") == grows


def test_the_gated_map_refuses_estimates_that_it_does_not_have() -> None:
    scene = Setup().linear_scene([]) | {"velocity": {"cutoff": 100.0}}
    with pytest.raises(ValueError, match="plain difference"):
        GatedMap.of(scene)


def test_readings_are_a_function_of_their_seed_with_every_choice_equally_often() -> None:
    assert draw(3, 24) == draw(3, 24) != draw(4, 24)
    units = [setup.unit for setup in draw(3, 24)]
    assert {units.count(unit) for unit in set(units)} == {6}


def test_the_largest_stiffness_has_no_gap_below_it() -> None:
    steady = {2500.0: True, 3000.0: True, 3500.0: False, 4000.0: True}
    found = largest((Candidate("damping", (1.0,), k), is_so) for k, is_so in steady.items())
    assert found["damping"] == 3000.0
    rows = np.array([[True, True, False, True], [False] * 4, [True] * 4])
    assert largest_steady(rows, np.array(list(steady))).tolist() == [3000.0, 0.0, 4000.0]


def test_the_papers_own_numbers_are_at_no_distance_from_it() -> None:
    papers = {"damping": 4500.0, "bidirectional-inertia": 4500.0, "unidirectional-inertia": 5500.0, "both": 6500.0}
    assert distance(papers) == 0.0
    assert distance(papers | {"damping": 6000.0}) == 2.0
    assert len({(cell.name, cell.size, cell.stiffness) for cell in candidates()}) == len(candidates())


@pytest.mark.parametrize("number", [8, 9, 11, 12, 13])
def test_a_small_figure_has_its_files_and_a_finding_for_every_claim(number: int, tmp_path: Path) -> None:
    make_figure(number, tmp_path, small=True, workers=1)
    kept = json.loads((tmp_path / f"figure_{number}.json").read_text(encoding="utf-8"))
    claims = [Finding.of(entry).claim for entry in kept["findings"]]
    assert sorted(claims, key=str) == sorted(figure(number).CLAIMS, key=str)
    for name in kept["files"]:
        assert (tmp_path / name).stat().st_size > 0
        if name.endswith(".toml"):
            assert load(tmp_path / name)["wall"]["stiffness"] > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("number", [10, 14])
def test_small_figures_of_many_runs(number: int, tmp_path: Path) -> None:
    """The same as above for those that take longer."""
    test_a_small_figure_has_its_files_and_a_finding_for_every_claim(number, tmp_path)
