"""Rules on times, contact, the wall that a hand presses, and events."""

from __future__ import annotations

import math

from haploop.launch.plan.meant.hand_and_wall import inward, inward_force_N, start_depth_m, wall_moves
from haploop.launch.plan.meant.rule import Found, Rule
from haploop.protocol.scene.hand_force import Trace
from haploop.protocol.scene.scene import NO_ELEMENT, Scene, accelerometer_is_used, hand_is_unmodelled
from haploop.protocol.ticks import Timebase
from haploop.protocol.walls.registry import make_wall

# The stiffness of a softer wall was mostly meant in N/mm.
SOFTEST_N_M = 20.0
_MANY_TICKS, _DEEP_M = 1000, 1e-3
_LONG_TICKS = 10_000_000
_RECORDED_SAMPLES = 50
# A hand that presses deeper than this is at the end of the travel of most devices.
_DEEPEST_PRESSED_M = 0.02


def _late(scene: Scene) -> Found | None:
    delay_s = scene.clock.round_trip_delay
    ticks = delay_s * scene.clock.control_rate
    return {"ticks": ticks, "delay_s": delay_s} if ticks >= _MANY_TICKS and delay_s <= 1.0 else None


def _long(scene: Scene) -> Found | None:
    ticks = scene.duration * scene.clock.control_rate
    return {"ticks": ticks, "duration_s": scene.duration} if ticks > _LONG_TICKS else None


def _trace_too_short(scene: Scene) -> Found | None:
    """Tells whether a recorded force ends before the run, at a force other than 0; few samples are no recording.

    The last sample holds until the one that would have followed it.
    """
    force = scene.hand.force if scene.hand else None
    if not isinstance(force, Trace) or len(force.time) < _RECORDED_SAMPLES:
        return None
    period_s = force.time[-1] - force.time[-2]
    if not force.force[-1] or force.time[-1] + 1.01 * period_s >= scene.duration:
        return None
    return {"end_s": force.time[-1], "duration_s": scene.duration, "last_N": force.force[-1]}


def _no_contact(scene: Scene) -> Found | None:
    """Tells whether elements wait for a contact that cannot come."""
    waiting = [element for element in scene.dissipation if element.acts != "always"]
    return {} if waiting and scene.wall is None and not hand_is_unmodelled(scene) else None


def _never_answers(scene: Scene) -> Found | None:
    return {} if scene.clock.round_trip_delay >= scene.duration else None


def _ideal_accelerometer(scene: Scene) -> Found | None:
    return {} if accelerometer_is_used(scene) and scene.accelerometer is None else None


def _begins_deep(scene: Scene) -> Found | None:
    depth_m = start_depth_m(scene)
    if scene.wall is None or depth_m <= _DEEP_M or not scene.wall.stiffness:
        return None
    return {"depth_mm": depth_m * 1e3, "force_N": make_wall(scene.wall).held(depth_m)}


def _pressed_deep(scene: Scene) -> Found | None:
    """Compares the wall's force at a depth of 2 cm with the hand's force there, less what the hand's spring holds back.

    The rule does not apply to a run that ends before the hand's damping has let the device come that far.
    """
    hand, wall = scene.hand, scene.wall
    if hand is None or wall is None or hand_is_unmodelled(scene) or wall.stiffness < SOFTEST_N_M:
        return None
    if wall_moves(scene) or any("wall.stiffness" in (event.set or {}) for event in scene.event):
        return None
    law, force_N = make_wall(wall), inward_force_N(scene)
    farthest_m = force_N * scene.duration / hand.damping if hand.damping else math.inf

    def is_pressed_to(depth_m: float) -> bool:
        back_m = (wall.position - hand.rest) * inward(wall) + depth_m
        if (wall.position - scene.device.position) * inward(wall) + depth_m > farthest_m:
            return False
        return force_N - hand.stiffness * back_m > law.held(depth_m)

    if force_N <= 0.0 or not is_pressed_to(_DEEPEST_PRESSED_M):
        return None
    depth_m, beyond_m = _DEEPEST_PRESSED_M, 1e3
    while beyond_m - depth_m > 1e-4 * depth_m:
        middle_m = math.sqrt(depth_m * beyond_m)
        depth_m, beyond_m = (middle_m, beyond_m) if is_pressed_to(middle_m) else (depth_m, middle_m)
    stiffness = {"stiffness": wall.stiffness, "stiffness_N_mm": wall.stiffness / 1e3}
    return {"depth_mm": depth_m * 1e3, "force_N": force_N, **stiffness}


def _overwritten(scene: Scene) -> Found | None:
    """Finds the first two events of one tick of which the later overwrites what the earlier did."""
    time = Timebase.from_scene(scene)
    did: dict[tuple[int, str], int] = {}
    for index, event in enumerate(scene.event):
        tick = time.first_tick_at(event.at)
        keys = [f"dissipation.{event.element or 0}"] if event.swap else [*(event.set or {})]
        for key in keys:
            over = [what for at, what in did if at == tick and (what == key or what.startswith(f"{key}."))]
            if over:
                return {"what": over[0], "at_s": tick / time.control_rate, "tick": tick, "first": did[tick, over[0]]}
        if event.swap and event.swap.name == NO_ELEMENT:  # those after it move up
            did = {(at, what): by for (at, what), by in did.items() if not what.startswith("dissipation.")}
        else:
            did |= dict.fromkeys([(tick, key) for key in keys], index)
    return None


LOOP = (
    Rule(
        _late,
        "clock.round_trip_delay",
        "The delay, {delay_s:g} s, is {ticks:.0f} ticks; is that the unit you meant?",
    ),
    Rule(
        _long,
        "duration",
        "The run has {ticks:.3g} ticks, {duration_s:.6g} s, and its log holds them all; is that the unit you meant?",
    ),
    Rule(
        _trace_too_short,
        "hand.force",
        "The recorded force ends at {end_s:g} s and the run at {duration_s:g} s; its last value, {last_N:.3g} N, is "
        "held from then on.",
    ),
    Rule(
        _no_contact,
        "dissipation",
        "Nothing is ever in contact, since there is no [wall]: elements of [[dissipation]] give no force unless they "
        'say acts = "always".',
    ),
    Rule(
        _never_answers,
        "clock.round_trip_delay",
        "No force takes effect within the run, since clock.round_trip_delay is no shorter than duration.",
    ),
    Rule(
        _ideal_accelerometer,
        "acceleration",
        "An estimate reads an accelerometer that no table describes, so it is ideal: no noise, no counts, no delay. "
        "An [accelerometer] table gives it those of a real one.",
    ),
    Rule(
        _begins_deep,
        "wall.position",
        "The device begins {depth_mm:.3g} mm deep in the wall, which at once pushes it out with {force_N:.3g} N; "
        "device.position, wall.position or wall.occupies may be the other way round.",
    ),
    Rule(
        _pressed_deep,
        "wall.stiffness",
        "The wall gives way by {depth_mm:.3g} mm to the hand's largest force, {force_N:.3g} N; is {stiffness:g} N/m, "
        "which is {stiffness_N_mm:g} N/mm, the stiffness you meant?",
    ),
    Rule(
        _overwritten,
        "event.{first}",
        "Two events change {what} at {at_s:.6g} s (tick {tick}); only the later of the two counts.",
    ),
)
