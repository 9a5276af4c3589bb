"""Conditions drawn from a seed: holds, sways, taps, and a device and hand that are not quite as described."""

from __future__ import annotations

import numpy as np

from haploop.protocol.amounts import amount
from haploop.protocol.scene.scene import Scene
from haploop.tools.advise.walls.cases import HOLDS, SWAY, Case, hold_N, slowness
from haploop.tools.advise.walls.corners import DELAY, Ranges

# The hand presses with 1 N, or with this share of the actuator's largest force if that is less: more than in an advice,
# since no actuator is weaker here than described.
COMPARED_WITH = 0.3
# Frequency of the hand's sway, Hz, and speed of its tap, m/s, at least and at most.
_SWAY_HZ, _TAP_M_S = (0.3, 0.8), (0.02, 0.24)
# What is not quite as described; friction, damping and actuator are the same for every element.
_OFF = (DELAY, "device mass", "hand mass", "hand damping", "hand stiffness", "cable stiffness")


def draw(of: Ranges, block: int, seed: int, count: int) -> tuple[Case, ...]:
    """Returns ``count`` cases: one hold in each part of the range of holds, all else anywhere between its ends.

    A delay is at either end, since loops with the same delay run side by side.

    Args:
        block: a block of seeds; two blocks share no case.
    """
    random = np.random.default_rng([block, seed])
    low, high = HOLDS[0], HOLDS[-1]
    cases = []
    for part in range(count):
        hold = low * (high / low) ** ((part + random.random()) / count)
        corner = tuple((name, _factor(random, name, ends)) for name, ends in of.items() if name in _OFF)
        sway, sway_Hz, tap_m_s = random.uniform(0.0, SWAY), random.uniform(*_SWAY_HZ), random.uniform(*_TAP_M_S)
        cases.append(Case(float(hold), corner, float(sway), float(sway_Hz), float(tap_m_s)))
    return tuple(cases)


def _factor(random: np.random.Generator, name: str, ends: tuple[float, float]) -> float:
    return ends[int(random.integers(2))] if name == DELAY else float(random.uniform(*ends))


def task_words(loop: Scene) -> str:
    """Returns what the conditions are drawn from, in one phrase."""
    sways = " to ".join(f"{often / slowness(loop):.2g}" for often in _SWAY_HZ)
    return (
        f"taps at {_TAP_M_S[0]:g} to {_TAP_M_S[1]:g} m/s into holds of {HOLDS[0]:g} to {HOLDS[-1]:g} times "
        f"{amount(hold_N(loop), 'N')} that sway by 0 to {SWAY * 100:.0f} % at {sways} Hz, with device, hand and delay "
        "up to 20 % off"
    )
