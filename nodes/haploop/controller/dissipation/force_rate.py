"""The input-to-state stable approach: a force that leads by its own rate."""

from typing import Annotated, Any

from haploop.controller.dissipation.element import Element, Motion
from haploop.protocol.quantity import Quantity


class ForceRate(Element):
    """f = tau (f_e[k] - f_e[k-1]) / T, with f_e the force of the wall and of all elements before it; f_e[-1] = 0.

    The input-to-state stable approach (Jafari, Nabeel & Ryu 2015, 2017) commands f_e + f. With a spring K that is
    never left, and a free mass m, the loop without delay is stable exactly if K T^2 / m < (4 t - 2) / (t (1 + 2 t)),
    with t = tau / T > 1/2. If the element acts always, it pulls towards the wall for one tick when the wall is left.
    """

    kind = "force-rate"
    asks = ("force",)
    limits = True
    memory = 0.0
    time: Annotated[float, Quantity("s", at_least=0, about="tau")]

    def force(self, motion: Motion, memory: Any):
        return self.time * (motion.force - memory) / motion.period_s, motion.force
