"""The stored references are what they say, of the scenes they name; and what is made on the spot says so."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mpmath import mpf

from haploop.launch.scene.file import load
from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import Scene
from haploop.tools.cost.reference import (
    MOST_GROWTH,
    REFERENCES,
    Reference,
    exactly,
    growths,
    made_now,
    problem_hash,
    reference_for,
    statistics,
)
from haploop.tools.trajectory import trajectory
from helpers.scenes.least import scene
from oracles.continuous.make import SCENES, close_loop, in_digits, make_timebase
from oracles.continuous.plant import ContinuousPlant
from oracles.effects_reference import Bodies

RATES = (1_000, 2_000, 5_000, 10_000, 20_000, 50_000, 100_000)
NAMES = sorted(path.stem for path in SCENES.glob("*.toml"))
CHAOTIC = ["wall_limit_cycle"]
# A float that holds these positions is good to this.
ROUNDING_M = np.spacing(0.06)


def accuracy_scene(name: str, *overrides: str) -> Scene:
    return load(SCENES / f"{name}.toml", overrides)


def stored(name: str) -> Reference:
    return reference_for(SCENES / f"{name}.toml", accuracy_scene(name))


def furthest(x, other) -> float:
    return float(np.abs(np.asarray(x) - np.asarray(other)).max())


def test_every_accuracy_scene_has_a_stored_reference_and_no_other_has():
    assert NAMES == ["all_effects", "stick_slip", "stiff_cable", "wall_limit_cycle", "wall_steady"]
    assert sorted(path.stem for path in REFERENCES.glob("*.json")) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_the_same_problem_is_posed_at_every_plant_rate(name):
    for rate in RATES:
        posed = accuracy_scene(name, f"clock.plant_rate={rate}", "title=another", "run.log=none")
        reference = reference_for(Path("somewhere.toml"), posed)
        assert reference.scene == name
        assert len(reference.x_m) == len(reference.v_m_s) == make_timebase(posed).ticks + 1


@pytest.mark.parametrize("change", ["device.mass=0.051", "clock.round_trip_delay=0", "seed=7", "duration=0.2"])
def test_a_changed_problem_is_another_problem(change):
    assert problem_hash(accuracy_scene("stiff_cable", change)) != problem_hash(accuracy_scene("stiff_cable"))


@pytest.mark.parametrize("rate", [1_000, 10_000])
@pytest.mark.parametrize("name", ["stiff_cable", "wall_limit_cycle", "wall_steady"])
def test_the_exact_method_is_within_the_error_bar_where_nothing_is_dry(name, rate):
    reference = stored(name)
    exact = trajectory(exactly(accuracy_scene(name), rate))
    assert furthest(exact.x_m, reference.x_m) <= reference.error_m + 2 * ROUNDING_M
    assert exact.summary["verdict"] == reference.verdict


@pytest.mark.parametrize("name", ["all_effects", "stick_slip"])
def test_with_friction_the_exact_method_is_off_by_how_finely_it_finds_a_switch(name):
    """It finds them to h / 2^32, and lets friction hold 1e-12 more than it may: at 10 kHz some 1e-13 s in all."""
    reference = stored(name)
    exact = trajectory(exactly(accuracy_scene(name), 10_000))
    fastest_m_s = np.abs(reference.v_m_s).max()
    assert furthest(exact.x_m, reference.x_m) <= 1e-12 * fastest_m_s
    assert exact.summary["verdict"] == reference.verdict


@pytest.mark.parametrize("name", NAMES)
def test_error_bars_are_those_of_fewer_digits_and_another_method(name):
    assert 0.0 < stored(name).error_m < 1e-13
    assert "50 digits" in stored(name).how
    assert "DOP853" in stored(name).how


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow) if n == "all_effects" else n for n in NAMES])
def test_a_start_moved_by_a_tenth_of_a_micrometre_stays_as_near_unless_the_scene_is_chaotic(name):
    growth = growths(accuracy_scene(name), 10_000)
    assert stored(name).pointwise == (name not in CHAOTIC)
    assert (max(growth.values()) <= MOST_GROWTH) == stored(name).pointwise


def test_of_the_chaotic_scene_the_swings_can_be_compared_though_not_the_positions():
    reference, posed = stored("wall_limit_cycle"), accuracy_scene("wall_limit_cycle")
    moved = with_value(posed, "device.position", posed.device.position + 1e-7)
    ran = trajectory(moved)
    assert furthest(ran.x_m, reference.x_m) > 1e-3
    swings = statistics(moved, ran.x_m, ran.v_m_s)
    for figure in ("amplitude_m", "frequency_Hz", "energy_per_cycle_J"):
        assert swings[figure] == pytest.approx(reference.statistics[figure], rel=0.25)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_fifty_digits_give_all_stored_numbers_again(name):
    again, reference = in_digits(accuracy_scene(name), 50), stored(name)
    assert again.x_m == reference.x_m.tolist()
    assert again.v_m_s == reference.v_m_s.tolist()
    assert again.verdict == reference.verdict


class Independent:
    """The tests' own bodies, integrated by DOP853, as a continuous plant."""

    def __init__(self, posed: Scene) -> None:
        self.bodies = Bodies(posed)
        self.force = self.tau = 0.0
        self.rest_N = posed.hand.stiffness * posed.hand.rest if posed.hand else 0.0

    @property
    def x(self) -> float:
        return float(self.bodies.z[0])

    @property
    def v(self) -> float:
        return float(self.bodies.z[self.bodies.count])

    def sensed(self) -> float:
        return self.bodies.reading(self.force, self.tau)

    def begin(self, load: float) -> None:
        self.tau = load - self.rest_N

    def advance(self, command: float, load: float, next_load: float) -> None:
        self.bodies.advance(command, load - self.rest_N, (next_load - load) / 1e-3, 1e-3)
        self.force, self.tau = command, next_load - self.rest_N


