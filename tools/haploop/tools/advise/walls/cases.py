"""The cases a wall has to bear: how hard the hand holds it and sways, and loops that are not quite as described."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from haploop.launch.plan.meant.hand_and_wall import inward
from haploop.plant.chain.chain import Chain
from haploop.protocol.amounts import amount
from haploop.protocol.scene.hand_force import Constant, Sine, constant_from_s
from haploop.protocol.scene.paths import value_at, with_value
from haploop.protocol.scene.scene import Hand, Scene, Wall
from haploop.tools.advise.walls.corners import Corner, Ranges, corner_words, design, drawn, scale_quantities

# The device meets the wall at this speed, a firm tap; in an attack also at those of a slow press and of the fastest tap
# measured.
TAP_M_S = 0.2
_SPEEDS = (1e-3, 0.24)
# The hand presses with this force, or with this share of the actuator's largest force if that is less: three times
# that, with sway, is within reach of an actuator that is a fifth weaker. No wall holds a hand that presses harder.
PRESS_N, OF_THE_ACTUATOR = 1.0, 0.2
# Holds as multiples of the task's, and those that are tried first.
HOLDS = (0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0)
FIRST_HOLDS = (0.3, 1.0, 3.0)
# The hand sways by this share of its hold, at this frequency, and a run lasts this long.
SWAY, SWAY_HZ, LASTS_S = 0.3, 0.5, 2.75
# With a longer delay than this there is no answer in a reasonable time; a run lasts at least this many round trips.
MOST_DELAY_S, ROUND_TRIPS = 0.5, 60
# A run also lasts at least this many periods of device and hand without a wall, if they swing, damped by less than this
# share of critical damping; that makes no run longer than this many usual ones.
PERIODS, _DAMPED, _SLOWEST = 22, 0.3, 10.0
# An attack tries all its cases in this many of the hardest corners, about this many cases in other corners, and this
# many points within.
_WHOLE, _CORNERS, _POINTS = 6, 280, 160
# Those take the cases of the attack in steps of this, which has no divisor in common with their number.
_STRIDE = 17


@dataclass(frozen=True)
class Case:
    """One of the conditions under which a wall is tried.

    Attributes:
        hold: the hand's mean force as a multiple of the task's.
        corner: quantities and what each is multiplied by; empty for the loop as described.
        sway: share of the hold by which the hand sways.
        sway_Hz: frequency of the sway.
        tap_m_s: speed at which device and hand meet the wall.
    """

    hold: float
    corner: Corner = ()
    sway: float = SWAY
    sway_Hz: float = SWAY_HZ
    tap_m_s: float = TAP_M_S

    @property
    def words(self) -> str:
        """The case in words: ``hold x 3, doubled: cable stiffness; 20 % less: friction, device mass``."""
        return ", ".join([f"hold x {self.hold:.2g}", *([told] if (told := corner_words(self.corner)) else [])])

    def scene(self, loop: Scene, slow: float | None = None) -> Scene:
        """Returns the scene of this case, with a wall of 1 N/m, from a loop made by ``make_loop``.

        ``slow`` is the loop's slowness, if it is known.
        """
        scene, mean_N = scale_quantities(loop, dict(self.corner)), -self.hold * hold_N(loop)
        slow = slow or slowness(loop)
        frequency_Hz = self.sway_Hz / slow
        force = Sine(amplitude=self.sway * mean_N, frequency=frequency_Hz, offset=mean_N)
        return replace(
            scene,
            duration=math.ceil(slow * LASTS_S),
            device=replace(scene.device, position=2e-4, velocity=-self.tap_m_s),
            hand=replace(scene.hand or Hand(), rest=0.0, force=force),
            wall=Wall(position=0.0, stiffness=1.0),
        )


def make_loop(scene: Scene, has_task: bool, share: float = OF_THE_ACTUATOR) -> Scene:
    """Returns the loop of a resolved scene from which the cases are made: its hand's force is what the wall then bears.

    It is the lasting force of the scene's task, less what the hand's own spring takes; without one 1 N, or a share of
    the actuator's largest force if that is less.
    """
    most_N = value_at(scene, "actuator.saturation")
    force_N = min(PRESS_N, share * (math.inf if most_N is None else most_N))
    hand = scene.hand or Hand()
    if has_task and scene.wall and hand.force and math.isfinite(lasts_from_s := constant_from_s(hand.force)):
        [lasting_N] = hand.force.force_at(np.array([lasts_from_s])).tolist()
        net_N = inward(scene.wall) * (lasting_N + hand.stiffness * (hand.rest - scene.wall.position))
        force_N = net_N if net_N > 0.0 else force_N
    held = replace(hand, force=Constant(value=force_N))
    return replace(with_value(scene, "run.log", "none"), title="", event=(), hand=held)


def hold_N(loop: Scene) -> float:
    """Returns the force with which the task holds the wall."""
    return value_at(loop, "hand.force.value")


def is_ideal(loop: Scene) -> bool:
    """Tells whether nothing of the device lags: no cable, no bandwidth of the actuator, no delay."""
    lags = loop.transmission or (loop.actuator and loop.actuator.bandwidth is not None)
    return not lags and not loop.clock.round_trip_delay


def slowness(loop: Scene) -> float:
    """Returns how many times as long as usual everything takes if the delay is long or the hand swings slowly."""
    swinging = [abs(pole) for pole in Chain.from_scene(loop).poles() if pole.imag and -pole.real < _DAMPED * abs(pole)]
    period_s = 2.0 * math.pi / min(swinging) if swinging else 0.0
    times = max(ROUND_TRIPS * loop.clock.round_trip_delay, min(_SLOWEST * LASTS_S, PERIODS * period_s)) / LASTS_S
    return max(1.0, math.ceil(10.0 * times) / 10.0)


def every_case(of: Ranges, holds: Sequence[float] = HOLDS, hardest: Sequence[Corner] = ()) -> tuple[Case, ...]:
    """Returns every hold in the loop as described, in the corners of the design and in those known to be hardest."""
    return tuple(Case(hold, some) for some in dict.fromkeys((*design(of), *hardest)) for hold in holds)


def attack(of: Ranges, hardest: Sequence[Corner] = ()) -> tuple[Case, ...]:
    """Returns cases that the search has not seen: other holds and sways, a hand held still, another approach.

    All of them in the loop as described and in the hardest corners; other corners, and points within, get a share each.
    """
    apart, evenly = [0.3 * 10.0 ** (i / 10.0) for i in range(11)], [0.3 + 0.27 * i for i in range(1, 10)]
    some = [Case(hold, sway_Hz=0.3) for hold in evenly]
    some += [Case(hold, sway_Hz=0.8) for hold in apart]
    some += [Case(hold, sway=0.0) for hold in (*apart, *evenly)]
    some += [Case(hold, sway=0.2, sway_Hz=0.4, tap_m_s=speed) for hold in apart[::5] for speed in _SPEEDS]
    whole = [replace(case, corner=at) for at in hardest[:_WHOLE] for case in some]
    others = [*hardest[_WHOLE:], *drawn(of, _CORNERS, _POINTS)]
    corners = len(others) - _POINTS
    each = max(1, _CORNERS // corners)
    found = [*some, *whole]
    for place, at in enumerate(others):
        share = each if place < corners else 1
        found += [replace(some[(place * each + i) * _STRIDE % len(some)], corner=at) for i in range(share)]
    return tuple(dict.fromkeys(found))


def task_words(loop: Scene) -> str:
    """Returns what a wall is tried by, in one phrase."""
    return (
        f"a tap at {TAP_M_S:g} m/s into holds of {HOLDS[0]:g} to {HOLDS[-1]:g} times {amount(hold_N(loop), 'N')} that "
        f"sway by {SWAY * 100:.0f} % at {SWAY_HZ / slowness(loop):.2g} Hz"
    )
