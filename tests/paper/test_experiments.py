"""The model of the paper's experiments: scenes, exact limits, and the growth of a loop that eq. 9 switches."""

from __future__ import annotations

import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.bundled import bundled_folder
from haploop.launch.scene.file import load
from haploop.protocol.scene.estimators import Velocity
from haploop.tools.linear.one_tick import OneTickMap
from haploop.tools.linear.stiffness_limit import smooth
from haploop.tools.search.random import Point
from haploop.tools.studies.choi2022.device import KINDS, SCENE_FILE, Setup, elements_of, file_text, nearest
from haploop.tools.studies.choi2022.experiment import (
    CLAIMS,
    NAMES,
    SHARES,
    SIZES,
    SPACE,
    measure,
    setup_of,
    shares_of,
    stiffness_ladder,
)
from haploop.tools.studies.choi2022.figures.claims import Claim
from haploop.tools.studies.choi2022.figures.figure_8 import contacts as figure_8_contacts
from haploop.tools.studies.choi2022.figures.work import NEAREST, Work
from haploop.tools.studies.choi2022.steadiness import BRIEFLY_S, is_steady, pressed
from haploop.tools.studies.choi2022.theory import GatedMap, first_end, gated_ends

# A drive, a hand and a unit with all that a loop may have but friction.
SETUP = Setup(
    mode_Hz=225.0, near_share=0.45, mode_damping=0.013, push_N=3.0, entry_m_s=0.2, hand=1.0, delay_s=0.0016,
    unit="420 Hz", mount="tip",
)  # fmt: skip


def point_of(setup: Setup) -> Point:
    values = setup.as_dict()
    return Point({key: values[key] for key in SPACE.choices}, {key: values[key] for key in SPACE.bounds})


def test_the_scene_file_is_the_nearest_interpretation() -> None:
    """Written by the search, and read back to the same setup, whatever it chooses."""
    assert (bundled_folder("scenes") / SCENE_FILE).read_text(encoding="utf-8") == file_text(nearest())


@pytest.mark.parametrize("setup", [SETUP, replace(SETUP, unit="ideal", velocity="50 Hz", hand=0.7, mount="motor")])
def test_a_setup_as_a_scene_file_reads_back(setup: Setup, tmp_path: Path) -> None:
    for folder in ("devices", "hands"):
        shutil.copytree(bundled_folder(folder), tmp_path / folder)
    file = tmp_path / "scenes" / SCENE_FILE
    file.parent.mkdir()
    file.write_text(file_text(setup), encoding="utf-8")
    scene = load(file)
    assert Setup.from_scene(scene) == setup
    made = setup.scene(5000.0)
    assert scene.accelerometer
    assert made.accelerometer
    assert scene.accelerometer == replace(made.accelerometer, range=scene.accelerometer.range)
    assert scene.accelerometer.range == pytest.approx(8.0 * 9.80665, rel=1e-5)
    for table in ("clock", "device", "transmission", "encoder", "actuator"):
        read, written = getattr(scene, table).as_dict(), getattr(made, table).as_dict()
        assert read == {
            key: value if isinstance(value, str) else pytest.approx(value, rel=1e-5) for key, value in written.items()
        }


def test_the_drive_rings_where_the_setup_says() -> None:
    setup = replace(SETUP, mode_Hz=180.0, near_share=0.2)
    scene = setup.scene(1.0)
    assert scene.transmission
    near, far, k = scene.transmission.motor_mass, scene.device.mass, scene.transmission.stiffness
    assert math.sqrt(k * (near + far) / (near * far)) / (2.0 * math.pi) == pytest.approx(180.0)
    assert near + far == pytest.approx(0.0525)


def test_a_gate_without_inertia_leaves_the_exact_limit() -> None:
    """The gated map's first growth is rho(M) = 1 where the gate switches nothing."""
    setup = SETUP
    exact = first_end(setup, "nothing", 0.0)
    gated = GatedMap.from_scene(setup.linear_scene())
    assert gated_ends(gated, np.array([0.0]))[0] == pytest.approx(exact, rel=0.02)


