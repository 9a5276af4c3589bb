"""A spring with ridges along the direction of penetration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from haploop.protocol.arrays import floor, where
from haploop.protocol.quantity import Quantity, si
from haploop.protocol.walls.wall import Wall


@dataclass(frozen=True, slots=True)
class Texture(Wall):
    """f = K p + a s(p / l): ridges of amplitude a, one every l, on a spring; V = K p^2 / 2 + a l S(p / l).

    With u the fractional part of p / l and w = min(u, 1 - u), s = +-16 w (1/2 - w), + in the first half of a ridge,
    and S = 4 w^2 - 16 w^3 / 3: arcs of parabolas, within 6 % of a sine; the bits of a sine would depend on the library.
    The wall stores all the energy that it takes, and pulls towards a groove where a > K p. A friction cone has no place
    here: its force acts along a surface, and one degree of freedom has only the direction into it.
    """

    kind: ClassVar[str] = "texture"
    keys: ClassVar[Mapping[str, Quantity]] = {
        "ridge_force": si("N", "a, amplitude of the ridges", at_least=0),
        "ridge_spacing": si("m", "l, from ridge to ridge", above=0),
    }
    ridge_force: Any
    ridge_spacing: Any

    def push(self, depth: Any, speed: Any) -> Any:
        nearest, rises = self._place(depth)
        arc = 16.0 * nearest * (0.5 - nearest)
        return self.stiffness * depth + self.ridge_force * where(rises, arc, -arc)

    def stored(self, depth: Any) -> Any:
        nearest, _ = self._place(depth)
        ridge = nearest * nearest * (4.0 - nearest * (16.0 / 3.0))
        return 0.5 * (self.stiffness * depth) * depth + self.ridge_force * self.ridge_spacing * ridge

    def _place(self, depth: Any) -> tuple[Any, Any]:
        """Returns the distance to the nearer end of the ridge, as a share of it, and whether the ridge begins there."""
        ridges = depth / self.ridge_spacing
        over = ridges - floor(ridges)
        rises = over < 0.5
        return where(rises, over, 1.0 - over), rises
