"""The virtual wall: a spring that is there only while the device is inside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from haploop.protocol.arrays import where
from haploop.protocol.scene.scene import Scene


@dataclass(frozen=True, slots=True)
class Wall:
    """f_wall = k_w (x_w - x_m) while x_m is strictly inside, else 0 (Choi et al. 2022, eq. 12).

    Attributes:
        position: of its surface x_w, m.
        stiffness: k_w, N/m.
        inward: direction that leads into it, +1.0 or -1.0; 0.0 where there is no wall, so that nothing is inside.
    """

    position: Any
    stiffness: Any
    inward: float

    @classmethod
    def from_scene(cls, scene: Scene) -> Wall:
        """Makes the wall of a resolved scene, which may have none."""
        if (table := scene.wall) is None:
            return cls(0.0, 0.0, 0.0)
        return cls(table.position, table.stiffness, -1.0 if table.occupies == "below" else 1.0)

    def contact(self, x: Any) -> tuple[Any, Any]:
        """Returns whether measured position x (m) is strictly inside, and the force on the device in N along +x."""
        out = self.position - x
        contact = out * self.inward < 0.0
        return contact, where(contact, self.stiffness * out, 0.0)
