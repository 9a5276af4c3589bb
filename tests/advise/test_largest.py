"""The largest steady stiffness, found by trying."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scene_makers import KINDS, scene

from haploop.tools.advise.largest import LEAST_N_M, Limit, Loops, Pace, largest
from haploop.tools.advise.steady import Judge, Judgement
from haploop.tools.advise.tasks import tasks
from haploop.tools.advise.variations import Change
from haploop.tools.one_tick import OneTickMap

QUICK, SLOW = Pace((1 / 8, 1 / 4, 1 / 2, 1.0, 2.0, 4.0, 8.0), 5, 0.02), Pace((1.0,), 1, 0.05)


def limit_of(is_steady, start: float, pace: Pace, most: float = 1e5) -> Limit:
    """The limit of a loop of which only this is known."""

    def judged(scenes):
        return [Judgement(is_steady(k), "", 0.0, {}) for k in scenes]

    made: Any = lambda k: [k]  # noqa: E731
    return largest({"": Loops(made, start, most)}, judged, pace)[""]


@pytest.mark.parametrize("pace", [QUICK, SLOW])
@given(edge=st.floats(2.0, 9e4), start=st.floats(1.0, 9e4))
def test_the_limit_is_found_from_wherever_the_search_starts(pace, edge, start):
    found = limit_of(lambda k: k < edge, start, pace)
    assert found.stiffness_N_m < edge <= found.not_steady_N_m <= (1.0 + 1e-9 + pace.tolerance) * found.stiffness_N_m


def test_a_softer_wall_that_is_not_steady_lowers_the_limit_and_what_lies_above_is_told():
    found = limit_of(lambda k: k < 150.0 or 250.0 < k < 400.0, 300.0, SLOW)
    assert found.stiffness_N_m == pytest.approx(150.0, rel=0.05)
    assert found.islands_N_m
    assert all(250.0 < k < 400.0 for k in found.islands_N_m)


def test_a_loop_that_is_never_steady_has_no_limit_and_one_that_always_is_has_no_end():
    never, always = limit_of(lambda k: False, 50.0, SLOW), limit_of(lambda k: True, 50.0, SLOW, most=1000.0)
    assert (never.stiffness_N_m, never.not_steady_N_m) == (0.0, LEAST_N_M)
    assert (always.stiffness_N_m, always.not_steady_N_m) == (1000.0, float("inf"))


DEVICE = {
    "device": {"mass": 0.05, "damping": 1.0},
    "hand": {"stiffness": 20.0, "damping": 0.5},
    "clock": {"round_trip_delay": 0.002},
}


@pytest.mark.parametrize(
    "element", [None, {"kind": "damping", "damping": 2.0}, {"kind": "bidirectional-inertia", "mass": 0.01}]
)
def test_where_the_loop_is_linear_the_limit_found_by_runs_is_that_of_the_exact_map(element):
    elements = [{"acts": "in-contact", **element}] if element else []
    read = scene(**DEVICE, wall={"position": 0.0, "stiffness": 100.0})
    asked = tasks(read, has_task=False)
    exact = OneTickMap.of({**read, "dissipation": elements}).stiffness_limit()
    with Judge(KINDS, workers=1) as judge:
        found = largest({"": Loops(lambda k: asked.of(k, elements), 300.0, 1e5)}, judge.judged, QUICK)[""]
    assert found.stiffness_N_m <= exact * (1.0 + 1e-6)
    assert found.not_steady_N_m >= exact * (1.0 - QUICK.tolerance)


def test_a_fifth_more_delay_takes_what_gil_et_al_2009_say():
    read = scene(**DEVICE, wall={"position": 0.0, "stiffness": 100.0})
    asked = tasks(read, has_task=False)
    cells = {
        factor: Loops(lambda k, factor=factor: asked.of(k, [], Change("delay", factor).on), 500.0, 1e5)
        for factor in (1.0, 1.2)
    }
    with Judge(KINDS, workers=1) as judge:
        found = largest(cells, judge.judged, QUICK)
    soft = {factor: 1.5 / (0.0005 + factor * 0.002) for factor in cells}
    for factor, limit in found.items():
        assert limit.stiffness_N_m == pytest.approx(soft[factor], rel=0.06)
    assert found[1.2].stiffness_N_m / found[1.0].stiffness_N_m == pytest.approx(soft[1.2] / soft[1.0], rel=0.04)
