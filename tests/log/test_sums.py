"""The running sums behind the books."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.logger.books.sums import RunningSums, by_tick, by_tick_of_loops, sum_in_order

amounts = st.floats(-1e6, 1e6, allow_subnormal=False)


def total_of(values: list[float], cuts: list[int]) -> tuple[float, float]:
    """Sum and error after adding ``values`` in pieces that end at ``cuts``."""
    sums = RunningSums()
    sums.grow(1)
    for piece in np.split(np.array([values]), sorted(cuts), axis=1):
        sums.add(piece)
    return float(sums.sums[0]), float(sums.errors[0])


@given(st.lists(amounts, min_size=1, max_size=60), st.lists(st.integers(0, 60), max_size=5))
def test_how_a_run_is_cut_into_blocks_changes_no_bit_of_its_sums(values, cuts):
    assert total_of(values, cuts) == total_of(values, [])


@given(st.lists(amounts, min_size=1, max_size=60))
def test_sum_and_error_together_are_the_exact_sum_to_twice_the_digits(values):
    exact = sum(map(Fraction, values))
    high, low = total_of(values, [])
    magnitude = sum(abs(Fraction(v)) for v in values)
    assert abs(Fraction(high) + Fraction(low) - exact) <= magnitude * Fraction(2) ** -95


def test_a_plain_running_sum_loses_what_the_books_must_keep():
    """Ten million times 0.1: the plain sum is off by 1e-9 relative drift, the kept error brings back every digit."""
    values = np.full((1, 1_000_000), 0.1)
    sums = RunningSums()
    sums.grow(1)
    for _ in range(10):
        sums.add(values)
    exact = Fraction(0.1) * 10_000_000
    assert abs(Fraction(float(sums.sums[0])) - exact) > Fraction(1, 10**5)
    assert abs(Fraction(float(sums.sums[0])) + Fraction(float(sums.errors[0])) - exact) < Fraction(1, 10**15)


def test_totals_are_given_before_the_first_column_and_after_each():
    sums = RunningSums()
    sums.grow(2)
    totals = sums.add(np.array([[1.0, 2.0], [10.0, -10.0]]))
    assert totals.tolist() == [[0.0, 1.0, 3.0], [0.0, 10.0, 0.0]]
    sums.grow(3)
    assert sums.add(np.array([[1.0], [1.0], [1.0]]))[:, 0].tolist() == [3.0, 0.0, 0.0]


@pytest.mark.parametrize("n", [1, 2, 7, 8, 9, 100])
def test_sums_within_a_tick_run_from_first_to_last_whatever_the_memory_layout(n):
    rng = np.random.default_rng(n)
    values = rng.normal(size=(3, 4, n)) * 10.0 ** rng.integers(-8, 8, (3, 4, n))
    expected = [[math.nan] * 4 for _ in range(3)]
    for i in range(3):
        for j in range(4):
            total = 0.0
            for value in values[i, j]:
                total += value
            expected[i][j] = total
    assert sum_in_order(values).tolist() == expected
    assert sum_in_order(np.asfortranarray(values)).tolist() == expected


@pytest.mark.parametrize("loops", [1, 2, 3, 17, 1024])
@pytest.mark.parametrize("n", [1, 7, 10, 100])
def test_sums_and_running_sums_of_many_loops_have_every_bit_of_those_of_one(n, loops):
    rng = np.random.default_rng(n)
    flows = rng.normal(size=(3, 4 * n, loops)) * 10.0 ** rng.integers(-8, 8, (3, 4 * n, loops))
    together, many = np.stack([by_tick_of_loops(flow, n) for flow in flows]), RunningSums(loops)
    many.grow(3)
    many.add_of_loops(together)
    for loop in range(loops):
        alone, one = np.stack([by_tick(flow[:, loop], n) for flow in flows]), RunningSums()
        one.grow(3)
        one.add(alone)
        assert alone.tolist() == sum_in_order(flows[..., loop].reshape(3, 4, n)).tolist()
        assert together[..., loop].tolist() == alone.tolist()
        of_one = many.of_loops(np.array([loop]))
        assert (of_one.sums[:, 0].tolist(), of_one.errors[:, 0].tolist()) == (one.sums.tolist(), one.errors.tolist())
