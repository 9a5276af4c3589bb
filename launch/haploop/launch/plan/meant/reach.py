"""Rules that say why a device does not reach the wall, or is not held there."""

from __future__ import annotations

import math

from haploop.launch.plan.meant.hand_and_wall import (
    inward,
    inward_force_N,
    most_force_N,
    start_depth_m,
    wall_moves,
)
from haploop.launch.plan.meant.rule import Found, Rule
from haploop.protocol.scene.hand_force import Trace, constant_from_s
from haploop.protocol.scene.scene import Scene, hand_is_unmodelled

# A force does next to nothing if it is no more than this share of the friction, or if it stretches a spring by no more
# than this share of the distance.
_FEEBLE = 0.1


def _pushed_by_nothing(scene: Scene) -> Found | None:
    """Tells whether a device is at rest in balance at t = 0, with no force to come, and no noise that may move it."""
    hand, device = scene.hand, scene.device
    if hand_is_unmodelled(scene) or scene.others or scene.noise or wall_moves(scene):
        return None
    spring = bool(hand and hand.stiffness and hand.rest != device.position)
    pushed = device.velocity or most_force_N(scene) or spring or start_depth_m(scene) > -scene.count_m
    return None if pushed else {}


def _held_by_friction(scene: Scene) -> Found | None:
    """Compares dry friction with the largest push of hand and spring on a device that is at rest outside the wall."""
    hand, rubs, begin = scene.hand, scene.friction, scene.device.position
    is_pushed = scene.others or scene.device.velocity or start_depth_m(scene) > 0.0 or wall_moves(scene)
    if hand is None or rubs is None or hand_is_unmodelled(scene) or is_pushed:
        return None
    push_N, friction_N = most_force_N(scene) + hand.stiffness * abs(hand.rest - begin), _friction_N(scene)
    return {"friction_N": friction_N, "push_N": push_N} if 0.0 < push_N <= friction_N else None


def _feeble_beside_friction(scene: Scene) -> Found | None:
    """Compares the hand's largest force with dry friction, for a device that something else moves."""
    if hand_is_unmodelled(scene) or _held_by_friction(scene) is not None:
        return None
    force_N, friction_N = most_force_N(scene), _friction_N(scene)
    return {"force_N": force_N, "friction_N": friction_N} if 0.0 < force_N <= _FEEBLE * friction_N else None


def _friction_N(scene: Scene) -> float:
    return max(scene.friction.kinetic, scene.friction.breakaway or 0.0) if scene.friction else 0.0


def _beyond_the_end(scene: Scene) -> Found | None:
    wall, most = scene.wall, scene.diverged_beyond
    if wall is None or start_depth_m(scene) > 0.0 or abs(wall.position) < most or wall_moves(scene):
        return None
    return {"position_m": wall.position, "most_m": most}


def _out_of_reach(scene: Scene) -> Found | None:
    """Compares the distance to the wall with the farthest that hand and speed can move the single mass.

    With m x'' + b x' + k x = F, |F| <= F_max, w = sqrt(k / m) and x measured from the spring's rest: |x| is at most
    sqrt(x0^2 + (v0 / w)^2) + F_max G, with G the integral of the impulse response's magnitude: 1 / k if it does not
    oscillate, else coth(pi z / (2 sqrt(1 - z^2))) / k with z = b / (2 sqrt(k m)). Without a spring |v| is at most
    |v0| + F_max t / m.
    """
    hand, device, wall = scene.hand, scene.device, scene.wall
    always = any(element.acts == "always" for element in scene.dissipation)
    if wall is None or hand_is_unmodelled(scene) or scene.others or scene.noise or always:
        return None
    if wall_moves(scene) or start_depth_m(scene) > 0.0 or _pushed_by_nothing(scene) is not None:
        return None
    if scene.transmission or (hand and hand.grip):
        reach_m = _reach_of_chain_m(scene)
        way_m = abs(wall.position - device.position) - scene.count_m
        return {"way_mm": way_m * 1e3, "reach_mm": reach_m * 1e3} if way_m > reach_m else None
    mass, damping = device.mass + (hand.mass if hand else 0.0), device.damping + (hand.damping if hand else 0.0)
    force_N, spring = most_force_N(scene) + _friction_N(scene), hand.stiffness if hand else 0.0
    seconds, speed = scene.duration, abs(device.velocity)
    begin, reach_m = device.position, speed * seconds + force_N * seconds**2 / (2.0 * mass)
    if hand and spring:
        ratio = damping / (2.0 * math.sqrt(spring * mass))
        held = 1.0 / math.tanh(0.5 * math.pi * ratio / math.sqrt(1.0 - ratio**2)) if 0.0 < ratio < 1.0 else 1.0
        swing = math.hypot(begin - hand.rest, speed * math.sqrt(mass / spring)) + force_N * held / spring
        if ratio and abs(begin - hand.rest) + swing < reach_m:
            begin, reach_m = hand.rest, swing
    way_m = abs(wall.position - begin) - scene.count_m
    is_told = _beyond_the_end(scene) is not None
    return {"way_mm": way_m * 1e3, "reach_mm": reach_m * 1e3} if way_m > reach_m and not is_told else None


