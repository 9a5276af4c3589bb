"""Rules of scenes that are in order but cannot be meant: one each, with its condition and the sentence it says."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from haploop.protocol.scene.hand_force import Sine, Trace, constant_from_s
from haploop.protocol.scene.paths import value_at
from haploop.protocol.scene.scene import NO_ELEMENT, Scene, Wall, accelerometer_is_used, hand_is_unmodelled
from haploop.protocol.walls.registry import make_wall

# A softer wall is mostly one meant in N/mm.
_SOFTEST_N_M = 20.0
# Beyond these a number is in order, but more often a slip of the unit: key, least, most, unit.
_USUAL = (
    ("clock.round_trip_delay", 0.0, 1.0, "s"),
    ("wall.stiffness", _SOFTEST_N_M, 1e6, "N/m"),
    ("device.mass", 1e-4, 10.0, "kg"),
    ("encoder.resolution", 1e-10, 1e-3, "m"),
    ("noise.deviation", 1e-10, 1e-3, "m"),
    ("actuator.saturation", 0.05, 1e3, "N"),
    ("hand.force.value", 1e-3, 200.0, "N"),
)
_MANY_TICKS, _DEEP_M = 1000, 1e-3
_LONG_TICKS = 10_000_000
# A hand that presses deeper than this is at the end of most devices' way.
_DEEPEST_PRESSED_M = 0.02
Found = Mapping[str, Any]


class Note(str):
    """A sentence on a scene that is in order.

    Attributes:
        key: what it speaks of, a dotted key of the resolved scene.
        keeps_off: whether it tells why the device does not touch the wall.
    """

    __slots__ = ("keeps_off", "key")

    def __new__(cls, sentence: str, key: str = "", keeps_off: bool = False) -> Note:
        note = super().__new__(cls, sentence)
        note.key, note.keeps_off = key, keeps_off
        return note


class Rule(NamedTuple):
    """A rule: the numbers of its sentence where a resolved scene breaks it, None where it holds.

    ``key`` is what it speaks of; its name in braces is taken from what was found.
    """

    broken: Callable[[Scene], Found | None]
    key: str
    sentence: str
    keeps_off: bool = False


def _late(scene: Scene) -> Found | None:
    delay_s = scene.clock.round_trip_delay
    ticks = delay_s * scene.clock.control_rate
    return {"ticks": ticks, "delay_s": delay_s} if ticks >= _MANY_TICKS and delay_s <= 1.0 else None


def _long(scene: Scene) -> Found | None:
    ticks = scene.duration * scene.clock.control_rate
    return {"ticks": ticks, "duration_s": scene.duration} if ticks > _LONG_TICKS else None


def _no_contact(scene: Scene) -> Found | None:
    """Tells whether elements wait for a contact that cannot come."""
    waiting = [element for element in scene.dissipation if element.acts != "always"]
    return {} if waiting and scene.wall is None and not hand_is_unmodelled(scene) else None


def _never_answers(scene: Scene) -> Found | None:
    return {} if scene.clock.round_trip_delay >= scene.duration else None


def _pushed_by_nothing(scene: Scene) -> Found | None:
    """Tells whether a device is at rest at t = 0 in balance, without a force to come; noise alone may move it."""
    hand, device = scene.hand, scene.device
    if hand_is_unmodelled(scene) or scene.others or scene.noise or _wall_moves(scene):
        return None
    spring = bool(hand and hand.stiffness and hand.rest != device.position)
    pushed = device.velocity or _most_force_N(scene) or spring or _start_depth_m(scene) > -_count_m(scene)
    return None if pushed else {}


def _out_of_reach(scene: Scene) -> Found | None:
    """Compares the way to the wall with the longest that hand and speed can move the one mass there is.

    With m x'' + b x' + k x = F, |F| <= F_max, w = sqrt(k / m) and x from the spring's rest: |x| is at most
    sqrt(x0^2 + (v0 / w)^2) + F_max G, G the integral of the impulse response's size: 1 / k where it never swings, else
    coth(pi z / (2 sqrt(1 - z^2))) / k with z = b / (2 sqrt(k m)). Without a spring |v| is at most |v0| + F_max t / m.
    """
    hand, device, wall = scene.hand, scene.device, scene.wall
    always = any(element.acts == "always" for element in scene.dissipation)
    if wall is None or hand_is_unmodelled(scene) or scene.others or scene.noise or always:
        return None
    if _wall_moves(scene) or _start_depth_m(scene) > 0.0 or _pushed_by_nothing(scene) is not None:
        return None
    if scene.transmission or (hand and hand.grip):
        reach_m = _reach_of_chain_m(scene)
        way_m = abs(wall.position - device.position) - _count_m(scene)
        return {"way_mm": way_m * 1e3, "reach_mm": reach_m * 1e3} if way_m > reach_m else None
    mass, damping = device.mass + (hand.mass if hand else 0.0), device.damping + (hand.damping if hand else 0.0)
    force_N, spring = _most_force_N(scene), hand.stiffness if hand else 0.0
    if scene.friction:
        force_N += max(scene.friction.kinetic, scene.friction.breakaway or 0.0)
    seconds, speed = scene.duration, abs(device.velocity)
    begin, reach_m = device.position, speed * seconds + force_N * seconds**2 / (2.0 * mass)
    if hand and spring:
        ratio = damping / (2.0 * math.sqrt(spring * mass))
        held = 1.0 / math.tanh(0.5 * math.pi * ratio / math.sqrt(1.0 - ratio**2)) if 0.0 < ratio < 1.0 else 1.0
        swing = math.hypot(begin - hand.rest, speed * math.sqrt(mass / spring)) + force_N * held / spring
        if ratio and abs(begin - hand.rest) + swing < reach_m:
            begin, reach_m = hand.rest, swing
    way_m = abs(wall.position - begin) - _count_m(scene)
    is_told = _beyond_the_end(scene) is not None
    return {"way_mm": way_m * 1e3, "reach_mm": reach_m * 1e3} if way_m > reach_m and not is_told else None


def _reach_of_chain_m(scene: Scene) -> float:
    """Returns a bound of the way of a chain of springs from rest under a force that only grows; infinity of any other.

    A step of F on the hand's mass gives F s_0 to the springs at most, s_i their stretches, s_0 that to the ground:
    k_0 s_0^2 + sum k_i s_i^2 <= 2 F s_0, so s_0 <= 2 F / k_0 and sum k_i s_i^2 <= F^2 / k_0; a force that grows is a
    sum of steps.
    """
    hand, device = scene.hand, scene.device
    if hand is None or hand.force is None or math.isinf(constant_from_s(hand.force)):
        return math.inf
    if not hand.stiffness or device.velocity or device.position != hand.rest:
        return math.inf
    give = [spring.stiffness for spring in (scene.transmission, hand.grip) if spring]
    force_N, ground = _most_force_N(scene), hand.stiffness
    return force_N * (2.0 / ground + math.sqrt(sum(1.0 / stiffness for stiffness in give) / ground))


def _pushed_away(scene: Scene) -> Found | None:
    """Tells whether a force that keeps its sign drives a device away from a wall that it does not touch."""
    hand, wall = scene.hand, scene.wall
    held = hand and hand.stiffness and hand.rest != scene.device.position
    if wall is None or hand is None or held or scene.event or scene.others or _start_depth_m(scene) >= 0.0:
        return None
    inward = _inward(wall)
    value_N = getattr(hand.force, "value", 0.0)
    away = value_N * inward < 0.0 and scene.device.velocity * inward <= 0.0
    return {"force_N": value_N} if away else None


def _held_by_friction(scene: Scene) -> Found | None:
    """Compares dry friction with the most that hand and spring push a device by that is at rest outside the wall."""
    hand, rubs, begin = scene.hand, scene.friction, scene.device.position
    is_pushed = scene.others or scene.device.velocity or _start_depth_m(scene) > 0.0 or _wall_moves(scene)
    if hand is None or rubs is None or hand_is_unmodelled(scene) or is_pushed:
        return None
    push_N = _most_force_N(scene) + hand.stiffness * abs(hand.rest - begin)
    friction_N = max(rubs.kinetic, rubs.breakaway or 0.0)
    return {"friction_N": friction_N, "push_N": push_N} if 0.0 < push_N <= friction_N else None


def _beyond_the_end(scene: Scene) -> Found | None:
    wall, most = scene.wall, scene.diverged_beyond
    if wall is None or _start_depth_m(scene) > 0.0 or abs(wall.position) < most or _wall_moves(scene):
        return None
    return {"position_m": wall.position, "most_m": most}


def _ideal_accelerometer(scene: Scene) -> Found | None:
    return {} if accelerometer_is_used(scene) and scene.accelerometer is None else None


def _begins_deep(scene: Scene) -> Found | None:
    depth_m = _start_depth_m(scene)
    if scene.wall is None or depth_m <= _DEEP_M or not scene.wall.stiffness:
        return None
    return {"depth_mm": depth_m * 1e3, "force_N": make_wall(scene.wall).held(depth_m)}


def _not_held_there(scene: Scene) -> Found | None:
    """Compares the way to the wall with where the hand's force, over its stiffness, holds the device in the end."""
    hand, device, wall = scene.hand, scene.device, scene.wall
    if hand is None or wall is None or hand_is_unmodelled(scene) or not hand.stiffness or not hand.force:
        return None
    moves = device.velocity or isinstance(hand.force, Sine) or scene.others or scene.noise or _wall_moves(scene)
    if moves or _start_depth_m(scene) >= -_count_m(scene) or any(of(scene) is not None for of in _KEPT_OFF):
        return None
    way_m = (wall.position - hand.rest) * _inward(wall) - _count_m(scene)
    reach_m = _inward_force_N(scene) / hand.stiffness
    return {"way_mm": way_m * 1e3, "reach_mm": reach_m * 1e3} if way_m > reach_m else None


