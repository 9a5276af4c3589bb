"""An exported controller against the run it was exported from: the same forces at the same plant steps, to the bit."""

from __future__ import annotations

from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.file import load
from haploop.plant.motion.one_mass import OneMassMotion
from haploop.protocol.scene.scene import EventTable, Scene, accelerometer_is_used, by_window
from haploop.protocol.ticks import Timebase
from helpers.runs.fmus import forces_of, made, needs_fmus, recorded, stepped
from helpers.scenes.least import KINDS, scene

SCENES_AT = Path(__file__).parents[2] / "launch" / "scenes"

TAP: dict[str, Any] = {
    "duration": 0.3,
    "device": {"mass": 0.05, "damping": 0.3, "velocity": -0.15},
    "hand": {"mass": 0.02, "force": {"kind": "sine", "amplitude": -0.4, "frequency": 9, "offset": -0.5}},
    "wall": {"position": -0.001, "stiffness": 400},
    "encoder": {"resolution": 1e-5},
}
CLOCK = {"plant_rate": 10_000, "control_rate": 1_000}
DAMPING = {"kind": "damping", "damping": 0.3}
ELEMENTS = [
    {**DAMPING, "acts": "always"},
    {"kind": "unidirectional-damping", "damping": 0.2, "acts": "always"},
    {"kind": "bidirectional-inertia", "mass": 0.002},
    {"kind": "unidirectional-inertia", "mass": 0.004, "acts": "always"},
]
FILTER = {"estimator": "kalman", "jerk_density": 10.0}
SCENES: dict[str, dict[str, Any]] = {
    "no wall, no element": {"wall": None, "encoder": None},
    "every element": {"dissipation": ELEMENTS},
    "a wall above, read by floor": {
        "wall": {"position": 0.001, "stiffness": 400, "occupies": "above"},
        "device": {"mass": 0.05, "damping": 0.3, "velocity": 0.2},
        "encoder": {"resolution": 3e-6, "rounding": "floor"},
        "dissipation": [ELEMENTS[1]],
    },
    "whole ticks of delay": {"clock": {**CLOCK, "round_trip_delay": 0.002}, "dissipation": ELEMENTS},
    "a part of a tick of delay": {"clock": {**CLOCK, "round_trip_delay": 0.0003}, "dissipation": ELEMENTS},
    "ticks and a part": {"clock": {**CLOCK, "round_trip_delay": 0.0025}, "dissipation": ELEMENTS},
    "an actuator": {"actuator": {"resolution": 0.013, "saturation": 0.7}, "dissipation": ELEMENTS},
    "a window": {"velocity": {"estimator": "window", "ticks": 5}, "dissipation": ELEMENTS},
    "low-passes": {"velocity": {"cutoff": 80}, "acceleration": {"cutoff": 60}, "dissipation": ELEMENTS},
    "an end-fit": {
        "velocity": {"estimator": "foaw", "ticks": 12, "cutoff": 200},
        "acceleration": {"estimator": "foaw", "ticks": 6, "bound": 0.01},
        "dissipation": ELEMENTS,
    },
    "a best fit": {"velocity": {"estimator": "foaw", "ticks": 16, "fit": "best"}, "dissipation": ELEMENTS},
    "a Kalman filter": {
        "velocity": {**FILTER, "cutoff": 300},
        "acceleration": {"source": "kalman", "cutoff": 100},
        "dissipation": ELEMENTS,
    },
    "an accelerometer": {
        "accelerometer": {"noise_density": 3e-3, "range": 20},
        "acceleration": {"source": "accelerometer", "cutoff": 100},
        "dissipation": ELEMENTS,
    },
    "a fused filter": {
        "accelerometer": {"noise_density": 3e-3},
        "velocity": {**FILTER, "accelerometer": True},
        "acceleration": {"source": "kalman"},
        "dissipation": ELEMENTS,
    },
}


def tapping(**tables: Any) -> Scene:
    return scene(**{key: table for key, table in (TAP | tables).items() if table is not None})


def assert_same_bits(ours: np.ndarray, theirs: np.ndarray) -> None:
    parts = np.flatnonzero(ours.view(np.int64) != theirs.view(np.int64))
    assert len(ours) == len(theirs)
    assert not len(parts), f"{len(parts)} of {len(ours)} forces part, the first at plant step {parts[0]}"


# Scenes that together have every branch of the C; the others are slow tests.
QUICK = {"a wall above, read by floor", "ticks and a part", "an actuator"}


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in SCENES]
)
def test_the_force_of_an_fmu_is_that_of_the_run_at_every_plant_step_to_the_bit(name: str, tmp_path: Path) -> None:
    needs_fmus()
    loop = tapping(**SCENES[name])
    run = recorded(loop)
    readings = [sample[1] for sample in run.samples] if accelerometer_is_used(loop) else None
    with stepped(made(loop, tmp_path)) as one:
        forces = forces_of(one, loop, run.true_m, readings)
    assert name == "no wall, no element" or np.abs(forces).max() > 0.1
    assert_same_bits(forces, run.force_N)


