"""Force bounding: never more force than the device's own damping can account for."""

from typing import Annotated, Any

from haploop.controller.dissipation.element import Element, Motion
from haploop.protocol.arrays import clipped, root, where
from haploop.protocol.quantity import Quantity


class ForceBounding(Element):
    """Limits the force f_e of the wall and of all elements before it to |f| <= sqrt(4 b E / T) (Kim & Ryu 2010).

    E[k] = E[k-1] + (b/T) (x_m[k] - x_m[k-1])^2 - f[k-1] (x_m[k] - x_m[k-1]), with the device's own damping b, or the
    ``share`` of it that is relied on. E + (b/T) dx^2 - f dx >= 0 for every displacement dx exactly if the bound holds:
    without delay, and while the element acts at every tick, E is never negative.
    """

    kind = "force-bounding"
    asks = ("force", "way", "output_before", "device_damping")
    limits = True
    memory = 0.0
    share: Annotated[float, Quantity("", above=0, at_most=1, about="share of the device's damping")] = 1.0

    def force(self, motion: Motion, memory: Any):
        damping = self.share * motion.device_damping / motion.period_s
        energy = memory + (damping * motion.way - motion.output_before) * motion.way
        bound = root(4.0 * damping * where(energy > 0.0, energy, 0.0))
        return clipped(motion.force, bound) - motion.force, energy
