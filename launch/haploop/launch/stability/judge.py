"""Judging the end of a run: the loop is held still, pushed, and watched until it tells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from haploop.controller.controller import Controller
from haploop.controller.dissipation import Element, ElementError
from haploop.launch.runs.in_process import scene_events
from haploop.launch.stability.decide import Finding, Pushed, decide
from haploop.launch.stability.still_hand import End, StillHand, hold_of
from haploop.plant.plant import Plant
from haploop.protocol.changes import Event, is_change
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase

# The larger push, as a share of what the hand holds the wall with, and the smaller one, as a share of it.
PUSH, SMALLER = 0.3, 0.1
# Times since the push at which the loop is looked at, in s.
LOOKS_S = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
_LEAST_LOAD_N = 1e-3
# A third copy, pushed harder by this share, shows whether the swing is chaotic: whether it ends apart from the second
# by this share of the width.
_BESIDE, _APART = 1e-3, 0.2


def judge_scene(
    scene: Scene, kinds: Mapping[str, type[Element]], events: Sequence[tuple[int, Event]] | None = None
) -> Finding:
    """Runs a resolved scene to its end and judges that end.

    Args:
        scene: the resolved scene.
        kinds: element kinds at hand.
        events: (tick, event) in order; the scene's own when None.

    Raises:
        ElementError: an element raised.
        ArithmeticError: the plant's arithmetic failed.
    """
    end = end_of(scene, kinds, events)
    return judge(end) if isinstance(end, End) else end


def end_of(
    scene: Scene, kinds: Mapping[str, type[Element]], events: Sequence[tuple[int, Event]] | None = None
) -> End | Finding:
    """Returns the end of a run, or what is found of one that diverged or ended out of contact."""
    time = Timebase.from_scene(scene)
    plant, controller, ticks = Plant(scene, time), Controller(scene, time, dict(kinds)), time.ticks
    for tick, event in scene_events(scene, time) if events is None else events:
        if is_change(event):
            controller.schedule(tick, event)
            plant.schedule(tick, event)
        elif event.get("stop"):
            ticks = min(ticks, tick)
    plant.run_until(ticks, lambda _, samples: [float(force) for force in controller.answer(samples)])
    plant.take_block()
    if plant.stop_reason:
        return Finding("diverged", "diverged", detail=plant.stop_reason)
    rows = b"".join(block["columns"]["in_contact"] for block in controller.recorder.take())
    first = max(ticks // 2, ticks - time.control_rate // 2)
    inside = np.frombuffer(rows)[first:] > 0.0
    if not inside.any():
        return Finding("no-contact", "no contact")
    return End(scene, time, plant, controller, hold_of(scene, time, first, inside))


def judge(end: End) -> Finding:
    """Returns whether a loop forgets its start, from the end of a run in contact on.

    The hand is held still with the mean force of its last contacts, noise is switched off, and two copies of the loop
    are pushed, one ten times as hard as the other. Whatever moves a second later is the loop's own. Most loops tell
    within a second or two; slow ones are watched for up to 64 s. It takes as long as simulating that time twice.
    """
    push_N = PUSH * max(abs(end.hold_N), _LEAST_LOAD_N) * (1.0 if end.hold_N > 0.0 else -1.0)
    small, large = StillHand(end, push_N * SMALLER), StillHand(end, push_N)
    found = Finding("undecided", "leaves the wall", abs(push_N))
    for seconds in LOOKS_S:
        try:
            small.go_to(seconds)
            large.go_to(seconds)
        except (ArithmeticError, ElementError) as error:
            return Finding("undecided", "failed", abs(push_N), seconds, detail=str(error))
        gone = [each for each in (small, large) if each.stop_reason]
        if gone:
            touched = any(_is_inside(end, each.x[len(each.x) // 2 :]) for each in gone)
            return found if not touched else Finding("growing", "leaves the limit", abs(push_N), seconds)
        found = decide(_pushed(end, small, large, push_N), last=seconds == LOOKS_S[-1])
        if found.word != "undecided":
            break
    if found.word == "limit-cycle":
        beside = StillHand(end, push_N * (1.0 + _BESIDE))
        beside.go_to(found.watched_s)
        found = replace(found, chaotic=parts(large.x, beside.x, found.width_m))
    return found


def parts(one: np.ndarray, other: np.ndarray, width_m: float) -> bool:
    """Tells whether two copies that began together end apart by a fifth of their swing or more."""
    apart = np.abs(one - other)
    eighth = len(apart) // 8
    return bool(apart[:eighth].min() < 0.01 * width_m and apart[-2 * eighth :].max() > _APART * width_m)


def _is_inside(end: End, x: np.ndarray) -> bool:
    wall = end.controller.params.wall
    return bool(np.any(wall.inward * (x - wall.position) > 0.0))


def _pushed(end: End, small: StillHand, large: StillHand, push_N: float) -> Pushed:
    inside = all(_is_inside(end, each.x[-len(each.x) // 4 :]) for each in (small, large))
    count_m = end.scene.encoder.resolution if end.scene.encoder else 0.0
    return Pushed(small.x, large.x, large.command, end.time.control_rate, abs(push_N), count_m, inside)
