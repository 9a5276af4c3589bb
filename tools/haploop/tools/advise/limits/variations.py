"""A loop that is not quite what it was taken for: delay, hand and device, each a fifth more or less."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from haploop.tools.render.units import amount

Scene = dict[str, Any]
Factors = Mapping[str, float]
SHARE = 0.2
DELAY = "delay"
# What else is uncertain, and its keys; a grip and a motor go with the hand and the device they belong to.
_KEYS = {
    "device mass": ("device.mass", "transmission.motor_mass"),
    "hand mass": ("hand.mass",),
    "hand damping": ("hand.damping", "hand.grip.damping"),
    "hand stiffness": ("hand.stiffness", "hand.grip.stiffness"),
}
# How far each is taken to find the nearest instability, beyond what is safe anyway.
_FARTHER = (1.3, 1.5, 2.0, 3.0, 5.0, 1 / 1.3, 1 / 1.5, 1 / 2.0, 1 / 3.0, 1 / 5.0)
# Added to a loop without delay, s.
_ADDED_S = (1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3)


@dataclass(frozen=True)
class Change:
    """One quantity that is not what it was taken for.

    Attributes:
        quantity: its name.
        factor: what it is multiplied by; 1 where something is added.
        added_s: what is added to the delay.
    """

    quantity: str
    factor: float = 1.0
    added_s: float = 0.0

    @property
    def size(self) -> float:
        """How far it is from no change, to order changes by."""
        return max(self.factor, 1.0 / self.factor) + self.added_s * 1e3

    @property
    def words(self) -> str:
        """``20 % more delay``."""
        if self.added_s:
            return f"{amount(self.added_s, 's')} more delay"
        if self.factor >= 2.0:
            return f"{'twice' if self.factor == 2.0 else f'{self.factor:g} times'} the {self.quantity}"
        if self.factor <= 0.5:
            return f"{'half' if self.factor == 0.5 else f'1/{1.0 / self.factor:g} of'} the {self.quantity}"
        share = abs(self.factor - 1.0)
        return f"{share * 100:.0f} % {'more' if self.factor > 1.0 else 'less'} {self.quantity}"

    def on(self, scene: Scene) -> Scene:
        """The scene so changed."""
        if self.added_s:
            return _with(scene, "clock.round_trip_delay", scene["clock"]["round_trip_delay"] + self.added_s)
        return scaled(scene, {self.quantity: self.factor})


def quantities(scene: Scene) -> list[str]:
    """What can be a fifth more or less in a resolved scene: what is there and not 0."""
    found = [DELAY] if scene["clock"]["round_trip_delay"] else []
    return found + [name for name, keys in _KEYS.items() if any(_at(scene, key) for key in keys)]


def singles(scene: Scene) -> list[Change]:
    """Each quantity a fifth less and a fifth more."""
    return [Change(name, factor) for name in quantities(scene) for factor in (1.0 - SHARE, 1.0 + SHARE)]


def farther(scene: Scene) -> list[Change]:
    """Each quantity ever more and ever less."""
    found = [Change(name, factor) for name in quantities(scene) for factor in _FARTHER]
    rate = scene["clock"]["plant_rate"]
    if DELAY not in quantities(scene):
        steps = dict.fromkeys(max(1, round(added * rate)) for added in _ADDED_S)
        found += [Change(DELAY, added_s=count / rate) for count in steps]
    return found


def corners(scene: Scene) -> Iterator[dict[str, float]]:
    """All quantities a fifth less or more, every combination."""
    names = quantities(scene)
    for factors in itertools.product((1.0 - SHARE, 1.0 + SHARE), repeat=len(names)):
        yield dict(zip(names, factors, strict=True))


def scaled(scene: Scene, factors: Factors) -> Scene:
    """The scene with these quantities multiplied.

    A delay is rounded to whole plant steps, by at least one. A force of the hand that works against its spring is
    multiplied with it: the hand still wants to reach as far.
    """
    for name, factor in factors.items():
        if name == DELAY:
            scene = _with(scene, "clock.round_trip_delay", delay_s(scene, factor))
            continue
        for key in _KEYS[name]:
            if value := _at(scene, key):
                scene = _with(scene, key, value * factor)
        value = _at(scene, "hand.force.value")
        if name == "hand stiffness" and value and scene["hand"]["rest"] != scene["wall"]["position"]:
            scene = _with(scene, "hand.force.value", value * factor)
    return scene


def delay_s(scene: Scene, factor: float) -> float:
    """The delay multiplied and rounded to whole plant steps, but not to what it was."""
    rate = scene["clock"]["plant_rate"]
    steps = round(scene["clock"]["round_trip_delay"] * rate)
    rounded = round(steps * factor)
    if rounded == steps and factor != 1.0:
        rounded += 1 if factor > 1.0 else -1
    return rounded / rate


def _at(scene: Scene, key: str) -> Any:
    from haploop.launch.plan.effects import at

    return at(scene, key)


def _with(scene: Scene, key: str, value: Any) -> Scene:
    """The scene with another value at a dotted key; the tables on the way are copied."""
    name, _, rest = key.partition(".")
    return {**scene, name: _with(scene[name], rest, value) if rest else value}
