"""Intervals of confidence: closed forms, tables, and how often they hold what they should."""

from __future__ import annotations

import math

import numpy as np
import pytest

from haploop.tools.search.intervals import mean_interval, share_interval


def test_the_interval_of_a_share_is_that_of_wilsons_formula() -> None:
    """9 of 576: 0.82 to 2.94 % (any table of Wilson's interval), and none of 10 leaves up to 27.8 %."""
    found = share_interval([True] * 9 + [False] * 567)
    assert (found.low, found.high) == (pytest.approx(0.00824, abs=2e-5), pytest.approx(0.02943, abs=2e-5))
    assert share_interval([False] * 10)[:2] == (0.0, 0.0)
    assert share_interval([False] * 10).high == pytest.approx(0.2775, abs=1e-4)
    assert math.isnan(share_interval([]).value)


def test_what_is_drawn_in_clusters_that_agree_tells_no_more_than_one_of_each() -> None:
    """Twenty members of each of ten clusters, alike within, tell what ten draws do; never more than one by one."""
    clusters = [i for i in range(10) for _ in range(20)]
    held = [i < 3 for i in clusters]
    alike, apart, ten = share_interval(held, clusters), share_interval(held), share_interval([True] * 3 + [False] * 7)
    assert alike.high - alike.low > 3.0 * (apart.high - apart.low)
    assert alike.high - alike.low == pytest.approx(ten.high - ten.low, rel=0.1)
    even = [i % 10 < 3 for i in range(200)]
    assert share_interval(even, clusters) == share_interval(even)


def test_the_interval_of_a_mean_is_students_and_infinite_for_one() -> None:
    """Two values: t s / sqrt(2) to either side, with t = tan(0.475 pi), as Student's t with one degree is Cauchy's."""
    found = mean_interval([1.0, 3.0])
    assert found.high - found.value == pytest.approx(math.tan(0.475 * math.pi))
    assert math.isinf(mean_interval([1.0]).high)


def test_an_interval_of_a_mean_holds_the_truth_nineteen_times_of_twenty() -> None:
    rng = np.random.default_rng(1)
    for n in (3, 12, 30):
        held = [i.low <= 0.0 <= i.high for i in map(mean_interval, rng.normal(size=(4000, n)))]
        assert np.mean(held) == pytest.approx(0.95, abs=0.012)
