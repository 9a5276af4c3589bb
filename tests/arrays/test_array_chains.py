"""Arrays of scenes with bodies in a row: each comes to what it comes to alone, bit for bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from haploop.controller.dissipation import registry
from haploop.launch.batch import batch
from haploop.launch.batch.stacking import device_of, is_batchable, structure
from haploop.launch.runs import in_batch as batch_run
from haploop.plant.friction import batch as friction_batch
from haploop.protocol.scene.effects import Accelerometer, Friction, Transmission
from haploop.protocol.scene.estimators import Acceleration
from haploop.protocol.scene.paths import with_value
from haploop.protocol.scene.scene import Scene
from helpers.runs.batches import alone, diverging, together, with_stiffness
from helpers.scenes.effect_tables import EFFECTS, slowly, tap
from helpers.scenes.varied_scenes import drawn_chain, varied

LINES = {"friction", "jitter", "loss"}


def devices_that_rub(effects: tuple[str, ...]) -> list[Scene]:
    """Five scenes of three devices, the second and the last thrown beyond their limits."""
    base = tap(("friction", *effects), duration=0.1)
    of = [(0.05, 300.0), (0.05, 2000.0), (0.07, 300.0), (0.03, 900.0), (0.07, 3000.0)]
    return [
        replace(
            with_stiffness(with_value(base, "device.mass", mass_kg), stiffness_N_m),
            seed=index,
            diverged_beyond=1e-3 if index in (1, 4) else 1.0,
        )
        for index, (mass_kg, stiffness_N_m) in enumerate(of)
    ]


@pytest.mark.parametrize("seed", [*range(8), *slowly(range(8, 30))])
def test_a_chain_out_of_an_array_has_every_bit_of_the_chain_alone(seed: int) -> None:
    rng = np.random.default_rng(2000 + seed)
    base = drawn_chain(seed)
    assert base.wall
    scenes = [base, *(with_stiffness(base, base.wall.stiffness * factor) for factor in (0.9, 1.2))]
    if seed % 3:
        scenes = [base, *(varied(base, rng) for _ in range(3))]
    assert is_batchable(base)
    assert len({structure(each) for each in scenes}) == 1
    assert together(scenes) == [alone(each) for each in scenes]


def test_chains_that_diverge_leave_with_their_results_and_disturb_no_other() -> None:
    cable = Transmission(motor_mass=0.002, stiffness=2e4, damping=0.4, motor_damping=0.05)
    sensor = Accelerometer(noise_density=1e-3, range=30.0, delay=0.0002)
    felt = {"acceleration": Acceleration(source="accelerometer"), "accelerometer": sensor}
    scenes = [
        replace(with_value(made, "device.mass", 0.01 + 1e-4 * i), transmission=cable, **felt, seed=i)
        for i, made in enumerate(diverging()[::2])
    ]
    expected = [alone(each) for each in scenes]
    assert {"diverged", "done"} == {result["ended"] for result in expected}
    assert len({result["ticks"] for result in expected}) > 3
    assert together(scenes) == expected


@pytest.mark.parametrize("effects", [(), ("transmission", "grip"), ("bandwidth", "noise"), tuple(set(EFFECTS) - LINES)])
@pytest.mark.parametrize("seed", [0, *slowly(range(1, 4))])
def test_loops_with_friction_stick_slip_and_are_booked_as_they_are_alone(effects: tuple[str, ...], seed: int) -> None:
    rng = np.random.default_rng(seed)
    base = tap(("friction", *effects), duration=0.15, clock={"round_trip_delay": [0.0, 0.0013, 0.002, 0.003][seed]})
    scenes = [
        replace(with_stiffness(base, stiffness), seed=index)
        for index, stiffness in enumerate(rng.uniform(50.0, 3000.0, 5).tolist())
    ]
    assert is_batchable(base)
    results = together(scenes)
    assert results == [alone(each) for each in scenes]
    assert all(result and result["energy"]["friction_heat_J"] > 1e-5 for result in results)


@pytest.mark.parametrize("velocity", [0.0, -0.02])
def test_loops_with_friction_share_an_array_though_each_hand_presses_otherwise(velocity: float) -> None:
    """Some begin stuck and some slipping, at rest and thrown."""
    pressed_by = {"mass": 0.01, "stiffness": 10.0, "damping": 0.01, "force": {"kind": "constant", "value": -0.8}}
    base = tap((), friction={"kinetic": 0.05}, hand=pressed_by, duration=0.15)
    base = with_value(base, "device.velocity", velocity)
    scenes = [with_value(base, "hand.force.value", value) for value in (-0.02, -0.06, -0.3, -1.5, 0.4)]
    assert len({structure(each) for each in scenes}) == 1
    assert together(scenes) == [alone(each) for each in scenes]


@pytest.mark.parametrize("effects", [(), ("transmission",)])
def test_so_they_do_though_each_has_a_friction_of_its_own_and_some_leave(effects: tuple[str, ...]) -> None:
    """The first is thrown beyond its limit, and the others go on with the friction that is theirs."""
    base = tap(("friction", *effects), duration=0.1)
    scenes = [
        replace(base, friction=Friction(kinetic=kinetic, breakaway=kinetic + more))
        for kinetic, more in ((0.01, 0.0), (0.02, 0.02), (0.2, 0.001), (0.6, 0.3))
    ]
    scenes = [replace(scene, diverged_beyond=1e-3 if at < 2 else 1.0) for at, scene in enumerate(scenes)]
    assert len({structure(each) for each in scenes}) == 1
    expected = [alone(each) for each in scenes]
    assert len({result["ended"] for result in expected}) == 2
    assert len({result["energy"]["friction_heat_J"] for result in expected}) == 4
    assert together(scenes) == expected


@pytest.mark.slow
def test_loops_with_friction_that_diverge_disturb_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """In blocks of a tick, and in blocks in which many loops switch."""
    scenes = [replace(made, friction=Friction(kinetic=0.02, breakaway=0.02)) for made in diverging()[::3]]
    expected = [alone(each) for each in scenes]
    assert {"diverged", "done"} == {result["ended"] for result in expected}
    for block in (1, 10**4):
        monkeypatch.setattr(batch, "BLOCK", block)
        assert together(scenes) == expected


@pytest.mark.parametrize("effects", [(), ("transmission", "grip"), tuple(set(EFFECTS) - LINES)])
def test_loops_with_friction_share_an_array_though_their_bodies_differ_and_some_leave(effects: tuple[str, ...]) -> None:
    scenes = devices_that_rub(effects)
    assert len({structure(each) for each in scenes}) == 1
    assert len({device_of(each) for each in scenes}) == 3
    expected = [alone(each) for each in scenes]
    assert [result["ended"] for result in expected] == ["done", "diverged", "done", "done", "diverged"]
    assert all(result["energy"]["friction_heat_J"] > 1e-5 for result in expected)
    assert together(scenes) == expected


def test_a_member_that_were_moved_as_the_device_of_another_would_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    scenes = devices_that_rub(())
    monkeypatch.setattr(friction_batch, "devices_of", lambda chain, members: ([0], np.zeros(members, np.int64)))
    assert together(scenes) != [alone(each) for each in scenes]


def test_a_batch_with_friction_has_no_more_devices_than_are_kept_in_mind(monkeypatch: pytest.MonkeyPatch) -> None:
    base, made = tap(("friction",), duration=0.02), []
    scenes = [
        with_stiffness(with_value(base, "device.mass", 0.05 + 0.01 * (i % 5)), 300.0 + 100.0 * i) for i in range(20)
    ]
    monkeypatch.setattr(batch_run, "DEVICES", 2)
    monkeypatch.setattr(batch_run, "Batch", lambda some, *of, **so: made.append(some) or batch.Batch(some, *of, **so))
    results = batch_run.run_batch(scenes, registry(), trajectories=True)
    assert [len({device_of(scene) for scene in some}) for some in made] == [1, 2, 2]
    assert [one["trajectory_sha256"] for one in results] == [alone(one)["trajectory_sha256"] for one in scenes]


def test_friction_that_needs_every_step_walked_goes_alone() -> None:
    assert not is_batchable(tap((), friction={"kinetic": 0.04, "breakaway": 0.05, "stribeck_velocity": 0.01}))
