"""Variations of a loop: delay, hand and device, each a fifth more or less, alone and in every combination."""

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
# What else is uncertain, and its key; effects such as a grip and a motor have keys that go with it.
_KEYS = {
    "device mass": "device.mass",
    "hand mass": "hand.mass",
    "hand damping": "hand.damping",
    "hand stiffness": "hand.stiffness",
}
# How far each is taken to find the nearest instability, beyond what is safe anyway.
_FARTHER = (1.3, 1.5, 2.0, 3.0, 5.0, 1 / 1.3, 1 / 1.5, 1 / 2.0, 1 / 3.0, 1 / 5.0)
# Added to a loop without delay, s.
_ADDED_S = (1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3)


@dataclass(frozen=True)
class Change:
    """A change of one quantity.

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
        """The distance from no change, by which changes are ordered."""
        return max(self.factor, 1.0 / self.factor) + self.added_s * 1e3

    @property
    def words(self) -> str:
        """The change in words: ``20 % more delay``."""
        if self.added_s:
            return f"{amount(self.added_s, 's')} more delay"
        if self.factor >= 2.0:
            return f"{'twice' if self.factor == 2.0 else f'{self.factor:g} times'} the {self.quantity}"
        if self.factor <= 0.5:
            return f"{'half' if self.factor == 0.5 else f'1/{1.0 / self.factor:g} of'} the {self.quantity}"
        share = abs(self.factor - 1.0)
        return f"{share * 100:.0f} % {'more' if self.factor > 1.0 else 'less'} {self.quantity}"

    def apply(self, scene: Scene) -> Scene:
        """Returns the scene so changed."""
        if self.added_s:
            return _with(scene, "clock.round_trip_delay", scene["clock"]["round_trip_delay"] + self.added_s)
        return scale_quantities(scene, {self.quantity: self.factor})


def uncertain_quantities(scene: Scene) -> list[str]:
    """Returns the quantities of a resolved scene that can be a fifth more or less: those that are there and not 0."""
    found = [DELAY] if scene["clock"]["round_trip_delay"] else []
    return found + [name for name in _KEYS if any(_at(scene, key) for key in _keys_of(name))]


def single_changes(scene: Scene) -> list[Change]:
    """Returns each quantity a fifth less and a fifth more."""
    return [Change(name, factor) for name in uncertain_quantities(scene) for factor in (1.0 - SHARE, 1.0 + SHARE)]


def larger_changes(scene: Scene) -> list[Change]:
    """Returns each quantity ever more and ever less."""
    found = [Change(name, factor) for name in uncertain_quantities(scene) for factor in _FARTHER]
    rate = scene["clock"]["plant_rate"]
    if DELAY not in uncertain_quantities(scene):
        steps = dict.fromkeys(max(1, round(added * rate)) for added in _ADDED_S)
        found += [Change(DELAY, added_s=count / rate) for count in steps]
    return found


def corners(scene: Scene) -> Iterator[dict[str, float]]:
    """Returns every combination of all quantities a fifth less or more."""
    names = uncertain_quantities(scene)
    for factors in itertools.product((1.0 - SHARE, 1.0 + SHARE), repeat=len(names)):
        yield dict(zip(names, factors, strict=True))


def scale_quantities(scene: Scene, factors: Factors) -> Scene:
    """Returns the scene with these quantities multiplied.

    A delay is rounded to whole plant steps, by at least one. A force of the hand that works against its spring is
    multiplied with it: the hand still wants to reach as far.
    """
    for name, factor in factors.items():
        if name == DELAY:
            scene = _with(scene, "clock.round_trip_delay", delay_s(scene, factor))
            continue
        for key in _keys_of(name):
            if value := _at(scene, key):
                scene = _with(scene, key, value * factor)
        value = _at(scene, "hand.force.value")
        if name == "hand stiffness" and value and scene["hand"]["rest"] != scene["wall"]["position"]:
            scene = _with(scene, "hand.force.value", value * factor)
    return scene


def delay_s(scene: Scene, factor: float) -> float:
    """Returns the delay multiplied and rounded to whole plant steps, but not to what it was, s."""
    rate = scene["clock"]["plant_rate"]
    steps = round(scene["clock"]["round_trip_delay"] * rate)
    rounded = round(steps * factor)
    if rounded == steps and factor != 1.0:
        rounded += 1 if factor > 1.0 else -1
    return rounded / rate


def _keys_of(quantity: str) -> list[str]:
    from haploop.launch.plan.effects import all_effects

    return [_KEYS[quantity], *(e.scaled_with[quantity] for e in all_effects() if quantity in e.scaled_with)]


def _at(scene: Scene, key: str) -> Any:
    from haploop.protocol.scene.paths import value_at

    return value_at(scene, key)


def _with(scene: Scene, key: str, value: Any) -> Scene:
    """Returns the scene with another value at a dotted key; the tables on the way are copied."""
    name, _, rest = key.partition(".")
    return {**scene, name: _with(scene[name], rest, value) if rest else value}
