"""Changes of the sign of a power series: every one, and nothing else."""

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from oracles.continuous.bodies import sign_changes


def series_of(places: list[Fraction]) -> list:
    """Coefficients of the product of (t - place), lowest first."""
    series = [Fraction(1)]
    for place in places:
        shifted, scaled = [Fraction(0), *series], [-place * c for c in [*series, Fraction(0)]]
        series = [a + b for a, b in zip(shifted, scaled, strict=True)]
    return [mpf(c.numerator) / c.denominator for c in series]


@settings(max_examples=25)
@given(st.sets(st.integers(1, 999), min_size=1, max_size=5), st.sets(st.integers(1001, 1500), max_size=2))
def test_all_places_within_the_length_are_found_and_none_beyond(inside, beyond):
    with mp.workdps(50):
        found = sign_changes(series_of([Fraction(place, 1000) for place in inside | beyond]), mpf(1))
        assert len(found) == len(inside)
        for t, place in zip(found, sorted(inside), strict=True):
            assert abs(t - mpf(place) / 1000) < mpf("1e-30")


def test_two_places_closer_than_a_float_can_tell_are_two():
    with mp.workdps(50):
        near = Fraction(3, 10)
        found = sign_changes(series_of([near, near + Fraction(1, 10**18)]), mpf(1))
        assert len(found) == 2
        assert 0.9e-18 < found[1] - found[0] < 1.1e-18


def test_what_only_comes_near_zero_has_none():
    with mp.workdps(50):
        touching = series_of([Fraction(3, 10), Fraction(3, 10)])
        touching[0] += mpf("1e-20")
        assert sign_changes(touching, mpf(1)) == []


@pytest.mark.parametrize("series", [[mpf(1)], [mpf(2), mpf(-1)], [mpf(0)]])
def test_what_is_constant_or_ends_before_has_none(series):
    assert sign_changes(series, mpf(1)) == []
