"""Stiffest walls by known formulas with this device's numbers, and as published for devices, with sources."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from haploop.plant.chain.chain import Chain
from haploop.protocol.amounts import amount
from haploop.protocol.filled import filled
from haploop.protocol.scene.scene import Scene
from haploop.tools.linear.linearity import installed_kinds, is_linear
from haploop.tools.linear.one_tick import NeverStable, OneTickMap

ABBOTT = "Abbott & Okamura 2005"


@dataclass(frozen=True)
class Formula:
    """A formula with its numbers.

    Attributes:
        formula, numbers, means: the formula in the field's symbols, this device's numbers, and what happens beyond.
        stiffness_N_m: infinite where it sets no limit.
    """

    formula: str
    numbers: str
    means: str
    source: str
    stiffness_N_m: float


def formulas(loop: Scene) -> list[Formula]:
    """Returns the formulas for a wall alone on this loop.

    Both halves of Abbott and Okamura (2005): friction has to bridge one step of the encoder's force, or the device has
    no place to rest; viscous damping has to absorb the energy that sampling generates, or friction or the hand must.
    Then the exact map of one tick of the same loop without encoder and friction, if that loop is linear.
    """
    q = loop.count_m
    friction = loop.friction.kinetic if loop.friction else 0.0
    chain, period_s = Chain.from_scene(loop), 1.0 / loop.clock.control_rate
    b = next(b for name, (body, b) in chain.grounded.items() if body == 0 and name != "hand")
    abbott = f"{ABBOTT}, for no delay" if loop.clock.round_trip_delay else ABBOTT
    found = [
        Formula("K q <= 2 f_c", f"2 x {amount(friction, 'N')} / {amount(q, 'm')}" if q else "no encoder",
                "chatters between two counts", abbott, 2.0 * friction / q if q else math.inf),
        Formula("K <= 2 b / T", filled("2 x {:.3g} N s/m / {}", b, amount(period_s, "s")),
                "generates energy; friction or hand must absorb it", abbott, 2.0 * b / period_s),
    ]  # fmt: skip
    smooth = replace(loop, encoder=None, friction=None, noise=None, actuator=None, dissipation=())
    kinds = installed_kinds()
    if is_linear(smooth, kinds):
        try:
            limit = OneTickMap.from_scene(smooth, kinds).stiffness_limit()
        except NeverStable:
            limit = 0.0
        found.append(Formula("rho(M) = 1", "exact map of a tick, no element", "grows, encoder and friction aside",
                             "this loop, linear", limit))  # fmt: skip
    return found


@dataclass(frozen=True)
class Published:
    """A stiffness in N/m that has been stated or shown, by whom, and what it is.

    Attributes:
        by: who, in a word or two.
        source: the source in full.
    """

    stiffness_N_m: float
    by: str
    source: str


def _driver(stiffness_N_m: float, of: str = "the device") -> Published:
    return Published(stiffness_N_m, "CHAI3D", f"the largest stiffness that CHAI3D's driver states for {of}")


_PREMIUM = (
    _driver(800.0),
    Published(3500.0, "its maker", "SensAble, data sheet of the PHANToM Premium 1.5"),
    Published(6300.0, "Choi et al. 2022", "shown with damping and unidirectional inertia together"),
    Published(10_000.0, "Singh et al. 2019", "shown with successive force augmentation (Singh, Janetzko, Jafari, "
              "Weber, Lee, Ryu, IEEE Trans. Industrial Electronics)"),
)  # fmt: skip
PUBLISHED: dict[str, tuple[Published, ...]] = {
    "premium15": _PREMIUM,
    "premium15_cable": _PREMIUM,
    "touch": (_driver(400.0), _driver(700.0, "the Omni, its predecessor")),
    "omega3": (_driver(5000.0),),
    "falcon": (_driver(3000.0),),
}
