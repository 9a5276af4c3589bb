"""The largest steady stiffness, found by trying."""

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.protocol.scene.scene import ElementTable
from haploop.tools.advise.judge import Judge, Judgement
from haploop.tools.advise.largest import LEAST_N_M, NEAR, WIDE, Limit, Pace, StiffnessQuery, largest_steady
from haploop.tools.advise.tasks import make_tasks
from haploop.tools.advise.variations import Change
from haploop.tools.linear.one_tick import OneTickMap
from helpers.scenes.least import KINDS, scene

QUICK, SLOW = WIDE["arrays"], WIDE["alone"]


def limit_of(is_steady, start: float, pace: Pace, most: float = 1e5) -> Limit:
    """The limit of a loop of which only this is known."""
    return limits_of({"": lambda k, _: is_steady(k)}, start, pace, most)[""]


def limits_of(cells, start: float, pace: Pace, most: float = 1e5, **rivals: Any) -> dict[str, Limit]:
    """The limits of loops that are steady or not by a stiffness in N/m, and by whether they are looked at patiently."""

    def judged(looks, patient):
        return [Judgement(look(waits), "", 0.0, {}) for look, waits in zip(looks, patient, strict=True)]

    def loops(is_steady) -> StiffnessQuery:
        def make(k, _) -> Any:
            return [lambda waits: is_steady(k, waits)]

        return StiffnessQuery(make, start, most)

    return largest_steady({name: loops(is_steady) for name, is_steady in cells.items()}, judged, pace, **rivals)


@pytest.mark.parametrize("pace", [*WIDE.values(), *NEAR.values()])
@given(edge=st.floats(2.0, 9e4), start=st.floats(1.0, 9e4))
def test_the_limit_is_found_from_wherever_the_search_starts(pace, edge, start):
    found = limit_of(lambda k: k < edge, start, pace)
    assert found.stiffness_N_m < edge <= found.not_steady_N_m
    assert found.is_within(pace.tolerance)


@pytest.mark.parametrize("pace", WIDE.values())
@given(edge=st.floats(10.0, 9e4), share=st.floats(0.05, 1.5), start=st.floats(1.0, 9e4))
def test_what_fails_a_thorough_look_lowers_the_limit_to_where_nothing_does(pace, edge, share, start):
    found = limits_of({"": lambda k, waits: k < (min(1.0, share) * edge if waits else edge)}, start, pace)[""]
    true_edge = min(1.0, share) * edge
    if true_edge > LEAST_N_M * (1.0 + pace.tolerance):
        assert found.stiffness_N_m < true_edge <= found.not_steady_N_m
    assert found.is_within(pace.tolerance)


@pytest.mark.parametrize("pace", WIDE.values())
@given(edges=st.lists(st.floats(2.0, 9e4), min_size=2, max_size=6), softest=st.booleans())
def test_of_rivals_the_one_that_counts_is_found_as_if_it_were_alone(pace, edges, softest):
    cells = {str(i): lambda k, _, edge=edge: k < edge for i, edge in enumerate(edges)}
    found = limits_of(cells, 300.0, pace, rivals=lambda name: "all", softest=softest)
    true = dict(zip(found, edges, strict=True))
    pick = min if softest else max
    counts = pick(found, key=lambda name: found[name].not_steady_N_m if softest else found[name].stiffness_N_m)
    assert true[counts] == pytest.approx(pick(edges), rel=pace.tolerance)
    assert found[counts].is_within(pace.tolerance)
    for name, limit in found.items():
        assert limit.stiffness_N_m < true[name] <= limit.not_steady_N_m


def test_a_rival_that_fails_a_thorough_look_gives_way_to_the_next():
    cells = {"promising": lambda k, waits: k < (100.0 if waits else 1000.0), "sound": lambda k, _: k < 400.0}
    found = limits_of(cells, 300.0, QUICK, rivals=lambda name: "")
    assert found["sound"].is_within(QUICK.tolerance)
    assert found["sound"].stiffness_N_m == pytest.approx(400.0, rel=0.02)
    assert found["promising"].not_steady_N_m <= found["sound"].stiffness_N_m


@pytest.mark.parametrize("is_one_run", [True, False])
def test_what_one_run_tells_for_good_is_not_run_again(is_one_run):
    tried: list[float] = []

    def judged(looks, _):
        tried.extend(looks)
        return [Judgement(k < 700.0, "", 0.0, {}) for k in looks]

    made: Any = lambda k, _: [k]  # noqa: E731
    found = largest_steady({"": StiffnessQuery(made, 300.0, 1e5, is_one_run)}, judged, QUICK)[""]
    assert found.stiffness_N_m == pytest.approx(700.0, rel=QUICK.tolerance)
    assert (len(set(tried)) == len(tried)) == is_one_run


def test_a_softer_wall_that_is_not_steady_lowers_the_limit_and_what_lies_above_is_told():
    found = limit_of(lambda k: k < 150.0 or 250.0 < k < 400.0, 300.0, SLOW)
    assert found.stiffness_N_m == pytest.approx(150.0, rel=0.05)
    assert found.steady_above_N_m
    assert all(250.0 < k < 400.0 for k in found.steady_above_N_m)


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
    elements = [ElementTable.from_dict(element)] if element else []
    read = scene(**DEVICE, wall={"position": 0.0, "stiffness": 100.0})
    asked = make_tasks(read, has_task=False)
    exact = OneTickMap.from_scene(replace(read, dissipation=tuple(elements))).stiffness_limit()
    with Judge(KINDS, workers=1) as judge:
        found = largest_steady(
            {"": StiffnessQuery(lambda k, thorough: asked.make_runs(k, elements, thorough=thorough), 300.0, 1e5)},
            judge.judge,
            QUICK,
        )[""]
    assert found.stiffness_N_m <= exact * (1.0 + 1e-6)
    assert found.not_steady_N_m >= exact * (1.0 - QUICK.tolerance)


def test_a_fifth_more_delay_takes_what_gil_et_al_2009_say():
    read = scene(**DEVICE, wall={"position": 0.0, "stiffness": 100.0})
    asked = make_tasks(read, has_task=False)
    changes = {factor: Change("delay", factor) for factor in (1.0, 1.2)}
    cells = {
        factor: StiffnessQuery(lambda k, _, change=change: asked.make_runs(k, [], change.apply), 500.0, 1e5)
        for factor, change in changes.items()
    }
    with Judge(KINDS, workers=1) as judge:
        found = largest_steady(cells, judge.judge, QUICK)
    soft = {factor: 1.5 / (0.0005 + factor * 0.002) for factor in cells}
    for factor, limit in found.items():
        assert limit.stiffness_N_m == pytest.approx(soft[factor], rel=0.06)
    assert found[1.2].stiffness_N_m / found[1.0].stiffness_N_m == pytest.approx(soft[1.2] / soft[1.0], rel=0.04)
