"""Causes of a swing by trial: the loop is started anew without each of its parts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from haploop.controller.controller import Controller
from haploop.launch.plan.idealised import HOLD, WALL_DAMPING, faster, idealised, uncontrolled
from haploop.launch.stability.finding import DOES, Finding
from haploop.launch.stability.looks import LOOKS_S, push_of
from haploop.launch.stability.still_hand import End, depth_of, held, press_of
from haploop.launch.stability.watch import watch
from haploop.plant.plant import Plant
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase

ALL = "all"
RESTS, LESS, OTHERWISE = "rests", "swings less", "swings otherwise"
# A swing narrower than this share of the first is less; one whose frequency differs by more than this is another.
_LESS, _OTHER = 1.0 / 3.0, 1.5
# Ticks for which a trial is watched, at most, unless its first look comes later.
_MOST_TICKS = 40_000
# No trial begins with the device moving faster than this, m/s.
_FASTEST_M_S = 1.0


def with_causes(end: End, found: Finding) -> Finding:
    """Returns the finding of a loop that swings with what the loop does without each of its parts.

    The loop as it stood at the end of the run begins anew: the hand holds it still, without noise, at the depth where
    the wall balances the hand; the device moves as fast as its swing did, v = pi f w for a width w at f Hz. It is
    pushed as for the verdict and watched for up to 16 s, or 40 000 ticks, once as it is and once without each part (see
    ``idealised`` and ``uncontrolled``). Where no part alone makes a difference, it is also tried at a higher control
    rate (``HOLD``), and without all of these at once (``ALL``). Nothing is told if the loop as it is does not swing
    from this start, or does not leave its limit though the run did.

    A swing less than a third as wide, or one that lasts where the loop as it is leaves its limit, is less; one at a
    frequency 1.5 times off is another, which takes the place of the first.
    """
    if found.word not in ("limit-cycle", "growing", "diverged") or not end.controller.params.wall.inward:
        return found
    start = _start(end, found)
    as_is = _watched(end, start)
    diverges = as_is.why == "leaves the limit"
    if DOES.get(as_is.word) != "swings on" or (found.word == "diverged" and not diverges):
        return found
    without = idealised(start) | uncontrolled(start)
    does = {name: _does(_watched(end, scene), as_is) for name, scene in without.items()}
    if not _told(does):
        does[HOLD] = _does(_watched(end, faster(start)), as_is)
        if len(does) > 1 and not _told(does):
            does[ALL] = _does(_watched(end, _without_all(start)), as_is)
    return replace(found, without=does)


def _told(does: Mapping[str, str]) -> bool:
    return bool({RESTS, LESS} & set(does.values()))


def _start(end: End, found: Finding) -> Scene:
    """Returns the scene that the trials begin with."""
    scene, wall = end.scene, end.controller.params.wall
    press_N = abs(press_of(end.hold_N, scene.hand, wall.position))
    at_m = wall.position + wall.inward * depth_of(wall, press_N)
    v_m_s = wall.inward * min(math.pi * found.frequency_Hz * found.width_m, _FASTEST_M_S)
    return held(replace(scene, device=replace(scene.device, position=float(at_m), velocity=v_m_s)), end.hold_N)


def _without_all(scene: Scene) -> Scene:
    """Returns the scene without all of its parts, one after another, at a higher control rate."""
    for name in idealised(scene):
        scene = idealised(scene)[name]
    scene = replace(scene, dissipation=())
    scene = uncontrolled(scene).get(WALL_DAMPING, scene)
    return faster(scene)


def _watched(end: End, scene: Scene) -> Finding:
    """Returns what a loop does from its beginning, held as at the end of the run."""
    time = Timebase.from_scene(scene)
    plant, controller = Plant(scene, time), Controller(scene, time, end.controller.kinds)
    looks_s = [look_s for look_s in LOOKS_S if look_s * time.control_rate <= _MOST_TICKS] or LOOKS_S[:1]
    begun = End(scene, time, plant, controller, end.hold_N, on_exchange=end.on_exchange)
    return watch(begun, (push_of(end.hold_N, scene.hand, begun.wall_m),), looks_s)[0]


def _does(changed: Finding, as_is: Finding) -> str:
    """Returns what a changed loop does, compared with the swing of the loop as it is."""
    does = DOES.get(changed.word, "undecided")
    if does == "swings on" and as_is.why == "leaves the limit" and changed.word == "limit-cycle":
        return LESS
    if does != "swings on" or not as_is.frequency_Hz or not changed.frequency_Hz:
        return does
    if as_is.word == changed.word == "limit-cycle" and changed.width_m < _LESS * as_is.width_m:
        return LESS
    is_other = not 1.0 / _OTHER < changed.frequency_Hz / as_is.frequency_Hz < _OTHER
    return OTHERWISE if is_other else does
