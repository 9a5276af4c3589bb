"""A device held to a wall by a swaying hand, written by hand: bodies, cable, grip, dry friction, encoder, elements.

It uses nothing of the code it judges: semi-implicit Euler steps of 50 us, friction as the impulse that stops a body, a
buzz of motion or force found from turning points instead of spectra. All holds in all corners are columns of one array,
each computed by a loop that numba compiles.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

numba = pytest.importorskip("numba")

STEP_S, PERIOD_S, LASTS_S = 5e-5, 1e-3, 3.0
STEPS = round(PERIOD_S / STEP_S)


class Bodies(NamedTuple):
    """One device and hand; in ``press`` every number may be an array over the members. SI units."""

    mass: Any
    damping: Any
    friction: Any
    count: Any
    most_force: Any
    hand_mass: Any = 0.269
    hand_damping: Any = 6.43
    hand_stiffness: Any = 105.3
    grip_stiffness: Any = 552.4
    grip_damping: Any = 3.609
    motor_mass: Any = 0.0
    motor_damping: Any = 0.0
    cable_stiffness: Any = 0.0
    cable_damping: Any = 0.0
    delay_s: float = 0.0


DEVICES = {
    "premium15": Bodies(0.0525, 0.0114, 0.048, 28.7e-6, 6.9),
    "premium15_cable": Bodies(
        0.0496, 0.0, 0.048, 28.7e-6, 6.9, motor_mass=0.0029, motor_damping=0.0114, cable_stiffness=4300.0,
        cable_damping=0.2,
    ),
    "touch": Bodies(0.045, 0.01, 0.26, 55e-6, 3.3),
    "omega3": Bodies(0.2, 0.1, 0.2, 10e-6, 12.0),
    "falcon": Bodies(0.15, 0.1, 0.3, 38e-6, 8.0),
}  # fmt: skip
_SCALED = (
    ("mass", "motor_mass"),
    ("hand_mass",),
    ("hand_damping", "grip_damping"),
    ("hand_stiffness", "grip_stiffness"),
    ("friction",),
    ("damping", "motor_damping"),
    ("most_force",),
    ("cable_stiffness",),
    ("cable_damping",),
)
# With less of these, walls bear less: half of the corners taken have little of all of them.
_HOLDS = {"friction", "damping", "motor_damping", "cable_damping"}
_NUMBERS = Bodies._fields[:-1]
# What a preset assumes of its device.
ASSUMED = {
    "premium15_cable": ("motor_mass", "motor_damping", "cable_stiffness", "cable_damping"),
    "omega3": ("mass", "damping", "friction"),
    "falcon": ("mass", "damping", "friction"),
    "touch": ("damping",),
}


def in_corners(
    device: Bodies, holds: np.ndarray, assumed: tuple[str, ...] = (), most: int = 64
) -> tuple[Bodies, np.ndarray]:
    """Returns the members: every hold in the loop as described and in all its corners, and their holds.

    All measured values are a fifth off, assumed ones half or double. Where there are more corners than ``most``, that
    many are drawn, half of them with little friction and damping.
    """
    there = [
        tuple(name for name in names if name not in assumed and np.any(getattr(device, name))) for names in _SCALED
    ]
    ends = [(names, (0.8, 1.2)) for names in there if names] + [((name,), (0.5, 2.0)) for name in assumed]
    order = np.random.default_rng(2).permutation(2 ** len(ends))
    worse = sum(1 << i for i, (names, _) in enumerate(ends) if _HOLDS & set(names))
    few = order[order & worse == 0][: most // 2]
    drawn = np.concatenate([few, order[~np.isin(order, few)][: most - len(few)]])
    members = []
    for number in (-1, *drawn.tolist()):
        factors = {name: at[number >> i & 1] for i, (names, at) in enumerate(ends) for name in names}
        members += [[factors.get(name, 1.0) * getattr(device, name) if number >= 0 else getattr(device, name)
                     for name in _NUMBERS]] * len(holds)  # fmt: skip
    columns = dict(zip(_NUMBERS, np.array(members).T, strict=True))
    return Bodies(**columns, delay_s=device.delay_s), np.tile(holds, 1 + len(drawn))


def columns(of: Bodies, some: np.ndarray) -> Bodies:
    """Returns some of the members, by their places."""
    return of._replace(**{name: getattr(of, name)[some] for name in _NUMBERS})


def press(
    of: Bodies, holds: np.ndarray, stiffness: Any, elements: dict[str, Any], *, sway: Any = 0.3,
    sway_Hz: Any = 0.5, speed: Any = 0.2, lasts_s: float = LASTS_S,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Returns position at the encoder, counts and command at the ticks, each of shape (ticks, members).

    Stiffness, elements by kind, and the hand's values are single numbers, or one for each member.
    """
    members = len(holds)
    each = lambda value: np.ascontiguousarray(np.broadcast_to(np.asarray(value, float), members))  # noqa: E731
    sizes = [elements.get(kind, 0.0) for kind in ("damping", "bidirectional-inertia", "unidirectional-inertia")]
    of = Bodies(*map(each, of[:-1]), delay_s=of.delay_s)
    given = [*map(each, (holds, stiffness, *sizes, sway, sway_Hz, speed))]
    seen = np.zeros((3, members, round(lasts_s / PERIOD_S)))
    for member in range(members):
        _press_one(of, member, *(each[member] for each in given), *seen[:, member])
    xs, counts, forces = seen.swapaxes(1, 2)
    return xs, counts, forces