def test_the_gated_maps_growth_without_a_gate_is_that_of_the_eigenvalues() -> None:
    setup = SETUP
    gated, exact = GatedMap.from_scene(setup.linear_scene()), OneTickMap.from_scene(setup.linear_scene())
    for stiffness in (1900.0, 2500.0):
        assert gated.growth(stiffness, 0.0) == pytest.approx(math.log(exact.growth(stiffness)), abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(("share", "grows"), [(0.9, False), (1.15, True)])
def test_runs_of_the_program_grow_and_decay_as_the_gated_map_says(share: float, grows: bool) -> None:
    """Without encoder, noise and friction; deep enough that the contact is never left while it matters."""
    setup, mass = SETUP, 0.02
    limit = gated_ends(GatedMap.from_scene(setup.linear_scene()), np.array([mass]))[0]
    scene = smooth(setup.scene(share * limit, elements_of(KINDS[3], mass)))
    result = run_in_process(replace(scene, device=replace(scene.device, velocity=-0.01)), registry())
    assert (result["verdict"] != "steady") == grows


def test_the_gated_map_refuses_estimates_that_it_does_not_have() -> None:
    scene = replace(SETUP.linear_scene(), velocity=Velocity(cutoff=100.0))
    with pytest.raises(ValueError, match="plain difference"):
        GatedMap.from_scene(scene)


def test_interpretations_are_a_function_of_their_seed_with_every_choice_equally_often() -> None:
    """And those of a group run in arrays."""
    first, again, other = (SPACE.draw(np.random.default_rng(seed), 12, 2) for seed in (3, 3, 4))
    assert first == again != other
    for key, names in SPACE.choices.items():
        counts = {sum(point.choices[key] == name for group in first for point in group) for name in names}
        assert counts == {24 // len(names)}
    assert all(point.choices == group[0].choices for group in first for point in group)


def test_interpretations_around_one_share_its_choices_and_keep_to_whole_steps_of_delay() -> None:
    point = point_of(SETUP)
    assert setup_of(point) == SETUP
    near = [setup_of(one) for one in SPACE.neighbours(np.random.default_rng(1), point, 0.3, 6)]
    assert len({setup.delay_s for setup in near}) == 1
    assert near[0].delay_s * 1e4 == pytest.approx(round(near[0].delay_s * 1e4))
    assert {(setup.unit, setup.mount, setup.velocity) for setup in near} == {("420 Hz", "tip", SETUP.velocity)}
    assert all(low <= getattr(setup, key) <= high for setup in near for key, (low, high) in SPACE.bounds.items())


@pytest.mark.slow
def test_an_element_climbs_until_no_size_of_it_is_steady() -> None:
    """And what is called steady is so when it is run by itself."""
    levels = np.array([500.0, 2500.0, 6000.0])
    [found] = stiffness_ladder([SETUP], levels)
    for name in NAMES:
        some = np.asarray(found[name].any(axis=1))
        assert found[name].shape == (3, len(SIZES[name]))
        assert not some[int((~some).argmax()) :].any() or some.all()
    level, size = np.argwhere(found[KINDS[1]])[-1]
    elements = elements_of(KINDS[1], SIZES[KINDS[1]][size][0])
    assert is_steady(run_in_process(pressed(SETUP.scene(float(levels[level]), elements), BRIEFLY_S), registry()))


@pytest.mark.slow
def test_inertias_that_are_booked_unfelt_are_booked_as_recorded() -> None:
    """The books of a millionth, a million times: those of ``haploop dissipate`` on the run with the damper alone."""
    row = measure([point_of(SETUP)])[0]
    [*_, higher] = figure_8_contacts(SETUP)
    for i in range(3):
        assert row[f"higher {i}_J"] == pytest.approx(float(higher.booked.sampled_J[i, -1]), rel=1e-3)


def test_a_claim_that_the_nearest_interpretation_breaks_may_hold_in_another(tmp_path: Path) -> None:
    work, claim = Work(tmp_path, 8), Claim("V.B", "it does", "does", "{energy}", tested="8 more")
    assert work.finding(claim, False, energy="1 J").verdict == "does not hold here"
    broken, held = ({name: float(not is_so) for name in CLAIMS} | {"distance": 3.0} for is_so in (False, True))
    table = [SETUP.as_dict() | broken] * 30 + [replace(SETUP, mount="motor").as_dict() | held] * 30
    work.text(SHARES, shares_of(table, small=False))
    work.scene("figure_7", replace(SETUP, mode_Hz=300.0).scene(5000.0))
    found = work.finding(claim, False, energy="1 J")
    assert "mount of the unit: motor" in found.assumption
    # Two clusters that agree within: as much evidence as one draw.
    assert found.numbers == "1 J. In 50 % [5.5, 95] of 60 random interpretations"
    assert work.finding(claim, True, energy="1 J").assumption == NEAREST
    assert work.nearest.mode_Hz == 300.0
    assert Work(tmp_path, 8, small=True).nearest == nearest()
