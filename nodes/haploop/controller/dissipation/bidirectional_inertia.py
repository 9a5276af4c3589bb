"""Virtual inertia."""

from typing import Annotated

from haploop.controller.dissipation.element import Element, Motion
from haploop.protocol.quantity import Quantity


class BidirectionalInertia(Element):
    """f = -m a[k]: stores and returns kinetic energy, and dissipates by its delay (Choi et al. 2022, eq. 6-8)."""

    kind = "bidirectional-inertia"
    linear = True
    mass: Annotated[float, Quantity("kg", at_least=0)]

    def force(self, motion: Motion):
        return -self.mass * motion.a