@numba.njit
def _press_one(
    of: Bodies, at: int, hold: float, stiffness: float, b: float, m: float, one_way_m: float, sway: float,
    sway_Hz: float, speed: float, xs: np.ndarray, counts: np.ndarray, forces: np.ndarray,
) -> None:  # fmt: skip
    """Fills in the ticks of one member; ``b``, ``m`` and ``one_way_m`` are the sizes of its elements."""
    h, has_cable, late = STEP_S, of.motor_mass[at] > 0.0, round(of.delay_s / STEP_S)
    first_mass = of.motor_mass[at] if has_cable else of.mass[at]
    most_dv = of.friction[at] * h / first_mass
    x, v = 2e-4, -speed
    y, w, xm, vm = x, v, x, v
    commands = np.zeros(len(xs) + 1)
    counted = velocity = acceleration = 0.0
    for tick in range(len(xs)):
        place = xm if has_cable else x
        count = np.rint(place / of.count[at])
        now = (count - counted) * of.count[at] / PERIOD_S if tick else 0.0
        a = (now - velocity) / PERIOD_S if tick else 0.0
        element = -b * now - m * a
        if now * acceleration >= 0.0:  # the inertia that acts one way looks at the acceleration of the tick before
            element -= one_way_m * a
        command = -stiffness * count * of.count[at] + element if count < 0 else 0.0
        counted, velocity, acceleration = count, now, a
        commands[tick + 1] = min(max(command, -of.most_force[at]), of.most_force[at])
        xs[tick], counts[tick], forces[tick] = place, count, command
        hand = -hold * (1.0 + sway * np.sin(2.0 * np.pi * sway_Hz * tick * PERIOD_S))  # slow beside a tick
        for step in range(STEPS):
            acting = (tick * STEPS + step - late) // STEPS
            u = commands[acting + 1] if acting >= 0 else 0.0
            grip = of.grip_stiffness[at] * (y - x) + of.grip_damping[at] * (w - v)
            w += h * (hand - grip - of.hand_stiffness[at] * y - of.hand_damping[at] * w) / of.hand_mass[at]
            if has_cable:
                cable = of.cable_stiffness[at] * (xm - x) + of.cable_damping[at] * (vm - v)
                v += h * (grip + cable - of.damping[at] * v) / of.mass[at]
                vm = _rubbed(vm + h * (u - cable - of.motor_damping[at] * vm) / first_mass, most_dv)
                xm += h * vm
            else:
                v = _rubbed(v + h * (grip + u - of.damping[at] * v) / first_mass, most_dv)
            x, y = x + h * v, y + h * w


