"""Corners: loops not quite as described, with what is measured a fifth off and what is assumed half or twice."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from haploop.launch.plan.effects import all_effects
from haploop.protocol.scene.paths import value_at, with_value
from haploop.protocol.scene.scene import Scene

# Factors between which measured quantities, and numbers that a device file assumes, may differ from the description.
TOLERANCE, ASSUMED = (0.8, 1.2), (0.5, 2.0)
_ENDS = {0.5: "halved", 2.0: "doubled", 0.8: "20 % less", 1.2: "20 % more"}
DELAY, _DELAY_KEY = "delay", "clock.round_trip_delay"
# What else is measured, and its key; effects such as a grip and a motor have keys that are scaled with it.
_KEYS = {
    "device mass": "device.mass",
    "hand mass": "hand.mass",
    "hand damping": "hand.damping",
    "hand stiffness": "hand.stiffness",
    "cable stiffness": "transmission.stiffness",
    "friction": "friction.kinetic",
    "device damping": "device.damping",
    "cable damping": "transmission.damping",
    "actuator bandwidth": "actuator.bandwidth",
    "actuator force": "actuator.saturation",
    "noise": "noise.deviation",
}
# Facts of construction, which no wear and no measurement changes, and effects with more than one number.
_AS_BUILT = {
    "encoder count": "encoder.resolution",
    "force step": "actuator.resolution",
    "accelerometer": "accelerometer",
    "jitter": "jitter",
    "loss": "loss",
    "ticks": "clock.control_rate",
}
# Words for the numbers that a device file may assume.
_WORDS = {key: words for words, key in (_KEYS | _AS_BUILT).items()} | {
    _DELAY_KEY: DELAY,
    "transmission.motor_mass": "motor mass",
    "transmission.motor_damping": "motor damping",
    "friction.breakaway": "breakaway friction",
}
# A search takes a regular fraction of the corners: all of this many quantities, each further one as the parity of some
# of these, so that no two are confounded (a fractional factorial design of resolution IV; Box, Hunter and Hunter 1978).
_ALL_OF = 5
_PARITIES = sorted((mask for mask in range(2**_ALL_OF) if mask.bit_count() in (3, 5)), key=int.bit_count, reverse=True)

Corner = tuple[tuple[str, float], ...]
# Factors between which quantities, or numbers by their dotted keys, may lie, by name.
Ranges = Mapping[str, tuple[float, float]]


def ranges(loop: Scene, assumed: Sequence[str] = ()) -> dict[str, tuple[float, float]]:
    """Returns what is uncertain and by which factors: what a user's loop differs in, and the assumed keys.

    Only what exists and is not 0; a quantity whose keys are all assumed does not appear itself.
    """
    found = {DELAY: TOLERANCE} if loop.clock.round_trip_delay and _DELAY_KEY not in assumed else {}
    for name in _KEYS:
        if any(value_at(loop, key) for key in _keys_of(name) if key not in assumed):
            found[name] = TOLERANCE
    return found | {key: ASSUMED for key in assumed if is_number(value_at(loop, key))}


def as_built(loop: Scene, of: Ranges) -> tuple[str, ...]:
    """Returns what the loop has and no case varies."""
    return tuple(name for name, key in _AS_BUILT.items() if value_at(loop, key) and key not in of)


def is_number(value: object) -> bool:
    """Tells whether a value is a number that can be halved and doubled."""
    return isinstance(value, float) and value != 0.0


def corner(of: Ranges, number: int) -> Corner:
    """Returns one combination of the ends of the ranges: bit i of the number says which end of the i-th."""
    return tuple((name, ends[number >> i & 1]) for i, (name, ends) in enumerate(of.items()))


def corner_words(some: Corner) -> str:
    """Returns a corner in words: ``halved: cable stiffness; 20 % less: friction, device mass``.

    A point within the tolerances is ``within: friction -7 %, delay +3 %``.
    """
    changed: dict[str, list[str]] = {words: [] for words in _ENDS.values()} | {"within": []}
    for name, factor in some:
        off = f" {'+' if factor > 1.0 else '−'}{abs(factor - 1.0) * 100:.0f} %"
        words = _ENDS.get(factor, "within")
        if factor != 1.0:
            changed[words].append(quantity(name) + (off if words == "within" else ""))
    return "; ".join(f"{words}: {', '.join(names)}" for words, names in changed.items() if names)


def quantity(name: str) -> str:
    """Returns the words for a quantity, or for the number of a device file by its dotted key."""
    return _WORDS.get(name, name)


def design(of: Ranges) -> tuple[Corner, ...]:
    """Returns the loop as described and every corner, or 32 of more, with no two of 16 quantities confounded."""
    found: list[Corner] = [()]
    for low in range(2 ** min(len(of), _ALL_OF)):
        number = low
        for i in range(len(of) - _ALL_OF):
            number |= (low & _PARITIES[i % len(_PARITIES)]).bit_count() % 2 << _ALL_OF + i
        found.append(corner(of, number))
    return tuple(dict.fromkeys(found))


def flipped(of: Ranges, some: Corner) -> list[Corner]:
    """Returns the corners that differ from one in a single quantity."""
    at = dict(some)
    return [tuple((at | {name: sum(ends) - at[name]}).items()) for name, ends in of.items()]


def drawn(of: Ranges, corners: int, points: int) -> list[Corner]:
    """Returns this many corners, or all if there are no more, and points within, evenly on logarithmic axes.

    A delay is at either end or as described, since loops with the same delay run side by side. Each call draws the
    same.
    """
    random, count = np.random.default_rng(1), 2 ** len(of)
    numbers = range(count) if count <= corners else np.unique(random.integers(count, size=corners)).tolist()
    found = [corner(of, number) for number in numbers]
    for _ in range(points):
        at = {name: low * (high / low) ** random.random() for name, (low, high) in of.items()}
        for name in (DELAY, _DELAY_KEY):
            if name in at:
                at[name] = (of[name][0], 1.0, of[name][1])[int(random.integers(3))]
        found.append(tuple(at.items()))
    return found


def scale_quantities(scene: Scene, factors: Mapping[str, float]) -> Scene:
    """Returns the scene with these quantities, or keys, multiplied; a key overrides the quantity it belongs to.

    A delay changes by whole plant steps, at least one; breakaway friction is no less than kinetic friction.
    """
    for name, factor in factors.items():
        if name in (DELAY, _DELAY_KEY):
            scene = with_value(scene, _DELAY_KEY, delay_s(scene, factor))
            continue
        for key in _keys_of(name):
            if (value := value_at(scene, key)) and (key == name or key not in factors):
                scene = with_value(scene, key, value * factor)
    rubs = scene.friction
    if rubs and rubs.breakaway is not None and rubs.breakaway < rubs.kinetic:
        scene = with_value(scene, "friction.breakaway", rubs.kinetic)
    return scene


def delay_s(scene: Scene, factor: float) -> float:
    """Returns the delay multiplied and rounded to whole plant steps, but not back to what it was, s."""
    rate = scene.clock.plant_rate
    steps = round(scene.clock.round_trip_delay * rate)
    rounded = round(steps * factor)
    if rounded == steps and factor != 1.0:
        rounded += 1 if factor > 1.0 else -1
    return rounded / rate


def _keys_of(quantity: str) -> list[str]:
    """Returns the keys of a quantity; a key stands for itself."""
    if quantity not in _KEYS:
        return [quantity]
    return [_KEYS[quantity], *(e.scaled_with[quantity] for e in all_effects() if quantity in e.scaled_with)]
