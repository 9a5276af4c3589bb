"""Grants by the wall clock: each tick when it is due, what was held up, how late. Time is a number the tests give."""

import math
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from haploop.launch.clock.pace import CATCH_UP_S, FASTEST, LEAST_GRANT_S, SLOWEST, Pace, PaceError, pace_of
from helpers.runs.clocks import TICKS, clock, granted

CATCH_UP = round(CATCH_UP_S * 1000)


@given(start=st.floats(0, 1e7), pace=st.sampled_from([0.1, 1.0, 2.0]))
def test_at_a_pace_every_tick_is_granted_when_it_is_due_one_by_one(start: float, pace: float) -> None:
    subject = clock(pace)
    now, until = start, 0
    while until < 30:
        assert granted(subject, now=now) == until + 1
        until += 1
        wait_s = subject.wait_s(now)
        assert wait_s is not None
        assert wait_s <= 0.001 / pace + 1e-6
        assert granted(subject, now=now + 0.9 * wait_s) == until, "before it is due"
        now += wait_s + 1e-7
    assert now - start == pytest.approx(30 * 0.001 / pace, abs=1e-4)


def test_a_pace_beyond_two_ticks_a_millisecond_goes_in_blocks_half_a_millisecond_long() -> None:
    subject = clock(20.0)
    now, grants = 5.0, [granted(subject, now=5.0)]
    while grants[-1] < 200:
        now += subject.wait_s(now) or 0.0
        grants.append(granted(subject, now=now + 1e-7))
    steps = {after - before for before, after in pairwise(grants)} - {0}
    assert steps == {round(20.0 * LEAST_GRANT_S * 1000)}


def test_what_was_held_up_is_made_up_for_by_no_more_than_the_stated_ticks_and_the_rest_is_lost() -> None:
    subject = clock(1.0)
    assert granted(subject, now=100.0) == 1
    assert granted(subject, now=102.0) == 1 + CATCH_UP
    assert granted(subject, now=102.0) == 1 + CATCH_UP
    assert granted(subject, now=102.0011) == 2 + CATCH_UP
    assert subject.pace.lost_s == pytest.approx(2.0 - CATCH_UP_S, abs=0.001)


def test_a_plant_that_stands_still_is_never_granted_more_than_it_may_make_up_for() -> None:
    subject = clock(1.0)
    for millisecond in range(500):
        subject.grant(TICKS, millisecond / 1000, 0)
    assert subject.until == CATCH_UP
    assert subject.wait_s(0.5) is None, "nothing will be due before the plant has reported"
    assert subject.grant(TICKS, 0.5, CATCH_UP) == 2 * CATCH_UP


def test_time_spent_standing_still_is_neither_made_up_for_nor_lost() -> None:
    subject = clock(1.0)
    granted(subject, now=100.0)
    subject.pause()
    assert granted(subject, now=200.0) == 1
    assert subject.wait_s(200.0) is None
    subject.resume()
    assert [granted(subject, now=now) for now in (200.0, 200.00101, 200.00202)] == [2, 3, 4]
    subject.step(2)
    assert [granted(subject, now=now) for now in (300.0, 300.00101, 300.1)] == [5, 6, 6]
    assert subject.pace.lost_s == 0.0


def test_the_schedule_begins_with_the_first_grant_not_while_nodes_are_waited_for() -> None:
    subject = clock(1.0)
    assert subject.wait_s(10.0) is None
    assert granted(subject, now=50.0) == 1
    assert subject.pace.lost_s == 0.0


def test_only_a_pace_makes_the_clock_look_at_the_time() -> None:
    free = clock()
    granted(free, 0)
    assert free.wait_s(0.0) is None


def test_the_lateness_of_ticks_is_that_of_a_list_of_them_to_its_classes() -> None:
    subject = Pace(1000, 1.0)
    late_s = [0.0001 * (1 + tick % 37) for tick in range(999)] + [0.005]
    for tick, late in enumerate(late_s):
        due = 50.0 + tick / 1000
        assert subject.grant(tick, TICKS, due) == tick + 1
        subject.done(tick + 1, due + late)
    said, ordered = subject.lateness(), sorted(late_s)
    assert said["ticks"] == 1000
    assert said["median_s"] == pytest.approx(ordered[500], rel=0.06)
    assert said["percent_99_s"] == pytest.approx(ordered[990], rel=0.06)
    assert said["most_s"] == pytest.approx(0.005)
    assert said["late_ticks"] == sum(late > 0.001 + 1e-9 for late in late_s)


