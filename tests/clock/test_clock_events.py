"""At which tick a change takes effect, and in which order events go out."""

import math
from typing import Any

import pytest

from haploop.launch.clock.clock import Clock, ClockError
from haploop.launch.scene.mistakes import SceneError
from haploop.protocol.changes import Change, happened_at, refusal, restoration
from helpers.runs.clocks import DAMPING, SWAP, clock, granted, sent


def test_a_change_without_a_time_takes_effect_at_the_first_tick_not_granted() -> None:
    subject = clock()
    granted(subject, 0)
    assert subject.change(SWAP) == 400
    assert sent(subject) == [(400, "swap")]


def test_a_change_with_a_time_takes_effect_at_the_first_tick_at_or_after_it() -> None:
    subject = clock()
    assert [subject.change(SWAP, at) for at in (0.5, 0.5001, 0.5009999, 0.501)] == [500, 501, 501, 501]


def test_events_go_out_in_order_of_their_ticks_with_the_grant_that_covers_them() -> None:
    subject = clock(event=[{"at": 0.45, "swap": DAMPING}, {"at": 0.1, "set": {"wall.stiffness": 200.0}}])
    subject.change(SWAP, 0.3)
    granted(subject, 0)
    assert sent(subject) == [(100, "set"), (300, "swap")]
    granted(subject, 49)
    assert sent(subject) == []
    granted(subject, 50)  # before tick 450 may be worked on, its event is there
    assert sent(subject) == [(450, "swap")]


def test_a_node_that_joins_late_gets_the_events_from_its_first_tick_on_that_others_have_had() -> None:
    subject = clock(event=[{"at": at, "swap": DAMPING} for at in (0.1, 0.3, 0.39, 0.7)])
    granted(subject, 0)
    assert [tick for tick, _ in subject.take_events()] == [100, 300, 390]
    assert [tick for tick, _ in subject.events_from(300)] == [300, 390]


@pytest.mark.parametrize(
    ("at", "says"), [(0.399, r"past.*0\.4 s"), (0.0, "past"), (1.0, "ends at tick 1000"), (5.0, "ends at tick 1000")]
)
def test_a_change_in_the_past_or_after_the_end_is_refused_and_leaves_no_trace(at: float, says: str) -> None:
    subject = clock()
    granted(subject, 0)
    with pytest.raises(ClockError, match=says):
        subject.change(SWAP, at)
    assert subject.events == []


@pytest.mark.parametrize("at", [math.inf, -math.inf, math.nan, 1e308, 10**400, -0.001, True, "0.5", [0.5]])
def test_a_time_that_no_run_can_reach_is_refused_with_those_that_one_can(at: Any) -> None:
    subject = clock()
    with pytest.raises(ClockError, match=r"a time from 0 to 1e\+09 s"):
        subject.change(SWAP, at)
    assert subject.events == []


def stiffness(subject: Clock, tick: int) -> float:
    wall = subject.scene_at(tick).wall
    assert wall
    return wall.stiffness


def test_changes_that_were_made_are_settled_and_further_ones_are_checked_against_what_they_left() -> None:
    subject = clock(event=[{"at": 0.9, "set": {"wall.stiffness": 300.0}}])
    subject.change({"swap": {"kind": "none"}, "element": 0}, 0.1)
    subject.change({"set": {"wall.stiffness": 200.0}}, 0.2)
    granted(subject, 0)
    subject.settle(150)
    assert subject.scene_at(150).dissipation == ()
    assert [stiffness(subject, tick) for tick in (199, 200, 899, 900)] == [150.0, 200.0, 200.0, 300.0]
    with pytest.raises(SceneError, match=r"dissipation\.0\.damping"):
        subject.change({"set": {"dissipation.0.damping": 0.1}})
    subject.settle(400)
    assert stiffness(subject, subject.until) == 200.0
    assert subject.change(SWAP) == 400
    assert [element.name for element in subject.scene_at(400).dissipation] == ["damping"]


def test_a_change_that_was_refused_is_not_settled_as_made() -> None:
    subject = clock()
    subject.change({"set": {"wall.stiffness": 200.0}})
    granted(subject, 0)
    subject.note({"refused": "why", "change": {"tick": 0, "set": {"wall.stiffness": 200.0}}})
    subject.settle(400)
    assert stiffness(subject, subject.until) == 150.0


def test_what_changed_before_costs_a_further_change_nothing_and_what_waits_is_limited(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("haploop.launch.clock.clock.MOST_CHANGES", 20)
    subject = clock()
    for tick in range(40):
        subject.until = tick
        subject.change({"set": {"wall.stiffness": 100.0 + tick}})
        subject.settle(tick)
    assert len(subject._scene.event) == 1
    for _ in range(19):
        subject.change({"set": {"wall.stiffness": 100.0}})
    with pytest.raises(ClockError, match="20 changes are already waiting"):
        subject.change({"set": {"wall.stiffness": 100.0}})
    subject.settle(40)
    subject.until = 41
    assert subject.change({"set": {"wall.stiffness": 100.0}}) == 41


@pytest.mark.parametrize(
    "change",
    [
        {"swap": {"kind": "dampling"}},
        {"swap": {"kind": "damping", "damping": -1.0}},
        {"swap": DAMPING, "element": 2},
        {"swap": None},
        {"set": {"wall.hardness": 1.0}},
        {"set": None},
        {"swap": DAMPING, "set": {"wall.stiffness": 1.0}},
        {},
    ],
)
def test_a_change_that_does_not_fit_is_refused_and_leaves_no_trace(change: dict[str, Any]) -> None:
    subject = clock()
    with pytest.raises(SceneError):
        subject.change(change)
    assert subject.events == []
    assert subject.change(SWAP) == 0


def test_a_change_must_fit_the_changes_before_it() -> None:
    subject = clock()
    subject.change({"swap": {"kind": "none"}, "element": 0})
    with pytest.raises(SceneError):
        subject.change({"set": {"dissipation.0.damping": 0.1}})


def test_what_is_put_on_record_keeps_its_place_among_the_events() -> None:
    subject = clock(event=[{"at": 0.4, "swap": DAMPING}, {"at": 0.2, "swap": DAMPING}])
    granted(subject, 0)
    assert sent(subject) == [(200, "swap"), (400, "swap")]
    subject.change(SWAP, 0.6)
    assert subject.note({"refused": "why"}) == 400
    assert sent(subject) == [(400, "refused")]
    granted(subject, 600)
    assert sent(subject) == [(600, "swap")]


def test_a_swap_that_was_taken_back_happened_at_its_own_tick_and_all_else_when_it_is_on_record() -> None:
    back = Change.from_dict(52, {"swap": {"kind": "damping", "damping": 1.0, "acts": "always"}, "element": 0})
    assert happened_at(75, restoration(back, "The swap is taken back.", 35, None)) == 52
    for event in ({"pause": True}, refusal(back.refuse(ValueError("no"), "")), {"restored": "x"}):
        assert happened_at(75, event) == 75
