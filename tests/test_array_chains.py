"""Arrays of scenes with bodies in a row: each comes to what it comes to alone, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest
from array_makers import alone, diverging, together
from physics.varied_scenes import drawn_chain, varied
from scene_makers import scene

from haploop.launch.array_scene import runs_in_arrays, structure


@pytest.mark.parametrize("seed", range(30))
def test_a_chain_out_of_an_array_has_every_bit_of_the_chain_alone(seed: int) -> None:
    rng = np.random.default_rng(2000 + seed)
    base = drawn_chain(seed)
    wall = base["wall"]
    scenes = [base, *({**base, "wall": {**wall, "stiffness": wall["stiffness"] * factor}} for factor in (0.9, 1.2))]
    if seed % 3:
        scenes = [base, *(varied(base, rng) for _ in range(3))]
    assert runs_in_arrays(base)
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
