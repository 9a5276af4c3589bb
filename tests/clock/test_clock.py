"""Grants of the pure clock, standing still and ending included. Time is a number the tests give."""

import math
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from haploop.launch.clock.clock import MOST_GRANTS, Clock, ClockError
from haploop.launch.scene.mistakes import SceneError
from haploop.protocol.scene.scene import Run
from haploop.protocol.ticks import Timebase
from haploop.protocol.transport.wire import MAX_FRAME_BYTES
from helpers.runs.clocks import DAMPING, SWAP, TICKS, WINDOW, clock, granted, sent
from helpers.scenes.least import KINDS, scene

# How far


def test_the_grant_stays_within_the_window_beyond_the_slowest_node_and_ends_with_the_run() -> None:
    subject = clock()
    assert [granted(subject, slowest) for slowest in (0, 0, 1, 250, 599)] == [400, 400, 401, 650, 999]
    assert [granted(subject, slowest) for slowest in (600, 700)] == [1000, 1000]
    assert subject.is_last


def test_the_window_is_that_of_the_scene() -> None:
    assert granted(clock(run={"block_ticks": 7, "window_blocks": 3}), 0) == 21


def test_the_window_and_a_block_hold_only_so_many_steps_however_fast_the_plant() -> None:
    fast = {"plant_rate": 10_000_000, "control_rate": 1000}
    assert granted(clock(run={"block_ticks": 1000, "window_blocks": 2}, clock=fast), 0) == 12
    for n in (1, 10, 65, 66, 10_000):
        length = Timebase(n, 1, 0, 1).block_ticks(Run(block_ticks=10**6))
        assert 1 <= length <= 65_536 / n
        assert 8 * 20 * length * n < MAX_FRAME_BYTES, "twenty columns fit in what a socket takes"


COMMANDS = st.one_of(
    st.tuples(st.just("done"), st.integers(0, TICKS)),
    st.tuples(st.just("pause"), st.none()),
    st.tuples(st.just("resume"), st.none()),
    st.tuples(st.just("step"), st.integers(1, 50)),
    st.tuples(st.just("swap"), st.one_of(st.none(), st.floats(0, 1.1))),
    st.tuples(st.just("stop"), st.none()),
    st.tuples(st.just("ended"), st.integers(0, TICKS)),
)


@given(
    doings=st.lists(st.tuples(COMMANDS, st.floats(0, 0.3)), max_size=40),
    pace=st.sampled_from([0.3, 2.0, math.inf]),
    pauses=st.sets(st.integers(0, TICKS - 1), max_size=3),
)
def test_whatever_is_asked_the_grant_is_monotone_bounded_and_no_event_comes_late_or_twice(
    doings: list[tuple[tuple[str, Any], float]], pace: float, pauses: set[int]
) -> None:
    subject = clock(pace, event=[{"at": tick / 1000, "pause": True} for tick in sorted(pauses)])
    slowest, now, before = 0, 10.0, 0
    changes: list[int] = []
    taken: list[tuple[int, dict[str, Any]]] = []
    for (verb, argument), passed in doings:
        now += passed
        stood, stood_at = subject.paused, subject.until
        match verb:
            case "done":
                slowest = max(slowest, min(argument, subject.until))
            case "pause":
                assert subject.pause() == stood_at
            case "resume":
                subject.resume()
            case "step":
                assert subject.step(argument) <= subject.end
            case "stop":
                assert subject.stop() == subject.end <= subject.until
            case "ended":
                subject.end_at(min(argument, subject.until))
            case "swap":
                try:
                    changes.append(subject.change(SWAP, argument))
                    assert stood_at <= changes[-1] < subject.end
                except (ClockError, SceneError):
                    pass
        until = subject.grant(slowest, now)
        assert before <= until <= min(slowest + WINDOW, TICKS)
        if stood and verb not in ("resume", "step", "stop") and subject.paused and subject._step_target is None:
            assert until == before
        due = subject.take_events()
        assert all(before <= tick <= until for tick, _ in due), "an event came after its tick, or too early"
        taken += due
        before = until
    assert [tick for tick, _ in taken] == sorted(tick for tick, _ in taken)
    swaps = [tick for tick, event in taken if "swap" in event]
    assert swaps == sorted(tick for tick in changes if tick <= before)


