"""A device held to a wall by a swaying hand, written by hand: bodies, cable, grip, dry friction, encoder, elements.

Nothing of the code it judges is used: semi-implicit Euler steps of 20 us, friction as the impulse that stops a body, a
buzz read off turning points instead of spectra. All holds in all corners are columns of one array.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

STEP_S, PERIOD_S, LASTS_S = 2e-5, 1e-3, 3.0
STEPS = round(PERIOD_S / STEP_S)


@dataclass
class Bodies:
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
)


def in_corners(device: Bodies, holds: np.ndarray, share: float = 0.2) -> tuple[Bodies, np.ndarray]:
    """Returns the members: every hold in all 16 corners and in the loop as described, and their holds."""
    signs = [(0, 0, 0, 0), *np.array(np.meshgrid(*[[-1, 1]] * 4)).reshape(4, -1).T.tolist()]
    members = {field.name: [] for field in fields(Bodies)}
    for sign in signs:
        for name, values in members.items():
            factor = next((1.0 + share * s for s, names in zip(sign, _SCALED, strict=True) if name in names), 1.0)
            values += [factor * getattr(device, name) if name != "delay_s" else device.delay_s] * len(holds)
    columns = {name: np.array(values) for name, values in members.items() if name != "delay_s"}
    return Bodies(**columns, delay_s=device.delay_s), np.tile(holds, len(signs))


def press(
    of: Bodies, holds: np.ndarray, stiffness: float, elements: dict[str, float], *, sway: float = 0.3,
    sway_Hz: float = 0.5, speed: float = 0.2,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Returns position at the encoder, counts and command at the ticks, each of shape (ticks, members)."""
    members, ticks = len(holds), round(LASTS_S / PERIOD_S)
    has_cable, h = bool(np.any(of.motor_mass)), STEP_S
    x = np.full(members, 2e-4)
    v = np.full(members, -speed)
    y, w, xm, vm = x.copy(), v.copy(), x.copy(), v.copy()
    late = round(of.delay_s / h)
    commands = [np.zeros(members)]
    counted = acceleration = velocity = None
    xs, counts, forces = np.zeros((3, ticks, members))
    first_mass = of.motor_mass if has_cable else of.mass
    for tick in range(ticks):
        at = xm if has_cable else x
        count = np.rint(at / of.count)
        before = count if counted is None else counted
        now = (count - before) * of.count / PERIOD_S
        a = (now - (now if velocity is None else velocity)) / PERIOD_S
        a_before = np.zeros(members) if acceleration is None else acceleration
        element = -elements.get("damping", 0.0) * now - elements.get("bidirectional-inertia", 0.0) * a
        element -= np.where(now * a_before >= 0.0, elements.get("unidirectional-inertia", 0.0) * a, 0.0)
        command = np.where(count < 0, -stiffness * count * of.count + element, 0.0)
        counted, velocity, acceleration = count, now, a
        commands.append(command)
        xs[tick], counts[tick], forces[tick] = at, count, command
        for step in range(STEPS):
            k = tick * STEPS + step
            acting = (k - late) // STEPS
            u = np.clip(commands[acting + 1] if acting >= 0 else commands[0], -of.most_force, of.most_force)
            hand = -holds * (1.0 + sway * np.sin(2.0 * np.pi * sway_Hz * k * h))
            grip = of.grip_stiffness * (y - x) + of.grip_damping * (w - v)
            w = w + h * (hand - grip - of.hand_stiffness * y - of.hand_damping * w) / of.hand_mass
            if has_cable:
                cable = of.cable_stiffness * (xm - x) + of.cable_damping * (vm - v)
                v = v + h * (grip + cable - of.damping * v) / of.mass
                vm = _rubbed(vm + h * (u - cable - of.motor_damping * vm) / first_mass, of.friction * h / first_mass)
                xm = xm + h * vm
            else:
                v = _rubbed(v + h * (grip + u - of.damping * v) / first_mass, of.friction * h / first_mass)
            x, y = x + h * v, y + h * w
    return xs, counts, forces


def _rubbed(v: np.ndarray, most: np.ndarray) -> np.ndarray:
    return np.sign(v) * np.maximum(np.abs(v) - most, 0.0)


def buzzes(x: np.ndarray, counts: np.ndarray, begins_s: float = 1.0, stretch_s: float = 0.2) -> np.ndarray:
    """Tells of each member whether it goes to and fro so that it is felt, by its turning points alone.

    In a stretch with four turns of the counts or more, the second largest way back is compared with what is felt at the
    rate of the turns: through the points 52, 17 and 0.12 um, peak to peak, at 10, 20 and 320 Hz (Israr et al. 2006).
    """
    size, found = round(stretch_s / PERIOD_S), np.zeros(x.shape[1], bool)
    for begin in range(round(begins_s / PERIOD_S), len(x) - size + 1, size // 2):
        for member in range(x.shape[1]):
            steps = np.diff(counts[begin : begin + size, member])
            steps = steps[steps != 0]
            if np.sum(steps[1:] * steps[:-1] < 0) < 4:
                continue
            piece = x[begin : begin + size, member]
            ways = np.diff(piece)
            turning = piece[[0, *(1 + np.flatnonzero(ways[1:] * ways[:-1] < 0)), -1]]
            swings = np.abs(np.diff(turning))
            to_and_fro = np.sort(np.minimum(swings[1:], swings[:-1]))
            frequency = max(1.0, len(swings) / 2.0 / stretch_s)
            points = np.log([10.0, 20.0, 320.0]), np.log([52e-6, 17e-6, 0.12e-6])
            found[member] |= len(to_and_fro) > 3 and to_and_fro[-3] > np.exp(np.interp(np.log(frequency), *points))
    return found


def turns(counts: np.ndarray, begins_s: float = 1.0, stretch_s: float = 0.25) -> np.ndarray:
    """Counts of each member the most turns of its counts in any stretch: chatter, however narrow."""
    size, most = round(stretch_s / PERIOD_S), np.zeros(counts.shape[1], int)
    for begin in range(round(begins_s / PERIOD_S), len(counts) - size + 1, size // 2):
        for member in range(counts.shape[1]):
            steps = np.diff(counts[begin : begin + size, member])
            steps = steps[steps != 0]
            most[member] = max(most[member], np.sum(steps[1:] * steps[:-1] < 0))
    return most
