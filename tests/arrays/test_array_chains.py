"""Arrays of scenes with bodies in a row: each comes to what it comes to alone, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest

from haploop.launch.batch import batch
from haploop.launch.batch.stacking import is_batchable, structure
from helpers.runs.batches import alone, diverging, together
from helpers.scenes.effect_tables import EFFECTS, slowly, tap
from helpers.scenes.least import scene
from helpers.scenes.varied_scenes import drawn_chain, varied

LINES = {"friction", "jitter", "loss"}


@pytest.mark.parametrize("seed", range(30))
def test_a_chain_out_of_an_array_has_every_bit_of_the_chain_alone(seed: int) -> None:
    rng = np.random.default_rng(2000 + seed)
    base = drawn_chain(seed)
    wall = base["wall"]
    scenes = [base, *({**base, "wall": {**wall, "stiffness": wall["stiffness"] * factor}} for factor in (0.9, 1.2))]
    if seed % 3:
        scenes = [base, *(varied(base, rng) for _ in range(3))]
    assert is_batchable(base)
    assert len({structure(each) for each in scenes}) == 1
    assert together(scenes) == [alone(each) for each in scenes]


def test_chains_that_diverge_leave_with_their_results_and_disturb_no_other() -> None:
    cable = {"motor_mass": 0.002, "stiffness": 2e4, "damping": 0.4, "motor_damping": 0.05}
    sensed = {
        "acceleration": {"source": "accelerometer"},
        "accelerometer": {"noise_density": 1e-3, "range": 30.0, "delay": 0.0002},
    }
    scenes = [
        {**made, "device": {**made["device"], "mass": 0.01 + 1e-4 * i}} for i, made in enumerate(diverging()[::2])
    ]
    scenes = [scene(**{**made, "transmission": cable, **sensed, "seed": i}) for i, made in enumerate(scenes)]
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
        {**base, "wall": {**base["wall"], "stiffness": stiffness}, "seed": index}
        for index, stiffness in enumerate(rng.uniform(50.0, 3000.0, 5).tolist())
    ]
    assert is_batchable(base)
    results = together(scenes)
    assert results == [alone(each) for each in scenes]
    assert all(result and result["energy"]["friction_heat_J"] > 1e-5 for result in results)


@pytest.mark.slow
def test_loops_with_friction_that_diverge_disturb_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """In blocks of a tick, and in blocks in which many loops switch."""
    scenes = [scene(**{**made, "friction": {"kinetic": 0.02}}) for made in diverging()[::3]]
    expected = [alone(each) for each in scenes]
    assert {"diverged", "done"} == {result["ended"] for result in expected}
    for block in (1, 10**4):
        monkeypatch.setattr(batch, "BLOCK", block)
        assert together(scenes) == expected


def test_friction_that_needs_every_step_walked_and_bodies_that_differ_go_alone() -> None:
    base = tap(("friction",))
    curved = tap((), friction={"kinetic": 0.04, "breakaway": 0.05, "stribeck_velocity": 0.01})
    other = {**base, "device": {**base["device"], "mass": 0.06}}
    assert not is_batchable(curved)
    assert structure(base) != structure(other)
