"""Plant steps of all methods written alike: the exact one is the exact flow, and operations are counted right."""

from __future__ import annotations

import numpy as np
import pytest

from haploop.launch.scene.file import load
from haploop.plant.chain.chain import Chain
from haploop.plant.chain.transition import ChainTransition
from haploop.plant.integrators.linear_rates import LinearRates
from haploop.tools.cost.alike import ExactStep, one_steps, operations, timed_alike
from haploop.tools.cost.grid import accuracy_scenes

SCENES = {path.stem: load(path) for path in accuracy_scenes()}


@pytest.mark.parametrize("name", ["wall_steady", "stiff_cable", "all_effects"])
def test_the_exact_step_is_the_exact_flow_of_the_plant(name: str) -> None:
    """Against its transition from (state, command, friction, load, rise), for random states and forces."""
    scene = SCENES[name]
    chain, step_s = Chain.from_scene(scene), 1.0 / scene.clock.plant_rate
    rates = LinearRates(chain)
    size = len(chain.states)
    z, (command, load_N, rise) = np.random.default_rng(1).normal(size=size), (0.7, -0.3, 0.2)
    begin = command * rates.of_inputs[0] + load_N * rates.of_inputs[2]
    end = begin + rise * rates.of_inputs[2]
    found = np.array(ExactStep(rates, step_s).step(z.tolist(), begin.tolist(), begin.tolist(), end.tolist()))
    acting = np.concatenate([z, [command, 0.0, load_N, rise]])
    expected = z + acting @ ChainTransition(chain, step_s, 1, stuck=False).step
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


def test_operations_are_those_of_the_formulas() -> None:
    """One mass, x' = v, v' = -k/m x - b/m v + p.

    Euler: three products and sums of the rates, two of each for the step. The exact flow: for x and for v two of the
    state, one of the push and one of its rise, which is one difference.
    """
    counts = operations(SCENES["wall_steady"])
    assert counts["euler"] == 3 * 2 + 2 * 2
    assert counts["exact"] == 2 * 4 * 2 + 1
    assert counts["rk4"] > 4 * counts["euler"]


def test_arrays_of_motions_take_the_steps_of_numbers() -> None:
    scene = SCENES["stiff_cable"]
    push = [0.0, 0.0, 0.5, -0.5]
    z = np.random.default_rng(2).normal(size=(4, 6)) * 1e-3
    for method in one_steps(scene).values():
        together = method.step(list(z), push, push, push)
        alone = [method.step(column.tolist(), push, push, push) for column in z.T]
        assert np.array(together) == pytest.approx(np.array(alone).T, rel=1e-12, abs=1e-18)


def test_every_method_is_held_against_the_exact_step() -> None:
    steps = timed_alike(SCENES["wall_steady"], 1)
    assert [step.method for step in steps] == list(one_steps(SCENES["wall_steady"]))
    assert all(step.alone.median > 0.0 and step.arrays.median > 0.0 for step in steps)