def test_ticks_of_a_fast_pace_that_are_done_with_their_block_are_not_late() -> None:
    subject, until = Pace(1000, 20.0), 0
    for block in range(100):
        now = 3.0 + block * 0.0005
        granted = subject.grant(until, 10**6, now)
        subject.done(granted, now + 0.0002)
        until = granted
    said = subject.lateness()
    assert said["ticks"] > 900
    assert said["late_s"] == 0.001
    assert said["late_ticks"] == 0


def test_a_stall_shows_in_full_in_the_most_that_a_tick_was_late() -> None:
    subject = Pace(1000, 1.0)
    subject.grant(0, TICKS, 10.0)
    subject.done(1, 10.0001)
    subject.grant(1, TICKS, 12.0)
    subject.done(21, 12.001)
    said = subject.lateness()
    assert said["most_s"] == pytest.approx(2.0, abs=1e-6)
    assert said["late_ticks"] == 20
    assert said["ticks"] == 21


def test_a_tick_is_late_by_when_it_was_done_not_by_when_it_was_granted() -> None:
    subject = Pace(1000, 1.0)
    for tick in range(10):
        subject.grant(tick, TICKS, 10.0 + tick / 1000)
    subject.done(4, 10.5)
    assert subject.lateness()["ticks"] == 4
    subject.done(10, 10.5)
    said = subject.lateness()
    assert said["ticks"] == 10
    assert said["most_s"] == pytest.approx(0.5)


def test_ticks_granted_at_one_pace_are_late_by_it_though_another_was_set_before_they_were_done() -> None:
    subject = Pace(1000, 0.1)
    subject.grant(0, TICKS, 10.0)
    granted = subject.grant(1, TICKS, 10.02)
    subject.set(100.0)
    subject.done(granted, 10.02)
    assert granted == 3
    assert subject.lateness()["most_s"] == pytest.approx(0.02)  # of the first; the others were due at 10.01 and 10.02


def test_a_run_without_a_pace_tells_no_lateness() -> None:
    subject = clock()
    granted(subject, 0)
    subject.pace.done(100, 5.0)
    assert subject.pace.lateness() == {}


@given(st.floats(SLOWEST, FASTEST), st.integers(1, 100_000), st.lists(st.floats(0, 10), max_size=30))
def test_whatever_the_pace_grants_never_go_back_and_waiting_is_finite(
    pace: float, rate: int, passed: list[float]
) -> None:
    subject, until, now = Pace(rate, pace), 0, 1e6
    for seconds in passed:
        now += seconds
        before, until = until, subject.grant(until, 10**9, now)
        assert before <= until <= before + subject.most_at_once
        assert math.isfinite(subject.wait_s(until, now))


@pytest.mark.parametrize("pace", [1e305, 1e-300, 0, -1.0, math.inf, -math.inf, math.nan, True, "quick", "1", None, [1]])
def test_a_pace_that_cannot_be_kept_is_refused_with_those_that_can(pace: Any) -> None:
    with pytest.raises(PaceError, match=r"from 1e-06 to 1e\+06, or free"):
        pace_of(pace)


@pytest.mark.parametrize("pace", [1e305, 0.0, -math.inf, math.nan])
def test_no_run_begins_at_a_pace_that_cannot_be_kept_and_none_changes_to_it(pace: float) -> None:
    with pytest.raises(PaceError):
        clock(pace)
    subject = clock(2.0)
    with pytest.raises(PaceError):
        subject.run_at(pace)
    assert subject.pace.rate == 2.0


def test_a_pace_is_a_number_or_free() -> None:
    assert pace_of("free") == math.inf
    assert [pace_of(pace) for pace in (1, 0.1, SLOWEST, FASTEST)] == [1.0, 0.1, SLOWEST, FASTEST]
