"""Blocks of a foreign controller, which show the changes that it was told of."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from haploop.launch.scene.file import load
from haploop.logger.carried_out import CarriedOut
from haploop.protocol.changes import Change, Event, refusal, refusals_of
from haploop.protocol.ticks import DELAY, Timebase
from haploop.protocol.transport.node import NodeError
from helpers.live.launched import SCENE
from helpers.runs.captured import run
from helpers.scenes.least import scene

STIFFER: Event = {"set": {"wall.stiffness": 300.0}}
HEAVIER: Event = {"set": {"dissipation.0.mass": 0.02}}
DAMPED: Event = {"swap": {"kind": "damping", "damping": 1.0, "acts": "always"}, "element": 0}
GONE: Event = {"swap": {"kind": "none"}, "element": 0}
TIME = Timebase.from_scene(load(SCENE))
INERTIA = {"kind": "unidirectional-inertia", "parameters": {"mass": 0.01, "acts": "in-contact"}}


def block(first: int, end: int, stiffness: float = 150.0, *elements: dict[str, Any]) -> dict[str, Any]:
    wall = {"position": -0.06, "stiffness": stiffness, "into_wall": -1.0}
    return {"from_tick": first, "ticks": end - first, "elements": list(elements), "wall": wall}


def refused(event: Event, *blocks: dict[str, Any]) -> list[int]:
    """Ticks of the changes refused when one is made at tick 100."""
    seen = CarriedOut(load(SCENE), TIME, ["controller"])
    seen.note(100, event)
    for each in blocks:
        seen.add(each)
    return [change.tick for change in seen.judge(1000)]


@pytest.mark.parametrize(
    ("event", "shown"),
    [
        (STIFFER, (300.0, INERTIA)),
        (HEAVIER, (150.0, INERTIA | {"parameters": {"mass": 0.02, "acts": "in-contact"}})),
        (DAMPED, (150.0, {"kind": "damping", "parameters": {"damping": 1.0, "acts": "always"}})),
        (GONE, (150.0,)),
    ],
)
def test_a_change_is_taken_as_made_only_where_a_block_begins_with_it_and_shows_it(
    event: Event, shown: tuple[Any, ...]
) -> None:
    before = block(0, 100, 150.0, INERTIA)
    assert refused(event, before, block(100, 200, *shown)) == []
    assert refused(event, before, block(100, 200, 150.0, INERTIA)) == [100]
    assert refused(event, block(0, 90, 150.0, INERTIA), block(90, 200, *shown)) == [100]
    assert refused(event, before, block(100, 110, 150.0, INERTIA), block(110, 200, *shown)) == [100]
    assert refused(event, before) == []  # not known yet


def test_a_set_of_what_is_there_and_one_of_the_delay_are_no_business_of_the_blocks() -> None:
    for event in ({"set": {"wall.stiffness": 150.0}}, {"set": {"clock.round_trip_delay": 0.003}}):
        assert refused(event, block(0, 100, 150.0, INERTIA), block(100, 200, 150.0, INERTIA)) == []
        assert refused(event, block(0, 200, 150.0, INERTIA)) == []


def test_blocks_wait_until_all_events_in_them_are_known_and_a_refusal_of_its_own_is_enough() -> None:
    seen = CarriedOut(load(SCENE), TIME, ["controller"])
    seen.add(block(0, 200, 150.0, INERTIA))
    assert seen.judge(199) == []
    assert seen.tick == 0
    seen.note(100, STIFFER)
    seen.note(150, refusal(Change.from_dict(100, {**STIFFER, "refused": "I do not."})))
    assert seen.judge(200) == []
    assert seen.tick == 200
    assert not seen.awaited


def test_a_refusal_is_put_on_record_once_whoever_tells_it_and_nonsense_never() -> None:
    event = {"refused": "No.", "change": {"tick": 5, **STIFFER}}
    status = {"refused": ["No."], "refused_changes": [{"tick": 5, **STIFFER}]}
    assert refusals_of(status) == [event]
    assert refusals_of(status, [(7, {"refused": "Never.", "change": {"tick": 5, "at": 0.005, **STIFFER}})]) == []
    for told in (5, "x", {"a": 1}, None):
        assert refusals_of({"refused": told, "refused_changes": told}) == []
    for change in (5, None, {}, {"tick": "x"}, {"tick": 1, "swap": 3}, {"tick": 1, "set": 3}):
        assert refusals_of({"refused": ["No."], "refused_changes": [change]}) == [{"refused": "No."}]


@pytest.mark.parametrize("delay_s", [0.0, 0.0007, 0.002, 0.0035, 0.15])
@pytest.mark.parametrize("block_ticks", [1, 7, 200])
def test_a_delay_is_taken_as_set_only_where_the_plant_holds_the_command_of_its_tick_from_then_on(
    delay_s: float, block_ticks: int
) -> None:
    """Seen in what our own plant publishes, told and not told of the change."""
    tables: dict[str, Any] = {"duration": 0.3, "clock": {"round_trip_delay": 0.002}}
    event: Event = {"set": {DELAY: delay_s}}
    made, passed_over = scene(**tables, event=[{"at": 0.1, **event}]), scene(**tables)
    for of, refused in ((made, []), (passed_over, [100] if delay_s != 0.002 else [])):
        time, seen = Timebase.from_scene(of), CarriedOut(of, Timebase.from_scene(of), ["plant"])
        command, n, found = run(of).plant["command"], time.steps_per_tick, list[int]()
        seen.note(100, event)
        for first in range(0, 300, block_ticks):
            end = min(first + block_ticks, 300)
            held = command[first * n : end * n + 1].tobytes()
            seen.add_motion({"from_tick": first, "columns": {"command": held}})
            found += [change.tick for change in seen.judge(end)]
        assert found == refused
        assert seen.tick == 300


def test_a_delay_that_is_not_set_beside_what_the_controller_did_ends_the_run() -> None:
    of = scene(duration=0.3)
    seen = CarriedOut(of, Timebase.from_scene(of), ["plant"])
    seen.note(100, {"set": {DELAY: 0.003, "wall.stiffness": 200.0}})
    held = run(of).plant["command"].tobytes()
    seen.add_motion({"from_tick": 0, "columns": {"command": held}})
    with pytest.raises(NodeError, match=r"clock.round_trip_delay = 0.003.* was refused: .* so the run cannot continue"):
        seen.judge(300)


def test_a_delay_longer_than_half_the_window_holds_nobody_however_few_ticks_a_block_has() -> None:
    """Of 1000 steps a tick a block takes 65 ticks, whatever the scene asks for."""
    of = scene(duration=1.0, clock={"plant_rate": 1_000_000}, run={"block_ticks": 1000})
    time = Timebase.from_scene(of)
    half = time.window_ticks(of.run) // 2
    for delay_ticks, stands_at in ((half, 100), (half + 1, 150)):
        seen = CarriedOut(of, time, ["plant"])
        seen.note(100, {"set": {DELAY: delay_ticks / 1000}})
        seen.add_motion({"from_tick": 0, "columns": {"command": np.zeros(150 * 1000 + 1).tobytes()}})
        assert seen.judge(150) == []
        assert (half, seen.tick) == (65, stands_at)
