"""Random search: it finds a known minimum, keeps to its space, and is a function of its seed alone."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.tools.search.random import Effort, Group, Point, Row, Scale, Space, random_search

SPACE = Space(
    choices={"shape": ("round", "square", "flat"), "shift_s": (0.0, 0.1, 0.2)},
    bounds={"width": (0.1, 100.0), "height": (1.0, 1000.0)},
    scales={"shift_s": Scale(0.01, 0.0, 0.2)},
    digits=4,
    seeded=True,
)
EFFORT = Effort(
    structures=9, each=20, rounds=8, best=6, groups=4, children=20, finalists=3, neighbours=10, close=0.05
)  # fmt: skip


def bowl(group: Group) -> list[Row]:
    """Least, 0, at a square 3 wide and 50 high, shifted by 0.13."""
    return [
        {
            "distance": abs(math.log(point.numbers["width"] / 3.0))
            + abs(math.log(point.numbers["height"] / 50.0))
            + 10.0 * abs(point.choices["shift_s"] - 0.13)
            + (point.choices["shape"] != "square")
        }
        for point in group
    ]


def distance(row: Row) -> float:
    return row["distance"]


@pytest.mark.parametrize("seed", range(4))
def test_the_minimum_of_a_known_function_is_found(seed: int) -> None:
    found = random_search(SPACE, bowl, EFFORT, seed=seed, distance=distance)
    best = found.best.point
    assert best.choices == {"shape": "square", "shift_s": pytest.approx(0.13)}
    assert best.numbers == pytest.approx({"width": 3.0, "height": 50.0}, rel=0.02)
    at_random = [distance(trial.row) for trial in found.trials if trial.row["stage"] == "random"]
    assert distance(found.best.row) < 0.1 * min(at_random)


def test_a_search_is_a_function_of_its_seed_whatever_the_order_of_evaluation() -> None:
    def backwards(_: str, evaluate: object, groups: Sequence[Group]) -> list[list[Row]]:
        return [bowl(group) for group in reversed(groups)][::-1]

    first = random_search(SPACE, bowl, EFFORT, seed=1, distance=distance)
    assert first == random_search(SPACE, bowl, EFFORT, seed=1, distance=distance, evaluate_all=backwards)
    assert first != random_search(SPACE, bowl, EFFORT, seed=2, distance=distance)


def test_a_good_point_with_bad_neighbours_is_not_the_best() -> None:
    """Two wells of the same depth, one of them narrower than the neighbours are spread."""

    def wells(group: Group) -> list[Row]:
        return [
            {"distance": min(abs(x / 30.0 - 1.0), 0.01 if abs(x / 3.0 - 1.0) < 1e-3 else 1.0)}
            for x in (point.numbers["width"] for point in group)
        ]

    space = Space(choices={"well": ("narrow", "wide")}, bounds={"width": (2.999, 30.0)})
    effort = Effort(structures=2, each=1, rounds=0, best=2, children=0, finalists=2, neighbours=20, close=0.02)
    points = [Point({"well": "narrow"}, {"width": 3.0}), Point({"well": "wide"}, {"width": 30.3})]

    class Drawn(Space):
        def draw(self, rng: np.random.Generator, structures: int, each: int) -> list[list[Point]]:
            return [[point] for point in points]

    wide = Drawn(choices=space.choices, bounds=space.bounds)
    found = random_search(wide, wells, effort, seed=1, distance=distance)
    assert [distance(trial.row) for trial in found.trials] == pytest.approx([0.01, 0.01])
    assert found.best.point == points[1]
    assert len(found.neighbours) == 20
    assert all(trial.point.choices == points[1].choices for trial in found.neighbours)


def test_of_equally_good_points_a_tie_decides() -> None:
    def flat(group: Group) -> list[Row]:
        return [{"distance": 1.0, "width": point.numbers["width"]} for point in group]

    effort = Effort(structures=1, each=30, rounds=0, best=1, children=0, neighbours=1)
    found = random_search(SPACE, flat, effort, seed=3, distance=distance, tie=lambda row: row["width"])
    assert found.best.row["width"] == min(trial.row["width"] for trial in found.trials)


@given(st.integers(0, 2**32), st.integers(1, 20), st.floats(0.0, 3.0))
def test_points_and_their_neighbours_keep_to_the_space(seed: int, structures: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    groups = SPACE.draw(rng, structures, 2)
    groups += [SPACE.neighbours(rng, group[0], spread, 3) for group in groups]
    for group in groups:
        assert all(point.choices == group[0].choices for point in group)
        for point in group:
            assert point.choices["shape"] in SPACE.choices["shape"]
            steps = point.choices["shift_s"] / 0.01
            assert 0.0 <= point.choices["shift_s"] <= 0.2
            assert steps == pytest.approx(round(steps))
            assert all(low <= point.numbers[key] <= high for key, (low, high) in SPACE.bounds.items())
            assert all(value == float(f"{value:.4g}") for value in point.numbers.values())
    seeds = [point.seed for group in groups for point in group]
    assert len(set(seeds)) == len(seeds)


@given(st.integers(0, 2**32), st.integers(1, 30))
def test_every_option_is_drawn_as_often_as_the_others_but_for_the_remainder(seed: int, structures: int) -> None:
    groups = SPACE.draw(np.random.default_rng(seed), structures, 1)
    for key, options in SPACE.choices.items():
        counts = [sum(group[0].choices[key] == option for group in groups) for option in options]
        assert max(counts) - min(counts) <= 1