# Standing still and ending


def test_a_pause_stands_at_what_is_granted_until_resumed() -> None:
    subject = clock()
    granted(subject, 0)
    assert subject.pause() == 400
    assert granted(subject, 400) == 400
    assert subject.resume() == 400
    assert granted(subject, 400) == 800


def test_a_pause_of_the_scene_stands_at_its_tick_once() -> None:
    subject = clock(event=[{"at": 0.25, "pause": True}])
    assert [granted(subject), granted(subject)] == [250, 250]
    assert subject.paused
    subject.resume()
    assert granted(subject) == 1000


def test_a_pause_at_the_first_tick_holds_the_run_before_it_begins() -> None:
    subject = clock(event=[{"at": 0.0, "pause": True}])
    assert granted(subject, 0) == 0
    assert subject.paused


def test_a_step_goes_on_from_where_the_last_step_leads_and_stands_there() -> None:
    subject = clock()
    granted(subject, 0)
    subject.pause()
    assert subject.step(3) == 403
    assert subject.step(2) == 405
    assert [granted(subject), granted(subject)] == [405, 405]
    assert subject.paused


def test_a_step_also_keeps_within_the_window_and_the_end() -> None:
    subject = clock()
    subject.pause()
    assert subject.step(5000) == 1000
    assert granted(subject, 0) == 400


def test_a_pause_that_was_stepped_over_does_not_stop_the_run_a_second_time() -> None:
    subject = clock(event=[{"at": 0.1, "pause": True}, {"at": 0.6, "pause": True}])
    assert granted(subject) == 100
    granted(subject)
    subject.step(50)
    assert granted(subject) == 150
    subject.pause()
    subject.step(500)
    assert granted(subject) == 650
    subject.resume()
    assert granted(subject) == 1000


def test_a_stop_ends_the_run_at_what_is_granted_even_while_it_stands() -> None:
    subject = clock()
    granted(subject, 0)
    subject.pause()
    assert subject.stop() == 400
    assert granted(subject, 400) == 400
    assert subject.is_last


def test_a_stop_of_the_scene_ends_the_run_at_its_tick() -> None:
    subject = clock(event=[{"at": 0.3, "stop": True}])
    assert granted(subject) == 300
    assert subject.is_last
    assert sent(subject) == [(300, "stop")]


def test_after_a_stop_what_lies_behind_it_never_happens() -> None:
    subject = clock(event=[{"at": 0.9, "swap": DAMPING}])
    granted(subject, 0)
    subject.stop()
    subject.note({"stop": True})
    assert granted(subject, 1000) == 400
    assert sent(subject) == [(400, "stop")]


def test_the_plant_may_end_the_run_early() -> None:
    subject = clock()
    granted(subject, 0)
    subject.end_at(123)
    assert granted(subject, 123) == 400
    assert subject.is_last


def test_a_node_behind_holds_the_grants_once_seventy_of_them_lie_ahead_of_it_ten_ms_apart() -> None:
    """Grants within 10 ms end in one block; the blocks that a node has not taken must not become too many to keep."""
    subject = clock(1.0)
    for millisecond in range(2000):
        subject.grant(0, millisecond / 1000)
    assert subject.until == WINDOW, "at this pace the window holds first"
    slow = clock(0.02)
    for millisecond in range(0, 100_000, 25):
        slow.grant(0, millisecond / 1000)
    assert slow.until == MOST_GRANTS
    assert slow.wait_s(100.0) is None
    assert slow.grant(1, 100.0) > MOST_GRANTS


def least_lead(in_leaps: bool) -> int:
    """Ticks that are granted ahead of a plant that keeps the time, 1000 ticks a second, when they are fewest."""
    resolved = scene(duration=30.0, run={"block_ticks": 1000, "window_blocks": 5})
    subject = Clock(resolved, Timebase.from_scene(resolved), KINDS, in_leaps=in_leaps)
    return min(subject.grant(tick, tick / 1000) - tick for tick in range(0, 20_000, 10))


def test_a_plant_that_keeps_the_time_has_most_of_the_window_ahead_of_it_at_any_time() -> None:
    assert least_lead(in_leaps=True) >= 0.75 * 5000 - 10
    assert least_lead(in_leaps=False) < 0.2 * 5000, "grants as they come are too many long before the window is full"
