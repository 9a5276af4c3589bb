"""A damped spring that never pulls."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from haploop.protocol.arrays import where
from haploop.protocol.quantity import Quantity, si
from haploop.protocol.walls.wall import Wall


@dataclass(frozen=True, slots=True)
class KelvinVoigt(Wall):
    """f = max(0, K p + B p'): spring and damper side by side, V = K p^2 / 2.

    Sampled with a backward difference it is the wall of Colgate & Schenkel 1997, K + B (z - 1) / (T z). On the way out
    the damper would hold the device back where B |p'| > K p; there the force is 0, so that the wall never pulls.
    """

    kind: ClassVar[str] = "kelvin-voigt"
    dissipates: ClassVar[bool] = True
    keys: ClassVar[Mapping[str, Quantity]] = {"damping": si("N s/m", "damping", at_least=0)}
    damping: Any

    def push(self, depth: Any, speed: Any) -> Any:
        force = self.stiffness * depth + self.damping * speed
        return where(force > 0.0, force, 0.0)

    def held(self, depth: Any) -> Any:
        return self.stiffness * depth

    def stored(self, depth: Any) -> Any:
        return 0.5 * (self.stiffness * depth) * depth

    def stiffness_and_damping(self) -> tuple[Any, Any]:
        return self.stiffness, self.damping
