"""Virtual inertia that vanishes before it gives its energy back."""

from typing import Annotated

from haploop.controller.dissipation.element import Element, Motion
from haploop.protocol.arrays import where
from haploop.protocol.quantity import Quantity


class UnidirectionalInertia(Element):
    """f = -m a[k] if v[k] a[k-1] >= 0, else 0 (Choi et al. 2022, eq. 9 and Algorithm 1; a[-1] = 0)."""

    kind = "unidirectional-inertia"
    mass: Annotated[float, Quantity("kg", at_least=0)]

    def force(self, motion: Motion):
        return where(motion.v * motion.a_before >= 0.0, -self.mass * motion.a, 0.0)