@numba.njit
def _rubbed(v: float, most: float) -> float:
    return np.sign(v) * max(abs(v) - most, 0.0)


def buzzes(
    of: Bodies, x: np.ndarray, counts: np.ndarray, forces: np.ndarray, begins_s: float = 1.0, stretch_s: float = 0.2
) -> np.ndarray:
    """Tells for each member whether it goes to and fro so that it is felt, from its turning points alone.

    In a stretch with four turns of the counts or more, the third largest swing back is compared with what is felt at
    the rate of the turns: through the points 52, 17 and 0.12 um, peak to peak, at 10, 20 and 320 Hz (Israr et al.
    2006); that of the command is compared with the force that moves the bodies by as much.
    """
    size, found = round(stretch_s / PERIOD_S), np.zeros(x.shape[1], bool)
    points = np.log([10.0, 20.0, 320.0]), np.log([52e-6, 17e-6, 0.12e-6])
    for begin in range(round(begins_s / PERIOD_S), len(x) - size + 1, size // 2):
        for member in np.flatnonzero(_turns(counts[begin : begin + size]) >= 4).tolist():
            for trace, is_force in ((x, False), (forces, True)):
                swing, frequency = _to_and_fro(trace[begin : begin + size, member], stretch_s)
                felt = np.exp(np.interp(np.log(frequency), *points))
                found[member] |= swing > felt * (_stiffness(of, member, frequency) if is_force else 1.0)
    return found


def _to_and_fro(piece: np.ndarray, seconds: float) -> tuple[float, float]:
    """Returns the third largest swing back of a trace, and how many times a second it turns twice."""
    moves = piece[np.append(True, np.diff(piece) != 0.0)]
    ways = np.diff(moves)
    swings = np.abs(np.diff(moves[[0, *(1 + np.flatnonzero(ways[1:] * ways[:-1] < 0)), -1]]))
    back = np.sort(np.minimum(swings[1:], swings[:-1]))
    return float(back[-3]) if len(back) > 2 else 0.0, max(1.0, len(swings) / 2.0 / seconds)


def _stiffness(of: Bodies, member: int, frequency: float) -> float:
    """Returns the force at the encoder that moves it by a metre at a frequency, with hand and cable attached, N/m."""
    one = columns(of, np.array(member))
    s = 2j * np.pi * frequency
    grip, cable = one.grip_stiffness + one.grip_damping * s, one.cable_stiffness + one.cable_damping * s
    hand = one.hand_mass * s**2 + one.hand_damping * s + one.hand_stiffness
    tip = one.mass * s**2 + one.damping * s + grip * hand / (grip + hand)
    if not one.motor_mass:
        return abs(tip)
    return abs(one.motor_mass * s**2 + one.motor_damping * s + cable * tip / (cable + tip))


def turns(counts: np.ndarray, begins_s: float = 1.0, stretch_s: float = 0.25) -> np.ndarray:
    """Returns, for each member, the most turns of its counts in any stretch: chatter, however narrow."""
    size = round(stretch_s / PERIOD_S)
    begins = range(round(begins_s / PERIOD_S), len(counts) - size + 1, size // 2)
    return np.max([_turns(counts[begin : begin + size]) for begin in begins], axis=0)


def _turns(counts: np.ndarray) -> np.ndarray:
    found = np.zeros(counts.shape[1], int)
    for member in range(counts.shape[1]):
        steps = np.diff(counts[:, member])
        steps = steps[steps != 0]
        found[member] = np.sum(steps[1:] * steps[:-1] < 0)
    return found
