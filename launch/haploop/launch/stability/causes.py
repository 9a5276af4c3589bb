"""Causes of a swing by trial: the loop is started anew without each of its parts."""

from __future__ import annotations

import math
from dataclasses import replace

from haploop.controller.controller import Controller
from haploop.launch.plan.idealised import HOLD, OF_TABLES, faster, idealised, uncontrolled
from haploop.launch.plan.rules import has_friction
from haploop.launch.stability.finding import DOES, Finding
from haploop.launch.stability.looks import BLOWS, LOOKS_S, is_struck, push_of
from haploop.launch.stability.still_hand import End, depth_of, held, press_of
from haploop.launch.stability.watch import watch
from haploop.plant.plant import Plant
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase

ALL, ELEMENTS = "all", "all elements"
RESTS, WITHIN, LESS, OTHERWISE = "rests", "swings within its limit", "swings less", "swings otherwise"
# A swing narrower than the first share of another is less, or than the second if it has another frequency, which is one
# that differs by more than this factor.
_LESS, _FAR_LESS, _OTHER = 1.0 / 3.0, 0.1, 1.5
# Ticks for which a trial is watched, at most, unless its first look comes later.
_MOST_TICKS = 40_000
# No trial begins with the device moving faster than this, m/s.
_FASTEST_M_S = 1.0
_LEAVES = "leaves the limit"
# A wall that answers with less than this share of the press at any depth does not hold the hand.
_HOLDS = 0.99


def with_causes(end: End, found: Finding) -> Finding:
    """Returns the finding of a loop that swings with what the loop does without each of its parts.

    The loop as it stood at the end of the run begins anew: the hand holds it still, without noise, at the depth where
    the wall balances the hand; the device moves as fast as its swing did, v = pi f w for a width w at f Hz. It is
    pushed as for the verdict, struck if it rests, and watched for up to 16 s, or 40 000 ticks, once as it is and once
    without each part (see ``idealised`` and ``uncontrolled``) and at a higher control rate (``HOLD``). Where no element
    alone makes a difference, it is tried without all of them (``ELEMENTS``); where no single part makes it rest,
    without all at once (``ALL``). Nothing is told of a wall that does not hold the hand, nor if the loop as it is, from
    this start, comes to another swing than in its run, to none, or leaves the limit where the run did not, or the
    reverse. Of a device that left its limit, nothing without its parts (``{}``) is told where the hand presses harder
    than the wall answers within the limit, or than the actuator can.

    A swing less than a third as wide, or less than a tenth at another frequency, is less (``LESS``), one that lasts
    where the loop as it is leaves its limit is ``WITHIN`` it; one at a frequency 1.5 times off is another, which takes
    the place of the first (``OTHERWISE``).
    """
    if found.word not in ("limit-cycle", "growing", "diverged") or not end.controller.params.wall.inward:
        return found
    if (found.word == "diverged" or found.why == _LEAVES) and _is_pressed_through(end):
        return replace(found, without={})
    start = _start(end, found)
    if start is None or not _is_alike(as_is := _watched(end, start), found):
        return found
    parts = idealised(start) | {HOLD: faster(start)} | (elements := uncontrolled(start))
    does = {name: _does(_watched(end, scene), as_is) for name, scene in parts.items()}
    if len(start.dissipation) > 1 and not {RESTS, WITHIN, LESS} & {does[name] for name in elements}:
        does[ELEMENTS] = _does(_watched(end, replace(start, dissipation=())), as_is)
    if RESTS not in does.values():
        does[ALL] = _does(_watched(end, _without_all(start)), as_is)
    return replace(found, without=does)


def _is_pressed_through(end: End) -> bool:
    """Tells whether a still hand presses harder on the device at its limit than wall, or actuator, answer there.

    Statically: the hand's spring and its grip are in series.
    """
    scene, wall = end.scene, end.controller.params.wall
    at_m = wall.inward * scene.diverged_beyond
    press_N, hand = end.hold_N, scene.hand
    if hand and hand.stiffness:
        share = hand.grip.stiffness / (hand.grip.stiffness + hand.stiffness) if hand.grip else 1.0
        press_N = share * (press_N + hand.stiffness * (hand.rest - at_m))
    most_N = (scene.actuator and scene.actuator.saturation) or math.inf
    return wall.inward * press_N > min(wall.held(abs(at_m - wall.position)), most_N)


def _start(end: End, found: Finding) -> Scene | None:
    """Returns the scene that the trials begin with; None if the wall does not hold the hand within the limit."""
    scene, wall = end.scene, end.controller.params.wall
    press_N = abs(press_of(end.hold_N, scene.hand, wall.position))
    if wall.held(depth_m := depth_of(wall, press_N)) < _HOLDS * press_N:
        return None
    if abs(wall.position + wall.inward * depth_m) > scene.diverged_beyond:
        return None
    v_m_s = wall.inward * min(math.pi * found.frequency_Hz * found.width_m, _FASTEST_M_S)
    device = replace(scene.device, position=float(wall.position + wall.inward * depth_m), velocity=v_m_s)
    friction = scene.friction if has_friction(scene) else None  # a table of zeros takes long
    return held(replace(scene, device=device, friction=friction), end.hold_N)


def _is_alike(as_is: Finding, found: Finding) -> bool:
    """Tells whether a loop that was started anew swings as in its run."""
    if found.word != "growing" and (as_is.why == _LEAVES) != (found.word == "diverged"):
        return False
    return DOES.get(as_is.word) == "swings on" and not _is_other(as_is, found)


def _is_other(one: Finding, other: Finding) -> bool:
    """Tells whether the frequencies of two swings, if they are known, differ."""
    known = one.frequency_Hz and other.frequency_Hz
    return bool(known) and not 1.0 / _OTHER < one.frequency_Hz / other.frequency_Hz < _OTHER


def _without_all(scene: Scene) -> Scene:
    """Returns the scene without all of its parts, one after another, at a higher control rate."""
    for name in idealised(scene):
        scene = idealised(scene)[name]
    scene = replace(scene, dissipation=())
    for name in OF_TABLES:
        scene = uncontrolled(scene).get(name, scene)
    return faster(scene)


def _watched(end: End, scene: Scene) -> Finding:
    """Returns what a loop does from its beginning, held as at the end of the run; what rests is also struck."""
    time = Timebase.from_scene(scene)
    plant, controller = Plant(scene, time), Controller(scene, time, end.controller.kinds)
    looks_s = [look_s for look_s in LOOKS_S if look_s * time.control_rate <= _MOST_TICKS] or LOOKS_S[:1]
    begun = End(scene, time, plant, controller, end.hold_N, on_exchange=end.on_exchange)
    push_N = push_of(end.hold_N, scene.hand, begun.wall_m)
    found = watch(begun, (push_N,), looks_s)[0]
    for blow in BLOWS:
        if is_struck(found):
            found = found.after_blow(watch(begun, (push_N * blow,), looks_s)[0])
    return found


def _does(changed: Finding, as_is: Finding) -> str:
    """Returns what a changed loop does, compared with the swing of the loop as it is."""
    does, is_other = DOES.get(changed.word, "undecided"), _is_other(changed, as_is)
    if does != "swings on" or changed.word != "limit-cycle":
        return does
    if as_is.why == _LEAVES:
        return WITHIN
    if as_is.word == "limit-cycle" and changed.width_m < (_FAR_LESS if is_other else _LESS) * as_is.width_m:
        return LESS
    return OTHERWISE if is_other else does
