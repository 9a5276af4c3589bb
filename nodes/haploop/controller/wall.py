"""The virtual wall: a spring that is there only while the device is inside it."""

from __future__ import annotations

from typing import Any

from haploop.protocol.arrays import where


class Wall:
    """f_wall = k_w (x_w - x_m) while x_m is strictly inside, else 0 (Choi et al. 2022, eq. 12).

    Args:
        table: the resolved ``[wall]`` table: position in m, stiffness in N/m, occupies "below" or "above".
    """

    def __init__(self, table: dict[str, Any]) -> None:
        self.position = table["position"]
        self.stiffness = table["stiffness"]
        self.into_wall = -1.0 if table["occupies"] == "below" else 1.0

    def meet(self, x: Any) -> tuple[Any, Any]:
        """Whether measured position x (m) is strictly inside, and the force on the device in N along +x."""
        out = self.position - x
        contact = out * self.into_wall < 0.0
        return contact, where(contact, self.stiffness * out, 0.0)


class NoWall(Wall):
    """A scene without ``[wall]``: no way in, so never in contact, and no force."""

    def __init__(self) -> None:
        super().__init__({"position": 0.0, "stiffness": 0.0, "occupies": "below"})
        self.into_wall = 0.0
