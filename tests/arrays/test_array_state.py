"""Members that are kept go on as before when others are dropped: estimators, noise, random numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from haploop.controller.controller import make_params
from haploop.controller.tick import StateTuple, initial_state, tick
from haploop.plant.sensing.noise import NoisyPositionSensor
from haploop.plant.streams import RandomStream, make_normal
from haploop.protocol.scene.effects import Noise
from haploop.protocol.trees import tree_select
from helpers.scenes.least import typed

KEPT = np.array([True, False, True, True, False])


@pytest.mark.parametrize(
    "tables",
    [
        {"velocity": {"cutoff": np.linspace(10, 50, 5)}},
        {"velocity": {"estimator": "foaw", "ticks": 3, "bound": np.linspace(1e-5, 5e-5, 5)}},
        {"velocity": {"estimator": "window", "ticks": 3}, "acceleration": {"cutoff": 30.0}},
    ],
)
def test_estimators_go_on_with_the_loops_that_are_kept(tables: dict[str, Any]) -> None:
    rng = np.random.default_rng(1)
    x = rng.normal(size=(12, 5)) * 1e-3
    params = make_params(typed(**tables), 1e-3, {})
    whole: StateTuple = initial_state(params, (x[0],))
    cut, of_cut = whole, params
    for k, row in enumerate(x):
        if k == 6:
            cut, of_cut = tree_select(cut, KEPT), tree_select(params, KEPT)
        kept = KEPT if k >= 6 else np.ones(5, bool)
        whole, (_, v, a, *_) = tick(params, whole, (row,))
        cut, (_, v_cut, a_cut, *_) = tick(of_cut, cut, (row[kept],))
        assert v_cut.tolist() == v[kept].tolist()
        assert a_cut.tolist() == a[kept].tolist()


@pytest.mark.parametrize("before", [0, 100, 128, 5000])
def test_each_loop_draws_what_it_draws_alone_also_after_others_have_left(before: int) -> None:
    seeds, cutoffs = np.array([3, 1, 4, 1, 5]), np.linspace(10, 50, 5)
    of_batch = Noise.from_dict({"deviation": 2.0, "cutoff": cutoffs})
    noise = NoisyPositionSensor(None, of_batch, seeds, 1e-3)
    alone = [
        NoisyPositionSensor(None, Noise(deviation=2.0, cutoff=cutoff), int(seed), 1e-3)
        for seed, cutoff in zip(seeds, cutoffs.tolist(), strict=True)
    ]
    for _ in range(before):
        assert noise.reading(0.0).tolist() == [one.reading(0.0) for one in alone]
    noise.select(KEPT)
    kept = [one for one, stays in zip(alone, KEPT, strict=True) if stays]
    for _ in range(300):
        assert noise.reading(0.0).tolist() == [one.reading(0.0) for one in kept]


def test_draws_cross_the_pieces_of_a_stream_as_those_of_one_loop_do() -> None:
    many, one = make_normal(np.array([7, 8]), "noise"), RandomStream(8, "noise").normal()
    assert [many()[1] for _ in range(9000)] == [one() for _ in range(9000)]
