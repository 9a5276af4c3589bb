"""Random numbers: a function of seed, name and place alone, and distributed as they say."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from haploop.plant.streams import RandomStream

MANY = 100_000
# Five standard errors: a right program meets another 999 999 of a million seeds as well.
ERRORS = 5.0
KINDS = {
    "normal": (lambda stream: stream.normal(), lambda: scipy.stats.norm()),
    "uniform": (lambda stream: stream.uniform(), lambda: scipy.stats.uniform()),
    "gamma 0.3": (lambda stream: stream.gamma(0.3), lambda: scipy.stats.gamma(0.3)),
    "gamma 4": (lambda stream: stream.gamma(4.0), lambda: scipy.stats.gamma(4.0)),
}


def taken(draw, count: int = MANY) -> np.ndarray:
    return np.array([draw() for _ in range(count)])


@pytest.mark.parametrize("kind", KINDS)
def test_draws_follow_their_distribution(kind):
    """Kolmogorov and Smirnov at a confidence of 1 - 1e-6, over pieces of draws and their seams alike."""
    make, distribution = KINDS[kind]
    numbers = taken(make(RandomStream(1, "any")))
    assert scipy.stats.kstest(numbers, distribution().cdf).pvalue > 1e-6
    assert scipy.stats.kstest(numbers * 1.1, distribution().cdf).pvalue < 1e-6  # a scale wrong by a tenth is seen


@pytest.mark.parametrize("below", [1, 2, 7, 300])
def test_whole_numbers_are_equally_likely_and_below_their_bound(below):
    counts = np.bincount(taken(RandomStream(2, "any").whole(below)), minlength=below)
    assert len(counts) == below
    expected = MANY / below
    assert np.sum((counts - expected) ** 2 / expected) < scipy.stats.chi2.isf(1e-6, max(1, below - 1))


def test_a_stream_is_white_across_its_pieces():
    numbers = taken(RandomStream(3, "any").normal())
    for distance in (1, 2, 3, 4095, 4096, 8192):
        assert abs(np.mean(numbers[distance:] * numbers[:-distance])) < ERRORS / np.sqrt(MANY - distance)


def test_streams_of_other_names_and_seeds_know_nothing_of_one_another():
    streams = [RandomStream(seed, name) for seed in (0, 1, 2**63 - 1) for name in ("noise", "jitter", "loss")]
    numbers = np.array([taken(stream.normal(), 50_000) for stream in streams])
    correlations = np.corrcoef(numbers) - np.eye(len(streams))
    assert np.abs(correlations).max() < ERRORS / np.sqrt(50_000)


def test_drawing_from_one_stream_leaves_all_others_as_they_are():
    alone = taken(RandomStream(4, "jitter").uniform(), 10_000)
    other, draw = RandomStream(4, "noise").normal(), RandomStream(4, "jitter").uniform()
    beside = []
    for place in range(10_000):
        beside.append(draw())
        for _ in range(place % 3):
            other()
    assert np.array_equal(alone, beside)


def test_draws_of_a_seed_and_name_are_these_numbers():
    """Recorded: a log is repeated from its seed, so a library that draws otherwise must be noticed."""
    assert taken(RandomStream(1, "noise").normal(), 3).tolist() == RECORDED["normal"]
    assert taken(RandomStream(1, "loss").uniform(), 3).tolist() == RECORDED["uniform"]
    assert taken(RandomStream(1, "jitter").whole(100), 3).tolist() == RECORDED["whole"]
    assert taken(RandomStream(1, "jitter").gamma(2.0), 3).tolist() == RECORDED["gamma"]


RECORDED = {
    "normal": [0.9935744931047635, -0.5291723556863457, 0.4168772300634641],
    "uniform": [0.0015717158119193941, 0.11206070107568822, 0.24217232116265852],
    "whole": [35, 18, 67],
    "gamma": [3.917068776263638, 1.529433136634518, 1.5326184295556131],
}
