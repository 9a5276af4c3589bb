"""Commands that a terminal, a page or a program may send: refused with a sentence, or done with the way back."""

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from haploop.controller.dissipation import Element, Motion
from haploop.launch.clock.clock import Clock
from haploop.launch.clock.commands import Answer, Commands
from haploop.launch.clock.roster import Roster
from haploop.launch.spec import RunSpec
from haploop.protocol.changes import Change, restoration
from haploop.protocol.scene.scene import ElementTable
from haploop.protocol.ticks import Timebase
from helpers.runs.clocks import DAMPING, TICKS, clock, granted
from helpers.scenes.least import KINDS

BACK = "swap damping acts=in-contact damping=0.5"


def commands(**tables: Any) -> Commands:
    subject = clock(**tables)
    granted(subject, 0)
    return Commands(subject, RunSpec(subject.present(), dict(KINDS), Path("out")), Roster)


def at_once(subject: Commands, verb: str, arguments: dict[str, Any]) -> Answer:
    """The answer of a command that needs no steps."""
    answer = subject(verb, arguments)
    assert isinstance(answer, tuple)
    return answer


def deep(levels: int) -> dict[str, Any]:
    table: dict[str, Any] = {}
    for _ in range(levels):
        table = {"k": table}
    return table


@pytest.mark.parametrize(
    ("verb", "arguments", "says"),
    [
        ("set", {"set": {f"wall.k{i}": 1.0 for i in range(10_000)}}, "at most 64 keys and values"),
        ("set", {"set": [0.0] * 1000}, "at most 64 keys and values"),
        ("set", {"set": deep(300)}, "3 tables deep"),
        ("set", {"set": {}}, "Nothing was set: a set names at least one key"),
        ("pace", {"pace": "x"}, "A pace is a number from 1e-06 to 1e+06, or free, but 'x' was asked for."),
        ("swap", {"swap": {"kind": [[[[]]]]}}, "3 tables deep"),
        ("set", {"set": {"w" * 201: 1.0}}, "at most 200 characters, but one has 201"),
        ("set", {"set": {"wall.stiffness": "1 " + "m " * 200}}, "at most 200 characters"),
        ("set", {"set": {"wall.stiffness": b"\xff" * 300}}, "at most 200 characters"),
        ("set", {"set": {"wall.stiffness": "3 furlong"}}, "unit that a running loop does not know; it knows Hz, J"),
        ("set", {"set": {"wall.stiffness": "3 ms"}}, "ms is a time; a stiffness was expected, such as N/m"),
        (
            "set",
            {"set": {"wall.stiffness": "3 kg"}},
            'wall.stiffness is "3 kg". kg is a mass; a stiffness was',
        ),
        ("swap", {"swap": {"kind": "damping", "dampin": 1}}, "dampin is not a key of [swap]; did you mean damping?"),
        ("swap", {"swap": {"kind": "damping", "damping": "1 lbf s/inch"}}, "unit that a running loop does not know"),
        ("swap", {"swap": "damping"}, "must be a table"),
        ("swap", {"swap": None}, "exactly one of swap, set"),
        ("swap", {"swap": {"kind": ["damping"]}}, "damping"),
        ("stop", {"self": 1}, "The arguments of stop cannot be used: it takes none."),
        ("set", {"set": {1: 2}}, "The keys in a command must be texts, but 1 was given as one."),
        ("swap", {"swap": {"kind": "damping", None: 2}}, "must be texts, but None was given"),
        ("swap", {"surprise": 1}, "it takes swap, element, at, reload, and swap must be given."),
        ("pace", {"pace": 1e305}, "from 1e-06 to 1e+06, or free, but 1e+305"),
        ("pace", {"pace": float("inf")}, "or free, but inf"),
        ("step", {"ticks": 10**18}, "from 1 to 1000, but 1000000000000000000"),
        ("step", {"ticks": 1.0}, "whole number of ticks"),
        ("step", {"ticks": "5"}, "whole number of ticks"),
        ("step", {"ticks": True}, "whole number of ticks"),
        ("step", {"ticks": 0}, "from 1 to 1000, but 0"),
        ("set", {"set": {"wall.stiffness": 1.0}, "at": float("nan")}, "a time from 0 to 1e+09 s, or at once, but nan"),
    ],
)
def test_what_carries_too_much_or_means_nothing_is_refused_with_a_sentence(
    verb: str, arguments: dict[str, Any], says: str
) -> None:
    subject = commands()
    ok, text, data = at_once(subject, verb, arguments)
    assert (ok, data) == (False, {})
    assert says in text
    assert "event." not in text
    assert len(text) < 1000
    assert at_once(subject, "status", {})[1].startswith("running at tick 0 (0 s) of 1000")


