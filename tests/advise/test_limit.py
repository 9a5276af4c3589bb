"""The limit of a wall is found from wherever the search starts, and lies below every wall that fails."""

from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.tools.advise.walls.limit import LEAST_N_M, MOST_N_M, Query, ladder, limits
from haploop.tools.advise.walls.store import Failure

TOLERANCE = 0.05
FAILS = Failure("a case", 1.0, gone=False)


def limits_of(bears, *rungs, least=LEAST_N_M):
    """The limits of loops of which only this is known: from a stiffness to whether it is borne."""
    tried: list[float] = []

    def of_jobs(jobs):
        tried.extend(wall.stiffness_N_m for job in jobs for wall in job.walls)
        return [[None if job.loop(wall.stiffness_N_m) else FAILS for wall in job.walls] for job in jobs]

    trial: Any = SimpleNamespace(of_jobs=of_jobs)
    queries: Any = [Query(each, (), (), rungs, least) for each in bears]
    found = limits(trial, queries, TOLERANCE)
    assert len(bears) > 1 or len(set(tried)) == len(tried), "no wall is tried twice"
    return found


@given(edge=st.floats(2.0, 9e5), low=st.floats(1.0, 1e4), times=st.floats(1.0, 100.0))
def test_the_limit_is_found_from_wherever_the_search_starts(edge, low, times):
    [found] = limits_of([lambda k: k < edge], *ladder(low, low * times + 1.0, 1.5))
    assert found.stiffness_N_m < edge <= found.fails_N_m
    assert found.fails_N_m <= found.stiffness_N_m * (1.0 + TOLERANCE) * (1.0 + 1e-9)


@given(edges=st.lists(st.floats(2.0, 9e5), min_size=2, max_size=5))
def test_many_limits_are_found_as_each_alone(edges):
    bears = [lambda k, edge=edge: k < edge for edge in edges]
    rungs = ladder(10.0, 1e5, 2.0)
    assert limits_of(bears, *rungs) == [limits_of([each], *rungs)[0] for each in bears]


def test_a_softer_wall_that_fails_is_the_limit_and_what_bears_above_is_told():
    [found] = limits_of([lambda k: k < 150.0 or 250.0 < k < 400.0], *ladder(10.0, 1000.0, 1.3))
    assert found.stiffness_N_m == pytest.approx(150.0, rel=0.05)
    assert found.borne_above_N_m
    assert all(250.0 < k < 400.0 for k in found.borne_above_N_m)


def test_a_loop_that_bears_nothing_has_no_limit_and_one_that_bears_all_has_no_end():
    never, always = limits_of([lambda k: False, lambda k: True], *ladder(10.0, 100.0, 2.0))
    assert (never.stiffness_N_m, never.fails_N_m) == (0.0, LEAST_N_M)
    assert (always.stiffness_N_m, always.fails_N_m) == (MOST_N_M, float("inf"))


@given(edge=st.floats(2.0, 9e5))
def test_a_limit_below_what_is_asked_for_is_none_and_one_above_is_found_as_always(edge):
    rungs = ladder(1000.0, 5000.0, 1.5)
    [found] = limits_of([lambda k: k < edge], *rungs, least=1000.0)
    whole = limits_of([lambda k: k < edge], *rungs)[0]
    assert found == whole if edge > 1000.0 else (found.stiffness_N_m, found.fails_N_m) == (0.0, 1000.0)
