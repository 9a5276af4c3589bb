"""The cases a wall has to bear: how hard the hand holds it and sways, and loops that are not quite as described."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from haploop.launch.plan.effects import all_effects
from haploop.plant.chain.chain import Chain
from haploop.protocol.scene.hand_force import Constant, Sine
from haploop.protocol.scene.paths import value_at, with_value
from haploop.protocol.scene.scene import Hand, Scene, Wall
from haploop.tools.render.units import amount

# The device meets the wall at this speed, a firm tap; in an attack by a slow press, and by the fastest tap measured.
TAP_M_S = 0.2
_SPEEDS = (1e-3, 0.24)
# The hand presses with this, or with this share of what the actuator can give where that is less.
PRESS_N, OF_THE_ACTUATOR = 1.0, 0.3
# Holds as multiples of the task's, and those that are tried first.
HOLDS = (0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0)
FIRST_HOLDS = (0.3, 1.0, 3.0)
# The hand sways by this share of its hold, this often a second, and a run lasts so long.
SWAY, SWAY_HZ, LASTS_S = 0.3, 0.5, 2.75
# A loop that is later than this has no answer in a reasonable time; a run lasts so many round trips at least.
MOST_DELAY_S, ROUND_TRIPS = 0.5, 60
# So does one so many periods of device and hand without a wall, where that swings, being damped by less than this share
# of the critical; no run is longer than so many usual ones for that.
PERIODS, _DAMPED, _SLOWEST = 22, 0.3, 10.0
# Factors between which delay, device mass and the hand may be other than described, and what a device file assumes.
TOLERANCE, ASSUMED = (0.8, 1.2), (0.5, 2.0)
DELAY = "delay"
# What else is uncertain, and its key; effects such as a grip and a motor have keys that go with it.
_KEYS = {
    "device mass": "device.mass",
    "hand mass": "hand.mass",
    "hand damping": "hand.damping",
    "hand stiffness": "hand.stiffness",
    "cable stiffness": "transmission.stiffness",
}
# What is taken as described unless it is assumed, and its key.
_AS_DESCRIBED = {
    "friction": "friction.kinetic",
    "device damping": "device.damping",
    "cable damping": "transmission.damping",
    "motor damping": "transmission.motor_damping",
    "encoder": "encoder.resolution",
    "noise": "noise.deviation",
    "actuator": "actuator.saturation",
    "bandwidth": "actuator.bandwidth",
    "sampling": "clock.control_rate",
}
_STAYS = (None, "constant", "ramp", "step", "minimum-jerk")
# A search takes a regular fraction of the corners: all of so many quantities, each further one as the parity of some of
# these, so that no two go together (a fractional factorial design; Box, Hunter and Hunter 1978).
_ALL_OF = 5
_PARITIES = sorted((mask for mask in range(2**_ALL_OF) if mask.bit_count() in (3, 5)), key=int.bit_count, reverse=True)
# An attack has so many cases about.
_ATTACKS = 800
# Corners take what they are attacked by in steps of this, which has no divisor in common with how many there are.
_STRIDE = 17

Corner = tuple[tuple[str, float], ...]
# Factors between which quantities, or numbers by their dotted keys, may lie, by name.
Ranges = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Case:
    """One of the conditions under which a wall is tried.

    Attributes:
        hold: the hand's mean force as a multiple of the task's.
        corner: quantities and what each is multiplied by; empty for the loop as described.
        sway: share of the hold by which the hand sways.
        sway_Hz: how often.
        tap_m_s: speed at which device and hand meet the wall.
    """

    hold: float
    corner: Corner = ()
    sway: float = SWAY
    sway_Hz: float = SWAY_HZ
    tap_m_s: float = TAP_M_S

    @property
    def words(self) -> str:
        """The case in words: ``hold x 3, device mass -20 %``."""
        changed = [f"{name} {'+' if factor > 1.0 else '−'}{abs(factor - 1.0) * 100:.0f} %"
                   for name, factor in self.corner if factor != 1.0]  # fmt: skip
        return ", ".join([f"hold x {self.hold:.2g}", *changed])

    def scene(self, loop: Scene) -> Scene:
        """Returns the scene of this case, with a wall of 1 N/m, made of a loop of ``make_loop``."""
        scene, mean_N = scale_quantities(loop, dict(self.corner)), -self.hold * hold_N(loop)
        frequency_Hz = self.sway_Hz / slowness(loop)
        force = Sine(amplitude=self.sway * mean_N, frequency=frequency_Hz, offset=mean_N)
        return replace(
            scene,
            duration=math.ceil(slowness(loop) * LASTS_S),
            device=replace(scene.device, position=2e-4, velocity=-self.tap_m_s),
            hand=replace(scene.hand or Hand(), rest=0.0, force=force),
            wall=Wall(position=0.0, stiffness=1.0),
        )


def make_loop(scene: Scene, has_task: bool) -> Scene:
    """Returns the loop of a resolved scene, of which the cases are made: its hand's force is what the wall then bears.

    That of a task that stays, less what the hand's own spring takes; 1 N without one, or 30 % of what the actuator
    gives where that is less.
    """
    kind, most_N = value_at(scene, "hand.force.kind"), value_at(scene, "actuator.saturation")
    force_N = min(PRESS_N, OF_THE_ACTUATOR * (math.inf if most_N is None else most_N))
    hand = scene.hand or Hand()
    if has_task and scene.wall and kind in _STAYS[1:]:
        inward = -1.0 if scene.wall.occupies == "below" else 1.0
        net_N = inward * (value_at(scene, "hand.force.value") + hand.stiffness * (hand.rest - scene.wall.position))
        force_N = net_N if net_N > 0.0 else force_N
    held = replace(hand, force=Constant(value=force_N))
    return replace(with_value(scene, "run.log", "none"), title="", event=(), hand=held)


def hold_N(loop: Scene) -> float:
    """Returns the force with which the task holds the wall."""
    return value_at(loop, "hand.force.value")


def slowness(loop: Scene) -> float:
    """Returns how many times as long as usual everything takes, where the delay is long or the hand swings slowly."""
    chain = Chain.from_scene(loop)
    poles = np.linalg.eigvals(chain.rates()[:, : len(chain.states)].astype(float))
    swinging = [abs(pole) for pole in poles if pole.imag and -pole.real < _DAMPED * abs(pole)]
    period_s = 2.0 * math.pi / min(swinging) if swinging else 0.0
    times = max(ROUND_TRIPS * loop.clock.round_trip_delay, min(_SLOWEST * LASTS_S, PERIODS * period_s)) / LASTS_S
    return max(1.0, math.ceil(10.0 * times) / 10.0)


def ranges(loop: Scene, assumed: Sequence[str] = ()) -> dict[str, tuple[float, float]]:
    """Returns what is uncertain and by which factors: what a user's loop differs in, and the assumed keys.

    Only what is there and not 0; a quantity all of whose keys are assumed is none of its own.
    """
    is_late = loop.clock.round_trip_delay and "clock.round_trip_delay" not in assumed
    found = {DELAY: TOLERANCE} if is_late else {}
    for name in _KEYS:
        if any(value_at(loop, key) for key in _keys_of(name) if key not in assumed):
            found[name] = TOLERANCE
    return found | {key: ASSUMED for key in assumed if is_number(value_at(loop, key))}


def as_described(loop: Scene, of: Ranges) -> tuple[str, ...]:
    """Returns what the loop has and no case varies."""
    return tuple(name for name, key in _AS_DESCRIBED.items() if value_at(loop, key) and key not in of)


def is_number(value: object) -> bool:
    """Tells whether a value is a number that can be halved and doubled."""
    return isinstance(value, float) and value != 0.0


def corner(of: Ranges, number: int) -> Corner:
    """Returns one combination of the ends of the ranges: bit i of the number says which end of the i-th."""
    return tuple((name, ends[number >> i & 1]) for i, (name, ends) in enumerate(of.items()))


def every_case(of: Ranges, holds: Sequence[float] = HOLDS) -> tuple[Case, ...]:
    """Returns every hold in the loop as described and in every corner, or in 32 of more that are as good."""
    found: list[Corner] = [()]
    for low in range(2 ** min(len(of), _ALL_OF)):
        bits = ((low & mask).bit_count() % 2 << _ALL_OF + i for i, mask in enumerate(_PARITIES[: len(of) - _ALL_OF]))
        found.append(corner(of, low + (sum(bits) if len(of) > _ALL_OF else 0)))
    return tuple(Case(hold, some) for some in dict.fromkeys(found) for hold in holds)


def attack(of: Ranges) -> tuple[Case, ...]:
    """Returns cases that the search has not seen: other holds and sways, a hand held still, another approach.

    All of them in every corner; of more than 16 corners each has its share of them.
    """
    apart, evenly = [0.3 * 10.0 ** (i / 10.0) for i in range(11)], [0.3 + 0.27 * i for i in range(1, 10)]
    some = [Case(hold, sway_Hz=0.3) for hold in evenly]
    some += [Case(hold, sway_Hz=0.8) for hold in apart]
    some += [Case(hold, sway=0.0) for hold in (*apart, *evenly)]
    some += [Case(hold, sway=0.2, sway_Hz=0.4, tap_m_s=speed) for hold in apart[::5] for speed in _SPEEDS]
    count = 2 ** len(of)
    each = min(len(some), max(1, _ATTACKS // count))
    found = list(some)
    for place in range(0, count, max(1, count // _ATTACKS)):
        shares = (some[(place * each + i) * _STRIDE % len(some)] for i in range(each))
        found += [replace(case, corner=corner(of, place)) for case in shares]
    return tuple(found)


def scale_quantities(scene: Scene, factors: Mapping[str, float]) -> Scene:
    """Returns the scene with these quantities, or keys, multiplied; a key goes before the quantity it belongs to.

    A delay is rounded to whole plant steps, by at least one.
    """
    for name, factor in factors.items():
        if name == DELAY:
            scene = with_value(scene, "clock.round_trip_delay", delay_s(scene, factor))
            continue
        for key in _keys_of(name):
            if (value := value_at(scene, key)) and (key == name or key not in factors):
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


def task_words(loop: Scene) -> str:
    """Returns what a wall is tried by, in one phrase."""
    return (
        f"a tap at {TAP_M_S:g} m/s into holds of {HOLDS[0]:g} to {HOLDS[-1]:g} times {amount(hold_N(loop), 'N')}, that "
        f"sway by {SWAY * 100:.0f} % at {SWAY_HZ / slowness(loop):.2g} Hz"
    )


def _keys_of(quantity: str) -> list[str]:
    """Returns the keys of a quantity; a key is its own."""
    if quantity not in _KEYS:
        return [quantity]
    return [_KEYS[quantity], *(e.scaled_with[quantity] for e in all_effects() if quantity in e.scaled_with)]
