"""Virtual damping."""

from typing import Annotated

from haploop.controller.dissipation.element import Element, Motion
from haploop.protocol.quantity import Quantity


class Damping(Element):
    """f = -b v[k]: dissipates in slow, smooth motion; held and delayed, it generates energy at high frequency."""

    kind = "damping"
    linear = True
    damping: Annotated[float, Quantity("N s/m", at_least=0)]

    def force(self, motion: Motion):
        return -self.damping * motion.v
