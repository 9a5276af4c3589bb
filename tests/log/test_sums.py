"""The running sums behind the books."""

from __future__ import annotations

from fractions import Fraction
from functools import reduce
from operator import add

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.logger.books.work import add_columns, add_ticks_of_batch, no_sums, sum_steps, with_rows
from haploop.protocol.trees import tree_select, tree_take

amounts = st.floats(-1e6, 1e6, allow_subnormal=False)


def total_of(values: list[float], cuts: list[int]) -> tuple[float, float]:
    """Sum and error after adding ``values`` in pieces that end at ``cuts``."""
    sums = no_sums(1)
    for piece in np.split(np.array([values]), sorted(cuts), axis=1):
        sums, _ = add_columns(sums, piece)
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
    sums = no_sums(1)
    for _ in range(10):
        sums, _ = add_columns(sums, values)
    exact = Fraction(0.1) * 10_000_000
    assert abs(Fraction(float(sums.sums[0])) - exact) > Fraction(1, 10**5)
    assert abs(Fraction(float(sums.sums[0])) + Fraction(float(sums.errors[0])) - exact) < Fraction(1, 10**15)


def test_totals_are_given_before_the_first_column_and_after_each():
    sums, totals = add_columns(no_sums(2), np.array([[1.0, 2.0], [10.0, -10.0]]))
    assert totals.tolist() == [[0.0, 1.0, 3.0], [0.0, 10.0, 0.0]]
    _, totals = add_columns(with_rows(sums, 3), np.array([[1.0], [1.0], [1.0]]))
    assert totals[:, 0].tolist() == [3.0, 0.0, 0.0]


def sum_in_order(values: np.ndarray) -> np.ndarray:
    """The sum over the last axis, one number after the other."""
    return np.array([reduce(add, row.tolist()) for row in values.reshape(-1, values.shape[-1])]).reshape(
        values.shape[:-1]
    )


@pytest.mark.parametrize("n", [1, 2, 7, 8, 9, 100])
@pytest.mark.parametrize("members", [None, 1, 5])
def test_sums_within_a_tick_run_from_first_to_last_whatever_the_memory_layout(n, members):
    rng, shape = np.random.default_rng(n), (4, n) if members is None else (4, n, members)
    values = rng.normal(size=shape) * 10.0 ** rng.integers(-8, 8, shape)
    expected = sum_in_order(np.moveaxis(values, 1, -1)).tolist()
    assert sum_steps(values).tolist() == expected
    assert sum_steps(np.asfortranarray(values)).tolist() == expected


@pytest.mark.parametrize("members", [1, 2, 3, 17, 1024])
@pytest.mark.parametrize("n", [1, 7, 10, 100])
def test_sums_and_running_sums_of_a_batch_have_every_bit_of_those_of_one_run(n, members):
    rng = np.random.default_rng(n)
    flows = rng.normal(size=(3, 4, n, members)) * 10.0 ** rng.integers(-8, 8, (3, 4, n, members))
    together = np.stack([sum_steps(flow) for flow in flows])
    batch = add_ticks_of_batch(no_sums(3, members), together.swapaxes(0, 1))
    for member in range(members):
        alone = np.stack([sum_steps(flow[..., member]) for flow in flows])
        assert alone.tolist() == sum_in_order(flows[..., member]).tolist()
        assert together[..., member].tolist() == alone.tolist()
        one, _ = add_columns(no_sums(3), alone)
        of_member = tree_take(batch, np.array([member]))
        assert (of_member.sums[:, 0].tolist(), of_member.errors[:, 0].tolist()) == (
            one.sums.tolist(),
            one.errors.tolist(),
        )


def test_dropping_members_of_a_batch_leaves_the_sums_of_the_others_to_the_bit():
    rng = np.random.default_rng(0)
    kept, pieces = rng.random(50) > 0.4, rng.normal(size=(2, 6, 3, 50)) * 10.0 ** rng.integers(-8, 8, (2, 6, 3, 50))
    all_of_them = dropped = add_ticks_of_batch(no_sums(3, 50), pieces[0])
    all_of_them = add_ticks_of_batch(all_of_them, pieces[1])
    dropped = add_ticks_of_batch(tree_select(dropped, kept), pieces[1][..., kept])
    assert 10 < np.count_nonzero(kept) < 50
    assert dropped.sums.tolist() == all_of_them.sums[:, kept].tolist()
    assert dropped.errors.tolist() == all_of_them.errors[:, kept].tolist()