def _pressed_deep(scene: Scene) -> Found | None:
    """Compares what the wall gives at 2 cm with what the hand presses by there, less what its spring holds back.

    A run that ends before the hand's damping has let the device come as far is not meant.
    """
    hand, wall = scene.hand, scene.wall
    if hand is None or wall is None or hand_is_unmodelled(scene) or wall.stiffness < _SOFTEST_N_M:
        return None
    if _wall_moves(scene) or any("wall.stiffness" in (event.set or {}) for event in scene.event):
        return None
    law, force_N = make_wall(wall), _inward_force_N(scene)
    farthest_m = force_N * scene.duration / hand.damping if hand.damping else math.inf

    def is_pressed_to(depth_m: float) -> bool:
        back_m = (wall.position - hand.rest) * _inward(wall) + depth_m
        if (wall.position - scene.device.position) * _inward(wall) + depth_m > farthest_m:
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
    """Tells of the first two events of one tick of which the later takes away what the earlier did."""
    rate = scene.clock.control_rate
    did: dict[tuple[int, str], int] = {}
    for index, event in enumerate(scene.event):
        tick = math.ceil(event.at * rate - 1e-6)
        keys = [f"dissipation.{event.element or 0}"] if event.swap else [*(event.set or {})]
        for key in keys:
            over = [what for at, what in did if at == tick and (what == key or what.startswith(f"{key}."))]
            if over:
                return {"what": over[0], "at_s": tick / rate, "tick": tick, "first": did[tick, over[0]]}
        if event.swap and event.swap.name == NO_ELEMENT:  # those after it move up
            did = {(at, what): by for (at, what), by in did.items() if not what.startswith("dissipation.")}
        else:
            did |= dict.fromkeys([(tick, key) for key in keys], index)
    return None


