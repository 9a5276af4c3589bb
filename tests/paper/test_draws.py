"""The interpretations that a fixed seed draws: those of which docs/paper.md tells."""

from __future__ import annotations

import hashlib
import json
import math
from types import ModuleType
from typing import Any

import pytest

from haploop.tools.search.random import Group, Point, Row, random_search
from haploop.tools.studies.choi2022 import experiment, simulation
from haploop.tools.studies.choi2022.interpretations import SEED


def made_up(module: ModuleType, group: Group) -> list[Row]:
    """Distances that depend on every choice and number, in place of runs."""
    bounds = module.SPACE.bounds
    return [
        {
            "distance": round(
                sum(abs(math.log(x / math.sqrt(bounds[key][0] * bounds[key][1]))) for key, x in point.numbers.items())
                + sum(len(str(choice)) % 3 for choice in point.choices.values()),
                1,
            ),
            "tie": point.numbers["push_N"],
        }
        for point in group
    ]


def as_line(point: Point) -> list[Any]:
    return [*point.choices.values(), *(f"{value:.6g}" for value in point.numbers.values()), point.seed]


@pytest.mark.parametrize(
    ("module", "tie", "count", "digest"),
    [
        (simulation, 0.0, 5056, "94bc47aa11aa59a10dfea94efdb4f87718f4ce387746fa27dfb2798e5e0ff2ae"),
        (experiment, 1.0, 744, "26e362e434242bf08b1b9333a411e9eac4c7eb87e8d69620bf848e87418798a8"),
    ],
)
def test_the_fixed_seed_draws_the_same_interpretations_as_ever(
    module: ModuleType, tie: float, count: int, digest: str
) -> None:
    """Random, refined and neighbours, in order, with made-up distances; recorded before both searches became one."""
    points: list[Point] = []

    def evaluate(group: Group) -> list[Row]:
        points.extend(group)
        return made_up(module, group)

    random_search(
        module.SPACE,
        evaluate,
        module.WHOLE,
        seed=SEED,
        distance=lambda row: row["distance"],
        tie=lambda row: tie * row["tie"],
    )
    lines = [as_line(point) for point in points]
    assert len(lines) == count
    assert hashlib.sha256(json.dumps(lines).encode()).hexdigest() == digest