@pytest.mark.parametrize(("name", "ticks"), [("stick_slip", 200), ("wall_steady", 150), ("all_effects", 60)])
def test_bodies_written_and_integrated_another_way_agree(name, ticks):
    posed = accuracy_scene(name, f"duration={ticks / 1000}")
    other = close_loop(posed, Independent(posed), float, lambda: None)
    assert furthest(other.x_m, stored(name).x_m[: ticks + 1]) < 1e-13


def test_a_sliding_mass_comes_to_rest_where_the_closed_form_says():
    """Dry friction alone: m v0 / f seconds, m v0^2 / (2 f) metres; here 12.5 ms, within a tick."""
    posed = scene(
        duration=0.02, device={"mass": 0.05, "damping": 0.0, "velocity": 0.1}, friction={"kinetic": 0.4}
    )  # fmt: skip
    plant = ContinuousPlant(posed, mpf(1) / 1000)
    close_loop(posed, plant, float, lambda: None)
    assert plant.v == 0.0
    assert plant.is_stuck
    assert plant.switches == 1
    assert plant.x == pytest.approx(0.05 * 0.1**2 / (2 * 0.4), rel=1e-15)


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"friction": {"kinetic": 0.1, "breakaway": 0.2, "stribeck_velocity": 0.01}}, "stribeck_velocity"),
        ({"jitter": {"kind": "uniform", "most": 0.001}}, "jitter"),
        ({"hand": {"force": {"kind": "sine", "amplitude": 1.0, "frequency": 2.0}}}, "straight, but is sine"),
        ({"hand": {"force": {"kind": "ramp", "value": 1.0, "rise_time": 0.0105}}}, "whole ticks at 1000 Hz"),
        ({"clock": {"round_trip_delay": 0.0005}}, "whole number of plant steps at 1000 Hz"),
    ],
)
def test_what_a_continuous_plant_cannot_follow_is_refused(tables, said):
    with pytest.raises(ValueError, match=said):
        make_timebase(scene(**tables))


def test_a_reference_made_on_the_spot_says_how_and_how_good_it_is():
    posed = accuracy_scene("wall_steady", "wall.stiffness=140", "duration=0.1")
    made = reference_for(Path("softer.toml"), posed)
    assert made.scene == "softer"
    assert made.how.startswith("Made on the spot by the exact method at 100 kHz; its error is how far")
    assert made.error_m < 1e-15
    assert furthest(made.x_m, in_digits(posed, 50).x_m) < 1e-15
    assert made.pointwise
    assert made.verdict == trajectory(posed).summary["verdict"]


def test_the_error_of_a_reference_made_on_the_spot_is_as_large_as_a_curved_force_makes_it():
    """Between plant steps every force is straight, so a sine at 100 kHz is off by what 50 kHz shows, and no less."""
    hand = {"force": {"kind": "sine", "amplitude": 1.0, "frequency": 20.0}, "stiffness": 100.0, "damping": 1.0}
    posed = scene(duration=0.2, hand=hand)
    made = made_now("sine", posed)
    finer = trajectory(exactly(posed, 400_000))
    assert 1e-13 < furthest(made.x_m, finer.x_m) < made.error_m < 1e-8


def test_with_jitter_positions_at_other_plant_rates_are_not_compared():
    made = made_now("late", scene(duration=0.02, jitter={"kind": "uniform", "most": 0.001}))
    assert not made.pointwise
    assert "Jitter" in made.how


def test_statistics_of_a_pure_swing_are_its_closed_forms():
    """x = c + A sin(w t): amplitude A, energy per cycle pi b A^2 w."""
    amplitude, rate = 1e-3, 2.0 * np.pi * 8.0
    posed = scene(wall={"position": 0.0, "stiffness": 1.0}, hand={"damping": 0.3})
    t = np.arange(1001) / 1000
    x, v = 0.05 + amplitude * np.sin(rate * t), amplitude * rate * np.cos(rate * t)
    figures = statistics(posed, x, v)
    assert figures["amplitude_m"] == pytest.approx(amplitude, rel=1e-3)
    assert figures["frequency_Hz"] == pytest.approx(8.0, rel=1e-3)
    assert figures["energy_per_cycle_J"] == pytest.approx(np.pi * 0.4 * amplitude**2 * rate, rel=1e-2)


def test_what_does_not_swing_has_no_frequency():
    t = np.arange(301) / 1000
    figures = statistics(scene(), 1e-3 * t, np.full(301, 1e-3))
    assert figures["amplitude_m"] == pytest.approx(0.5e-3 * 0.15)
    assert figures["frequency_Hz"] is figures["energy_per_cycle_J"] is None


def test_reading_a_reference_needs_no_mpmath():
    reads = "import sys, haploop.tools.cost.reference; sys.exit('mpmath' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", reads], check=False).returncode == 0


def test_a_trajectory_is_the_runs_own():
    posed = accuracy_scene("wall_steady", "duration=0.05")
    ran, again = trajectory(posed), trajectory(replace(posed))
    assert ran.x_m[0] == posed.device.position
    assert ran.x_m[-1] == ran.summary["final"]["x_m"]
    assert ran.v_m_s[-1] == ran.summary["final"]["v_m_s"]
    assert ran.summary["trajectory_sha256"] == again.summary["trajectory_sha256"]
