"""A wall of Hunt and Crossley: a power of the penetration, with damping that grows with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from haploop.protocol.arrays import root, where
from haploop.protocol.quantity import Quantity, si
from haploop.protocol.walls.wall import Wall


@dataclass(frozen=True, slots=True)
class HuntCrossley(Wall):
    """f = k p^n (1 + d p'), never below 0 (Hunt & Crossley 1975); V = k p^(n+1) / (n + 1).

    It is parametrised by the stiffness K that the wall shows at rest at a reference depth p_r: k = K p_r^(1-n), so
    that K is in N/m for any n. Left to itself the law gives
        v_in / d - ln(1 + d v_in) / d^2 = -v_out / d - ln(1 - d v_out) / d^2
    for the speeds at which a free mass arrives and leaves, whatever the mass, K and n. Where the mass leaves faster
    than 1 / d the force is 0: the wall never pulls.
    """

    kind: ClassVar[str] = "hunt-crossley"
    dissipates: ClassVar[bool] = True
    keys: ClassVar[Mapping[str, Quantity]] = {
        "damping_factor": si("s/m", "d, damping as a share of the force per speed", at_least=0, at_most=1e6),
        "exponent": si("", "n, in quarters", at_least=1, at_most=3.75, step=0.25),
        "depth": si("m", "p_r, at which the stiffness is that of the wall at rest", above=0),
    }
    damping_factor: Any
    exponent: Any = 1.5
    depth: Any = 1e-3

    def push(self, depth: Any, speed: Any) -> Any:
        force = self.held(depth) * (1.0 + self.damping_factor * speed)
        return where(force > 0.0, force, 0.0)

    def held(self, depth: Any) -> Any:
        return self.stiffness * self.depth * power(depth / self.depth, self.exponent)

    def stored(self, depth: Any) -> Any:
        return self.held(depth) * depth / (self.exponent + 1.0)


def power(base: Any, exponent: Any) -> Any:
    """Returns base^exponent for a base >= 0, by roots and products: the same bits for floats and arrays.

    ``exponent`` is a multiple of 1/4 from 0 up to 3.75. The power function of a library rounds differently for arrays.
    """
    half = root(base)
    result, left = 0.0 * base + 1.0, 0.0 * base + exponent
    for share, factor in ((2.0, base * base), (1.0, base), (0.5, half), (0.25, root(half))):
        has = left >= share
        result = result * where(has, factor, 1.0)
        left = left - where(has, share, 0.0)
    return result