# Each tells by itself why the wall is not reached.
_KEPT_OFF = (_pushed_by_nothing, _held_by_friction, _beyond_the_end, _out_of_reach, _pushed_away)

RULES = (
    Rule(
        _late,
        "clock.round_trip_delay",
        "The delay, {delay_s:g} s, is {ticks:.0f} ticks; is that the unit that was meant?",
    ),
    Rule(
        _long,
        "duration",
        "The run has {ticks:.3g} ticks, {duration_s:.6g} s, and its log holds them all; is that the unit that was "
        "meant?",
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
        _pushed_by_nothing,
        "device",
        "Nothing moves the device: the hand has no force and no stretched spring, the device no velocity at the start, "
        "and it begins outside the wall. [hand.force] would push it, device.velocity throw it.",
        keeps_off=True,
    ),
    Rule(
        _held_by_friction,
        "friction.kinetic",
        "Dry friction of {friction_N:.3g} N holds the device, which the hand pushes by {push_N:.3g} N at most: it "
        "hardly moves. Is that the unit that was meant?",
        keeps_off=True,
    ),
    Rule(
        _beyond_the_end,
        "wall.position",
        "The wall is at {position_m:g} m; a run ends as diverged beyond {most_m:g} m (diverged_beyond), before the "
        "device is there. Is that the unit that was meant?",
        keeps_off=True,
    ),
    Rule(
        _out_of_reach,
        "wall.position",
        "The wall is never reached: it is {way_mm:.4g} mm away, and the hand's force and the speed at the start "
        "move the device by less than {reach_mm:.3g} mm.",
        keeps_off=True,
    ),
    Rule(
        _pushed_away,
        "hand.force.value",
        "The hand's force of {force_N:.3g} N drives the device away from the wall, which it does not touch; "
        "hand.force.value or wall.occupies may be the other way round.",
        keeps_off=True,
    ),
    Rule(
        _ideal_accelerometer,
        "acceleration",
        "An estimate reads an accelerometer that no table describes, so it is ideal: no noise, no counts, no delay. "
        "[accelerometer] gives it those of a real one.",
    ),
    Rule(
        _begins_deep,
        "wall.position",
        "The device begins {depth_mm:.3g} mm deep in the wall, which throws it out with {force_N:.3g} N at once; "
        "device.position, wall.position or wall.occupies may be the other way round.",
    ),
    Rule(
        _not_held_there,
        "wall.position",
        "The hand's force holds the device {reach_mm:.4g} mm from its spring's rest, and the wall is {way_mm:.4g} mm "
        "from there: the device touches it in a swing at most.",
        keeps_off=True,
    ),
    Rule(
        _pressed_deep,
        "wall.stiffness",
        "The wall gives way by {depth_mm:.3g} mm to the hand's largest force, {force_N:.3g} N; is {stiffness:g} N/m, "
        "which is {stiffness_N_mm:g} N/mm, the stiffness that was meant?",
    ),
    Rule(
        _overwritten,
        "event.{first}",
        "Two events change {what} at {at_s:.6g} s (tick {tick}); only the later of the two counts.",
    ),
)


