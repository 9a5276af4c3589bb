"""The one meaning of a change: what it does to a scene, from which tick on, and what is told of one refused."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import pytest

import haploop.logger
from haploop.controller.dissipation import Element, Motion, Quantity
from haploop.launch.clock.clock import Clock as RunClock
from haploop.launch.runs.in_process import run_in_process
from haploop.protocol.changes import (
    Change,
    at_work,
    changes_of,
    describe,
    is_change,
    refusal,
    refusals_as_status,
    refusals_of,
    spans,
)
from haploop.protocol.scene.scene import Clock, ElementTable, EventTable, Scene, Wall
from haploop.protocol.ticks import Timebase
from helpers.scenes.least import KINDS, WALL, scene, typed

DAMPING = {"kind": "damping", "damping": 1.0}
INERTIA = {"kind": "inertia", "mass": 0.01, "acts": "always"}
SCENE = typed(wall={"stiffness": 5.0, "position": 0.0}, dissipation=[DAMPING])
SWAP = {"swap": INERTIA, "element": 0}
SET = {"set": {"wall.stiffness": 7.0, "dissipation.0.damping": 2.0, "clock.round_trip_delay": 0.001}}


@pytest.mark.parametrize("event", [SWAP, {**SWAP, "plugin": "/run/brake.py"}, SET, {**SWAP, "refused": "No."}])
def test_a_change_comes_back_from_its_map_also_through_json(event: dict[str, Any]) -> None:
    change = Change.from_dict(5, event)
    assert Change.from_dict(5, json.loads(json.dumps(change.as_dict()))) == change
    assert change.as_dict() == {"tick": 5, **event}


@pytest.mark.parametrize(
    ("event", "elements"),
    [
        (SWAP, [INERTIA]),
        ({"swap": INERTIA, "element": 1}, [DAMPING, INERTIA]),
        ({"swap": {"kind": "none"}, "element": 0}, []),
        ({"swap": {"kind": "none"}, "element": None}, []),
    ],
)
def test_a_swap_puts_an_element_into_its_place_adds_one_or_takes_one_out(
    event: dict[str, Any], elements: list[dict[str, Any]]
) -> None:
    made = Change.from_dict(3, event).apply(SCENE)
    assert made.dissipation == tuple(map(ElementTable.from_dict, elements))
    assert SCENE.dissipation == (ElementTable.from_dict(DAMPING),)


def test_a_set_gives_wall_delay_and_elements_their_values_and_leaves_the_scene_before_as_it_was() -> None:
    before = json.dumps(SCENE.as_dict())
    now = Change.from_dict(3, SET).apply(SCENE)
    assert now.wall == Wall(stiffness=7.0, position=0.0)
    assert now.clock == Clock(round_trip_delay=0.001)
    assert now.dissipation == (ElementTable(name="damping", parameters={"damping": 2.0}),)
    assert json.dumps(SCENE.as_dict()) == before


def test_an_element_that_stays_is_the_same_object_so_that_it_can_be_followed_through_places() -> None:
    both = typed(dissipation=[DAMPING, INERTIA])
    now = Change.from_dict(3, {"swap": {"kind": "none"}, "element": 0}).apply(both)
    assert now.dissipation[0] is both.dissipation[1]


def test_spans_cover_the_run_without_gap_and_leave_out_what_was_refused() -> None:
    refused = Change.from_dict(4, SWAP).refuse(ValueError("no"))
    events = [(3, SET), (4, SWAP), (9, refusal(refused)), (6, {"pause": True}), (8, SWAP)]
    found = spans(SCENE, changes_of(events))
    assert [(span.from_tick, span.to_tick) for span in found] == [(0, 3), (3, 8), (8, float("inf"))]
    assert [span.scene.dissipation[0].name for span in found] == ["damping", "damping", "inertia"]
    assert at_work(SCENE, changes_of(events)) == found[-1].scene


def test_of_two_changes_at_one_tick_only_the_one_named_is_refused() -> None:
    other = {"swap": DAMPING, "element": 1}
    events = [(4, SWAP), (4, other), (4, refusal(Change.from_dict(4, other).refuse(ValueError("no"))))]
    assert [change.refused is None for change in changes_of(events)] == [True, False]


def test_a_refusal_is_known_by_the_change_it_names_and_never_by_its_sentence() -> None:
    event = {"set": {"wall.stiffness": 200.0}}
    sentence = "The change at tick 4, set wall.stiffness = 200, was refused: ValueError: no."
    named = {"refused": sentence, "change": Change.from_dict(4, event).as_dict()}
    (refused,) = changes_of([(4, event), (6, named)])
    (made,) = changes_of([(4, event), (6, {"refused": sentence})])
    assert (refused.refused, made.refused) == (sentence, None)


def test_what_the_controller_reports_of_refused_changes_goes_on_record_with_each_change() -> None:
    refused = [Change.from_dict(4, event).refuse(ValueError("no")) for event in (SWAP, SET)]
    status = refusals_as_status(refused)
    assert status is not None
    assert refusals_of(json.loads(json.dumps(status))) == [refusal(change) for change in refused]
    assert refusals_as_status([]) is None
    assert refusals_of({"refused": ["A sentence alone."]}) == [{"refused": "A sentence alone."}]


def test_the_sentence_of_a_refusal_names_tick_change_and_reason() -> None:
    refused = Change.from_dict(4, SWAP).refuse(ValueError("too heavy")).refused
    assert refused == (
        "The change at tick 4, element 0 becomes inertia (mass 0.01, always), was refused: ValueError: too heavy"
    )


def test_pauses_and_refusals_are_no_changes() -> None:
    assert [is_change(event) for event in (SWAP, SET, {"pause": True}, {"refused": "No.", "change": SWAP})] == [
        True,
        True,
        False,
        False,
    ]
    assert describe({"refused": "No.", "change": SWAP}) == "No."


class Choosy(Element):
    """Refuses a number that its declaration allows."""

    kind = "choosy"
    force_N: Annotated[float, Quantity("N", at_least=0)]

    def __post_init__(self) -> None:
        if self.force_N > 0.25:
            raise ValueError("too strong")

    def force(self, motion: Motion) -> Any:
        return -self.force_N


CHOOSY = {"kind": "choosy", "acts": "always", "force_N": 0.5}


def choosy() -> Scene:
    """A scene whose first swap is refused and whose second is not."""
    events = [
        EventTable(at=at, element=0, swap=ElementTable(name="choosy", acts="always", parameters={"force_N": force}))
        for at, force in ((0.01, 0.5), (0.02, 0.1))
    ]
    damping = {"kind": "damping", "damping": 0.5}
    resolved = scene(duration=0.05, wall=WALL, dissipation=[damping])
    return replace(resolved, event=tuple(events))


def test_a_refusal_in_the_log_is_a_field_that_names_the_change(tmp_path: Path) -> None:
    made = choosy()
    run_in_process(made, KINDS | {"choosy": Choosy}, out=tmp_path)
    events = [(event["tick"], event) for event in haploop.logger.read(tmp_path)["/events"]]
    (refused,) = [event for _, event in events if "refused" in event]
    assert refused["change"] == {"tick": 10, "swap": CHOOSY, "element": 0}
    reason = "ElementError: The element choosy cannot be made with force_N = 0.5: ValueError: too strong"
    assert f"was refused: {reason} (test_changes.py, line " in refused["refused"]
    assert [(change.tick, change.refused is None) for change in changes_of(events)] == [(10, False), (20, True)]


def test_the_clock_does_not_take_a_refused_change_for_one_that_was_made() -> None:
    made = choosy()
    clock = RunClock(made, Timebase.from_scene(made), KINDS | {"choosy": Choosy})
    clock.grant(0, 0.0)
    clock.note(refusal(Change.from_dict(10, made.event[0].as_dict()).refuse(ValueError("too strong"))))
    clock.note(refusal(Change.from_dict(20, made.event[1].as_dict()).refuse(ValueError("no"))))
    assert [table.name for table in clock.present().dissipation] == ["damping"]
