"""Events: each is checked against the elements that are there when it comes."""

import pytest

from haploop.launch.scene.check import resolve_event
from haploop.launch.scene.mistakes import SceneError
from haploop.protocol.scene.scene import ElementTable, EventTable
from helpers.scenes.least import KINDS, WALL, mistakes, scene

DAMPING = {"kind": "damping", "damping": 0.8}
INERTIA = {"kind": "unidirectional-inertia", "mass": "10 g"}


def with_events(*events):
    return {"wall": WALL, "dissipation": [DAMPING], "event": list(events)}


def test_a_swap_is_resolved_like_an_element():
    [event] = scene(**with_events({"at": "500 ms", "swap": INERTIA})).event
    swap = ElementTable(name="unidirectional-inertia", acts="in-contact", parameters={"mass": 0.01})
    assert event == EventTable(at=0.5, element=0, swap=swap)


def test_set_values_are_converted_and_bounded():
    resolved = scene(**with_events({"at": 0, "set": {"wall.stiffness": "0.2 N/mm", "dissipation.0.damping": 1}}))
    assert resolved.event[0].set == {"wall.stiffness": 200.0, "dissipation.0.damping": 1.0}
    assert mistakes(**with_events({"at": 0, "set": {"wall.stiffness": -1}})) == [
        "event.0.set.wall.stiffness is -1. It must be at least 0 N/m."
    ]


def test_set_sees_the_element_that_is_there_at_its_time_whatever_the_order_in_the_file():
    swap = {"at": 0.5, "swap": INERTIA}
    mass = {"at": 0.6, "set": {"dissipation.0.mass": 0.1}}
    damping = {"at": 0.4, "set": {"dissipation.0.damping": 0.1}}
    assert mistakes(**with_events(mass, swap, damping)) == []
    early = mass | {"at": 0.3}
    assert mistakes(**with_events(early, swap)) == [
        "event.0.set.dissipation.0.mass cannot be set. "
        "Allowed at that time: wall.stiffness, wall.position, clock.round_trip_delay, dissipation.0.damping."
    ]


def test_a_swap_may_add_one_past_the_end_and_none_moves_the_rest_up():
    add = {"at": 0.1, "element": 1, "swap": INERTIA}
    remove = {"at": 0.2, "element": 0, "swap": {"kind": "none"}}
    assert mistakes(**with_events(add, remove, {"at": 0.3, "set": {"dissipation.0.mass": 0.1}})) == []
    assert mistakes(**with_events(remove, remove | {"at": 0.3})) == [
        "event.1.element is 0. The scene has 0 elements at that time, counted from 0; one past the end adds one."
    ]
    assert len(mistakes(**with_events(add | {"element": 2}))) == 1


@pytest.mark.parametrize(
    ("event", "sentence"),
    [
        (
            {"at": 1.0, "stop": True},
            "event.0.at is 1.0. It must be at most 0.999 s, the time of the last tick of the run.",
        ),
        ({"at": 0.5}, "event.0 changes nothing. An event has exactly one of swap, set, pause and stop."),
        ({"at": 0.5, "pause": False}, "event.0.pause is false. Allowed: true."),
        ({"at": 0.5, "pause": True, "element": 0}, "event.0.element is 0. It is used only with swap."),
        ({"stop": True}, "event.0.at is missing. It must be a number in s, at least 0"),
        (
            {"at": 0.5, "set": {"wall.stifness": 1}},
            "event.0.set.wall.stifness cannot be set; did you mean wall.stiffness?",
        ),
        ({"at": 0.5, "set": {"wall": {"stiffness": 1}}}, "event.0.set.wall is a table. Write the whole key in quotes"),
        ({"at": 0.5, "set": {"dissipation.0.acts": "always"}}, "event.0.set.dissipation.0.acts cannot be set."),
        ({"at": 0.5, "swap": DAMPING | {"damping": -1}}, "event.0.swap.damping is -1. It must be at least 0 N s/m."),
        ({"at": 0.5, "swap": "damping"}, 'event.0.swap is "damping". It must be a table, such as { kind'),
    ],
)
def test_an_event_that_does_not_fit_is_one_sentence(event, sentence):
    [mistake] = mistakes(**with_events(event))
    assert mistake.startswith(sentence)


def test_the_last_tick_still_sees_an_event():
    assert mistakes(**with_events({"at": 0.999, "stop": True})) == []


def test_a_wall_that_is_not_there_cannot_be_set():
    [mistake] = mistakes(event=[{"at": 0.5, "set": {"wall.stiffness": 1}}])
    assert mistake.endswith("Allowed at that time: clock.round_trip_delay.")


def test_a_live_event_is_checked_after_what_has_happened_and_before_what_is_to_come():
    running = scene(**with_events({"at": 0.2, "swap": INERTIA}, {"at": 0.8, "set": {"dissipation.0.mass": 0.02}}))
    change = {"at": 0.5, "set": {"dissipation.0.mass": "20 g"}}
    assert resolve_event(change, running, KINDS) == EventTable(at=0.5, set={"dissipation.0.mass": 0.02})
    with pytest.raises(SceneError, match=r"^kind is \"dampin\"; did you mean damping\?"):
        resolve_event({"at": 0.5, "swap": {"kind": "dampin"}}, running, KINDS)
    with pytest.raises(SceneError, match=r"^the run with this change: event.1.set.dissipation.0.mass cannot"):
        resolve_event({"at": 0.5, "swap": DAMPING}, running, KINDS)