def test_of_many_mistakes_five_are_told_and_the_rest_counted() -> None:
    ok, text, _ = at_once(commands(), "set", {"set": {f"wall.k{i}": 1.0 for i in range(30)}})
    assert not ok
    lines = text.splitlines()
    assert len(lines) == 6
    assert lines[-1] == "There are 25 more mistakes."


def test_values_with_units_do_not_load_the_library_of_units_where_grants_are_made() -> None:
    code = """
import sys
sys.path.insert(0, sys.argv[1])
from clock.test_ugly_commands import commands
subject = commands()
assert subject("set", {"set": {"wall.stiffness": "0.2 N/mm"}})[0]
for value in ("3 ms", "3 furlong", "five N/m", "1 N/furlong"):
    assert not subject("set", {"set": {"wall.stiffness": value}})[0], value
assert subject("swap", {"swap": {"kind": "damping", "damping": "2 mN s/mm"}})[0]
assert "pint" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code, str(Path(__file__).parents[1])], check=True)


@pytest.mark.parametrize(
    ("verb", "arguments", "back"),
    [
        (
            "set",
            {"set": {"wall.stiffness": "0.2 N/mm", "wall.position": -0.05}},
            'set wall.stiffness="150 N/m" wall.position="-0.06 m"',
        ),
        ("set", {"set": {"dissipation.0.damping": 0.7}, "at": 0.6}, 'set dissipation.0.damping="0.5 N s/m"'),
        (
            "swap",
            {"swap": {"kind": "unidirectional-inertia", "mass": "3 g"}},
            BACK,
        ),
        ("swap", {"swap": {"kind": "none"}}, BACK),
        ("swap", {"swap": {**DAMPING, "damping": 0.1}, "element": 1}, "swap none --element 1"),
    ],
)
def test_the_answer_to_a_change_says_how_to_go_back_and_going_back_does(
    verb: str, arguments: dict[str, Any], back: str
) -> None:
    subject = clock()
    granted(subject, 0)
    steer = Commands(subject, RunSpec(subject.present(), dict(KINDS), Path("out")), Roster)
    before = subject.present()
    ok, text, data = at_once(steer, verb, arguments)
    assert ok, text
    assert text.endswith(back)
    assert subject.scene_at(TICKS) != before
    ok, text, _ = at_once(steer, verb, data["before"] | {key: arguments[key] for key in ("at",) if key in arguments})
    assert ok, text
    now = subject.scene_at(TICKS)
    assert (now.wall, now.dissipation, now.clock) == (before.wall, before.dissipation, before.clock)


def test_the_answers_to_a_set_and_to_its_undo_tell_the_unit_of_each_value() -> None:
    given, steer = {"wall.stiffness": 1.17, "clock.round_trip_delay": "1 ms", "dissipation.0.damping": 4}, commands()
    _, text, data = at_once(steer, "set", {"set": given})
    taken = "wall.stiffness = 1.17 N/m, clock.round_trip_delay = 0.001 s, dissipation.0.damping = 4 N s/m from tick"
    assert text.startswith(taken)
    assert data["before"]["set"]["wall.stiffness"] == 150.0
    assert "wall.stiffness = 1.17 N/m, " in at_once(steer, "undo", {})[1]


def test_undo_takes_changes_back_one_by_one_the_last_first() -> None:
    subject = clock()
    granted(subject, 0)
    steer = Commands(subject, RunSpec(subject.present(), dict(KINDS), Path("out")), Roster)
    stood = [subject.scene_at(TICKS)]
    told = []
    for verb, arguments in (
        ("set", {"set": {"wall.stiffness": 200.0}}),
        ("swap", {"swap": {**DAMPING, "damping": 0.1}, "element": 1}),
        ("set", {"set": {"wall.stiffness": 300.0, "clock.round_trip_delay": 0.001}, "at": 0.5}),
        ("swap", {"swap": {"kind": "none"}, "element": 1, "at": 0.7}),
    ):
        assert at_once(steer, verb, arguments)[0]
        stood.append(subject.scene_at(TICKS))
        told += subject.take_events()
    for before in reversed(stood[:-1]):
        ok, text, _ = at_once(steer, "undo", {})
        assert ok, text
        now = subject.scene_at(TICKS)
        assert (now.wall, now.dissipation, now.clock) == (before.wall, before.dissipation, before.clock)
    assert told == subject.events[:2], "what no node knew of is gone"
    assert [sorted(event.keys() & {"set", "swap"}) for _, event in subject.events[2:]] == [["swap"], ["set"]]
    ok, text, _ = at_once(steer, "undo", {})
    assert (ok, text) == (False, "There is nothing to undo: no swap or set requested by a command is left.")


def test_undo_passes_over_a_swap_that_was_taken_back_because_its_element_failed() -> None:
    """It swapped in once more what had returned already, and counted as the undoing of the swap that had failed."""
    subject = clock()
    granted(subject, 0)
    steer = Commands(subject, RunSpec(subject.present(), dict(KINDS), Path("out")), Roster)
    assert at_once(steer, "swap", {"swap": {**DAMPING, "damping": 0.1}, "element": 0})[0]
    failing = at_once(steer, "swap", {"swap": {**DAMPING, "damping": 0.2}, "element": 0, "at": 0.5})[2]["tick"]
    back = Change.from_dict(failing + 5, {"swap": {**DAMPING, "damping": 0.1}, "element": 0})
    subject.note(restoration(back, "It failed."))
    ok, text, _ = at_once(steer, "undo", {})
    assert (ok, text) == (True, "element 0 becomes damping (damping 0.1 N s/m) will not happen")
    assert not at_once(steer, "undo", {})[0], "the failed swap has gone, and the first is undone"


class Switched(Element):
    """f = 0, which may be on or off."""

    kind = "switched"
    on: bool = True

    def force(self, motion: Motion) -> float:
        return 0.0


def test_the_way_back_to_an_element_that_is_on_is_told_as_a_scene_takes_it() -> None:
    kinds = {**KINDS, "switched": Switched}
    present = replace(clock().present(), dissipation=(ElementTable(name="switched", parameters={"on": True}),))
    subject = Clock(present, Timebase.from_scene(present), kinds, math.inf)
    granted(subject, 0)
    steer = Commands(subject, RunSpec(subject.present(), kinds, Path("out")), Roster)
    ok, text, _ = at_once(steer, "swap", {"swap": DAMPING})
    assert ok
    assert text.endswith("; to go back: swap switched acts=in-contact on=true")


def test_no_way_back_is_told_where_one_swap_cannot_go_it() -> None:
    """Of two elements the first is taken out, and the second moves up: it would come back behind it."""
    subject = commands()
    subject("swap", {"swap": {**DAMPING, "damping": 0.1}, "element": 1})
    ok, text, data = at_once(subject, "swap", {"swap": {"kind": "none"}, "element": 0})
    assert ok
    assert "go back" not in text
    assert "before" not in data
    ok, text, _ = at_once(subject, "undo", {})
    assert not ok
    assert "cannot be undone" in text


def test_a_set_tells_what_check_would_note_of_the_scene_as_it_then_is_and_tells_it_once() -> None:
    subject = commands()
    ok, text, data = at_once(subject, "set", {"set": {"wall.stiffness": 1e9}})
    assert ok, text
    assert data["notes"] == text.splitlines()[1:]
    assert "wall.stiffness is 1e+09 N/m; is that the unit you meant?" in text
    for value in (1e9, 150.0):
        ok, text, data = at_once(subject, "set", {"set": {"wall.stiffness": value}, "at": 0.5})
        assert (ok, data["notes"]) == (True, []), text