def note_unmeant(scene: Scene) -> list[Note]:
    """Returns a sentence for every rule that a resolved scene breaks, and for numbers that hardly any loop has."""
    unusual = [
        Note(
            f"{key} is {value:g} {unit}; is that the unit that was meant? "
            f"Haptic loops have {least:g} to {most:g} {unit}.",
            key,
        )
        for key, least, most, unit in _USUAL
        if (value := value_at(scene, key)) and not least <= abs(value) <= most
    ]
    broken = [(rule, rule.broken(scene)) for rule in RULES]
    return unusual + [
        Note(rule.sentence.format(**found), rule.key.format(**found), rule.keeps_off)
        for rule, found in broken
        if found is not None
    ]


def _most_force_N(scene: Scene) -> float:
    """Returns the largest force of the hand, to either side."""
    force = scene.hand.force if scene.hand else None
    if force is None:
        return 0.0
    if isinstance(force, Trace):
        return max(map(abs, force.force))
    return abs(force.amplitude) + abs(force.offset) if isinstance(force, Sine) else abs(force.value)


def _inward(wall: Wall) -> float:
    return -1.0 if wall.occupies == "below" else 1.0


def _inward_force_N(scene: Scene) -> float:
    """Returns the largest force of the hand towards the wall; 0 where it has none."""
    force = scene.hand.force if scene.hand else None
    if force is None or scene.wall is None:
        return 0.0
    sign = _inward(scene.wall)
    if isinstance(force, Trace):
        return max(0.0, *(sign * each for each in force.force))
    at_most_N = abs(force.amplitude) + sign * force.offset if isinstance(force, Sine) else sign * force.value
    return max(0.0, at_most_N)


def _start_depth_m(scene: Scene) -> float:
    """Returns how deep in the wall the device begins; negative outside, minus infinity without a wall."""
    wall: Wall | None = scene.wall
    if wall is None:
        return -math.inf
    return (wall.position - scene.device.position) * (1.0 if wall.occupies == "below" else -1.0)


def _count_m(scene: Scene) -> float:
    return scene.encoder.resolution if scene.encoder else 0.0


def _wall_moves(scene: Scene) -> bool:
    return any("wall.position" in (event.set or {}) for event in scene.event)