def _reach_of_chain_m(scene: Scene) -> float:
    """Returns a bound on how far a chain of springs moves from rest under a force that only grows; else infinity.

    A step of F on the hand's mass gives at most F s_0 to the springs, with s_i their stretches, s_0 that of the spring
    to the ground: k_0 s_0^2 + sum k_i s_i^2 <= 2 F s_0, so s_0 <= 2 F / k_0 and sum k_i s_i^2 <= F^2 / k_0; a force
    that grows is a sum of steps.
    """
    hand, device = scene.hand, scene.device
    if hand is None or hand.force is None or math.isinf(constant_from_s(hand.force)):
        return math.inf
    if not hand.stiffness or device.velocity or device.position != hand.rest:
        return math.inf
    give = [spring.stiffness for spring in (scene.transmission, hand.grip) if spring]
    force_N, ground = most_force_N(scene), hand.stiffness
    return force_N * (2.0 / ground + math.sqrt(sum(1.0 / stiffness for stiffness in give) / ground))


def _pushed_away(scene: Scene) -> Found | None:
    """Tells whether a force that keeps its sign drives a device away from a wall that it does not touch."""
    hand, wall = scene.hand, scene.wall
    held = hand and hand.stiffness and hand.rest != scene.device.position
    if wall is None or hand is None or held or scene.event or scene.others or start_depth_m(scene) >= 0.0:
        return None
    lasts = hand.force is not None and math.isfinite(hand.force.constant_from_s())
    sign, value_N = inward(wall), getattr(hand.force, "value", 0.0) if lasts else 0.0
    away = value_N * sign < 0.0 and scene.device.velocity * sign <= 0.0
    return {"force_N": value_N} if away else None


def _not_held_there(scene: Scene) -> Found | None:
    """Compares the distance to the wall with where the hand's force, over its stiffness, holds the device in the end.

    A device thrown at the wall may be meant to leave it again, but hardly if the hand's force does next to nothing.
    """
    hand, device, wall = scene.hand, scene.device, scene.wall
    if hand is None or wall is None or hand_is_unmodelled(scene) or not hand.stiffness or not hand.force:
        return None
    changes = math.isinf(hand.force.constant_from_s()) and not isinstance(hand.force, Trace)
    moves = changes or scene.others or scene.noise or wall_moves(scene)
    if moves or start_depth_m(scene) >= -scene.count_m or any(of(scene) is not None for of in _KEPT_OFF):
        return None
    way_m = (wall.position - hand.rest) * inward(wall) - scene.count_m
    reach_m = inward_force_N(scene) / hand.stiffness
    if device.velocity and not 0.0 < reach_m <= _FEEBLE * way_m:
        return None
    return {"way_mm": way_m * 1e3, "reach_mm": reach_m * 1e3} if way_m > reach_m else None


# Each of these alone says why the wall is not reached.
_KEPT_OFF = (
    _pushed_by_nothing,
    _held_by_friction,
    _feeble_beside_friction,
    _beyond_the_end,
    _out_of_reach,
    _pushed_away,
)

REACH = (
    Rule(
        _pushed_by_nothing,
        "device",
        "Nothing moves the device: the hand has no force and no stretched spring, the device no velocity at the start, "
        "and it begins outside the wall. [hand.force] would push it, device.velocity would throw it.",
        keeps_off=True,
    ),
    Rule(
        _held_by_friction,
        "friction.kinetic",
        "Dry friction of {friction_N:.3g} N holds the device, which the hand pushes by {push_N:.3g} N at most: it "
        "hardly moves. Is that the unit you meant?",
        keeps_off=True,
    ),
    Rule(
        _feeble_beside_friction,
        "hand.force",
        "The hand's largest force, {force_N:.3g} N, is very small beside the device's dry friction of "
        "{friction_N:.3g} N: it does not press a device that has come to rest. Is that the unit you meant?",
        keeps_off=True,
    ),
    Rule(
        _beyond_the_end,
        "wall.position",
        "The wall is at {position_m:g} m; a run ends as diverged beyond {most_m:g} m (diverged_beyond), before the "
        "device gets there. Is that the unit you meant?",
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
        _not_held_there,
        "wall.position",
        "The hand's force holds the device {reach_mm:.4g} mm from its spring's rest, and the wall is {way_mm:.4g} mm "
        "from there: the device touches it at most during a swing.",
        keeps_off=True,
    ),
)
