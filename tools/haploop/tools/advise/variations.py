"""Variations of a loop: delay, hand and device a fifth more or less, and the loop without a cause of buzzing."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from haploop.launch.plan.effects import all_effects
from haploop.protocol.scene.estimators import Acceleration
from haploop.protocol.scene.paths import value_at, with_value, without
from haploop.protocol.scene.scene import Scene, accelerometer_is_used
from haploop.tools.render.units import amount

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
SAMPLING = "sampling and hold"


@dataclass(frozen=True)
class Change:
    """A change of one quantity: what it is multiplied by, or for a delay of 0 what is added to it, s."""

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
        if self.added_s:
            return with_value(scene, "clock.round_trip_delay", scene.clock.round_trip_delay + self.added_s)
        return scale_quantities(scene, {self.quantity: self.factor})


def uncertain_quantities(scene: Scene) -> list[str]:
    """Returns the quantities of a resolved scene that can be a fifth more or less: those that are there and not 0."""
    found = [DELAY] if scene.clock.round_trip_delay else []
    return found + [name for name in _KEYS if any(value_at(scene, key) for key in _keys_of(name))]


def single_changes(scene: Scene) -> list[Change]:
    """Returns each quantity a fifth less and a fifth more."""
    return [Change(name, factor) for name in uncertain_quantities(scene) for factor in (1.0 - SHARE, 1.0 + SHARE)]


def larger_changes(scene: Scene) -> list[Change]:
    """Returns each quantity ever more and ever less."""
    names, rate = uncertain_quantities(scene), scene.clock.plant_rate
    found = [Change(name, factor) for name in names for factor in _FARTHER]
    if DELAY not in names:
        steps = dict.fromkeys(max(1, round(added * rate)) for added in _ADDED_S)
        found += [Change(DELAY, added_s=count / rate) for count in steps]
    return found


def corners(scene: Scene) -> Iterator[dict[str, float]]:
    """Returns every combination of all quantities a fifth less or more."""
    names = uncertain_quantities(scene)
    for factors in itertools.product((1.0 - SHARE, 1.0 + SHARE), repeat=len(names)):
        yield dict(zip(names, factors, strict=True))


def scale_quantities(scene: Scene, factors: Mapping[str, float]) -> Scene:
    """Returns the scene with these quantities multiplied.

    A delay is rounded to whole plant steps, by at least one. A force of the hand that works against its spring is
    multiplied with it: the hand still wants to reach as far.
    """
    for name, factor in factors.items():
        if name == DELAY:
            scene = with_value(scene, "clock.round_trip_delay", delay_s(scene, factor))
            continue
        keys = _keys_of(name)
        if name == "hand stiffness" and value_at(scene, "hand.rest") != value_at(scene, "wall.position"):
            keys.append("hand.force.value")
        for key in keys:
            if value := value_at(scene, key):
                scene = with_value(scene, key, value * factor)
    return scene


def delay_s(scene: Scene, factor: float) -> float:
    """Returns the delay multiplied and rounded to whole plant steps, but not to what it was, s."""
    rate = scene.clock.plant_rate
    steps = round(scene.clock.round_trip_delay * rate)
    rounded = round(steps * factor)
    if rounded == steps and factor != 1.0:
        rounded += 1 if factor > 1.0 else -1
    return rounded / rate


def _keys_of(quantity: str) -> list[str]:
    return [_KEYS[quantity], *(e.scaled_with[quantity] for e in all_effects() if quantity in e.scaled_with)]


@dataclass(frozen=True)
class Cause:
    """A cause that may make a loop buzz.

    Attributes:
        name: as in "because of the delay".
        without: words for what takes its place.
        off: the resolved scene without it; None where the scene has none of it.
        leak: its part of the wall's leak, as the summary names it; None where the books cannot tell.
        is_element: whether it is a dissipation element, which is there to help.
    """

    name: str
    without: str
    off: Callable[[Scene], Scene | None]
    leak: str | None = None
    is_element: bool = False


def causes(scene: Scene) -> list[Cause]:
    """Returns the causes that a resolved scene has; of elements of one kind each is named with its number."""
    kinds = [table.name for table in scene.dissipation]
    elements = [
        Cause(
            kind.replace("-", " ") + (f" (element {i})" if kinds.count(kind) > 1 else ""),
            "left out",
            _without_element(i),
            is_element=True,
        )
        for i, kind in enumerate(kinds)
    ]
    return [cause for cause in (*_CAUSES, *elements) if cause.off(scene) is not None]


def without_causes(scene: Scene, some: Iterable[Cause]) -> Scene:
    """Returns the scene without some causes; elements go last, so that their numbers hold."""
    for cause in sorted(some, key=lambda cause: cause.is_element):
        scene = cause.off(scene) or scene
    return scene


def _sampling(scene: Scene) -> Scene | None:
    """Puts a tick at every plant step; windows of so many ticks keep their time."""
    times = scene.clock.plant_rate // scene.clock.control_rate
    if times == 1:
        return None
    scene = with_value(scene, "clock.control_rate", scene.clock.plant_rate)
    for key in ("velocity.ticks", "acceleration.ticks"):
        if ticks := value_at(scene, key):
            scene = with_value(scene, key, ticks * times)
    return scene


def _delay(scene: Scene) -> Scene | None:
    return with_value(scene, "clock.round_trip_delay", 0.0) if scene.clock.round_trip_delay else None


def _lag(scene: Scene) -> Scene | None:
    """Puts plain differences of one tick, and an ideal accelerometer where one is used.

    Without meaning where no element reads an estimate.
    """
    tables = scene.estimate("velocity"), scene.estimate("acceleration")
    plain = all(table.estimator in (None, "difference") and table.cutoff is None for table in tables)
    late = accelerometer_is_used(scene) and any(
        value_at(scene, key) for key in ("accelerometer.bandwidth", "accelerometer.delay")
    )
    if (plain and not late) or not scene.dissipation:
        return None
    read = value_at(scene, "acceleration.source") == "accelerometer"
    scene = without(scene, "velocity", "accelerometer.bandwidth", "accelerometer.delay")
    return replace(scene, acceleration=Acceleration(source="accelerometer" if read else "encoder"))


def _of_effects(cause: str) -> Callable[[Scene], Scene | None]:
    def off(scene: Scene) -> Scene | None:
        after = scene
        for effect in all_effects():
            if cause in effect.frees and effect.is_in(after):
                after = effect.frees[cause](after)
        return None if after is scene else after

    return off


def _without_element(index: int) -> Callable[[Scene], Scene | None]:
    def off(scene: Scene) -> Scene | None:
        tables = scene.dissipation
        return replace(scene, dissipation=tables[:index] + tables[index + 1 :]) if index < len(tables) else None

    return off


_CAUSES = (
    Cause(SAMPLING, "controlled at every plant step", _sampling, "sampling_and_hold_J"),
    Cause("quantisation", "positions that are not rounded", _of_effects("quantisation"), "quantisation_J"),
    Cause("delay", "no delay", _delay, "delay_J"),
    Cause("estimator lag", "plain differences, ideal accelerometer", _lag),
    Cause("structural mode", "a rigid transmission", _of_effects("structural mode")),
    Cause("noise", "no noise", _of_effects("noise")),
    Cause("actuator", "no limits of the actuator", _of_effects("actuator")),
    Cause("jitter and loss", "a line without jitter and loss", _of_effects("jitter and loss")),
    Cause("friction", "no dry friction", _of_effects("friction")),
)