def test_an_exported_controller_and_the_exact_plant_give_the_trajectory_of_figure_6c(tmp_path: Path) -> None:
    needs_fmus()
    loop = load(SCENES_AT / "fig6c.toml")
    time = Timebase.from_scene(loop)
    motion, n = OneMassMotion(loop, time), time.steps_per_tick
    with stepped(made(loop, tmp_path)) as one:
        for tick in range(time.ticks):
            one.set(position=motion.x)
            motion.advance(tick, [(n, one.force(), tick)])
            one.slave.doStep(tick / time.control_rate, 1.0 / time.control_rate)
    record = motion.take_record(0)
    trajectory = np.stack([record["x"], record["v"]], axis=1).tobytes()
    summary = run_in_process(by_window(loop), KINDS)
    assert sha256(trajectory).hexdigest() == summary["trajectory_sha256"]


def test_measured_positions_give_the_same_forces_where_the_fmu_is_told_not_to_round(tmp_path: Path) -> None:
    needs_fmus()
    noise = {"deviation": 1e-5, "cutoff": 300}
    loop = tapping(encoder={"resolution": 3e-6, "rounding": "floor"}, noise=noise, dissipation=ELEMENTS)
    run = recorded(loop)
    measured = [sample[0] for sample in run.samples]
    assert np.any(run.true_m != measured)
    path = made(loop, tmp_path)
    with stepped(path) as one:
        one.set_named({"encoder.resolution": 0.0})
        assert_same_bits(forces_of(one, loop, measured), run.force_N)
    # What is rounded down already can fall by a count when it is rounded down again.
    with stepped(path) as one, pytest.raises(AssertionError, match="forces part"):
        assert_same_bits(forces_of(one, loop, measured), run.force_N)


def test_a_parameter_set_between_two_steps_acts_as_the_same_change_of_a_run_does(tmp_path: Path) -> None:
    needs_fmus()
    changes = {"wall.stiffness": 250.0, "wall.position": -0.0005, "dissipation.0.damping": 0.45}
    plain = tapping(dissipation=ELEMENTS, velocity={"cutoff": 200})
    run = recorded(replace(plain, event=(EventTable(at=0.1, set=changes),)))
    with stepped(made(plain, tmp_path)) as one:
        before = forces_of(one, plain, run.true_m[:100])
        one.set_named(changes)
        after = forces_of(one, plain, run.true_m[100:], first=100)
    assert_same_bits(np.concatenate([before, after]), run.force_N)
    assert np.any(recorded(plain).force_N != run.force_N)


@pytest.mark.slow
@pytest.mark.parametrize(("delay_s", "steps"), [(0.002, 10), (0.002, 5), (0.0025, 5), (0.0004, 2), (0.0004, 1)])
def test_longer_communication_steps_give_the_same_forces_at_their_beginnings(
    delay_s: float, steps: int, tmp_path: Path
) -> None:
    needs_fmus()
    loop = tapping(clock={**CLOCK, "round_trip_delay": delay_s}, dissipation=ELEMENTS)
    run = recorded(loop)
    with stepped(made(loop, tmp_path)) as one:
        forces = forces_of(one, loop, run.true_m, steps=steps)
    assert_same_bits(forces, run.force_N[::steps])


@pytest.mark.slow
def test_an_importer_that_reads_the_force_a_step_late_has_another_loop(tmp_path: Path) -> None:
    needs_fmus()
    loop = tapping(clock={**CLOCK, "round_trip_delay": 0.002}, dissipation=ELEMENTS)
    run = recorded(loop)
    with stepped(made(loop, tmp_path)) as one, pytest.raises(AssertionError, match="forces part"):
        assert_same_bits(forces_of(one, loop, run.true_m)[1:], run.force_N[:-1])


def test_an_importer_of_no_words_simulates_it_with_the_forces_of_the_run(tmp_path: Path) -> None:
    needs_fmus()
    from fmpy import simulate_fmu

    loop = tapping(clock={**CLOCK, "round_trip_delay": 0.002}, dissipation=ELEMENTS)
    run = recorded(loop)
    ticks = np.arange(300) / 1000.0
    signal = np.array(list(zip(ticks, run.true_m, strict=True)), [("time", float), ("position", float)])
    result = simulate_fmu(str(made(loop, tmp_path)), stop_time=0.299, input=signal, output=["force"])
    assert_same_bits(np.ascontiguousarray(result["force"]), run.force_N[::10])


@pytest.mark.slow
def test_without_delay_an_importer_that_sets_steps_and_reads_has_a_loop_of_one_communication_step_of_delay(
    tmp_path: Path,
) -> None:
    needs_fmus()
    prompt, late = (tapping(clock={**CLOCK, "round_trip_delay": d}, dissipation=ELEMENTS) for d in (0.0, 0.001))
    positions = recorded(prompt).true_m
    with stepped(made(late, tmp_path, "late")) as one:
        expected = forces_of(one, late, positions, steps=10)
    with stepped(made(prompt, tmp_path)) as one:
        forces = [0.0]
        for tick, x in enumerate(positions):
            one.set(position=x)
            one.slave.doStep(tick / 1000, 0.001)
            forces.append(one.force())
    assert_same_bits(np.array(forces[:-1]), expected)
