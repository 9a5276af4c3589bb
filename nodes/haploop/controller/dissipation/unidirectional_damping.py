"""Virtual damping that resists only motion into the wall."""

from typing import Annotated

from haploop.controller.dissipation.element import Element, Motion
from haploop.protocol.arrays import where
from haploop.protocol.quantity import Quantity


class UnidirectionalDamping(Element):
    """f = -b v[k] while v[k] points into the wall, else 0."""

    kind = "unidirectional-damping"
    damping: Annotated[float, Quantity("N s/m", at_least=0)]

    def force(self, motion: Motion):
        return where(motion.v * motion.inward > 0.0, -self.damping * motion.v, 0.0)
