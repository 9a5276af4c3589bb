"""Adaptive unidirectional inertia: takes what the damper of a passivity controller may not take."""

from typing import Annotated

from haploop.controller.dissipation.element import Element, Motion
from haploop.controller.dissipation.passivity import taken_by_damper
from haploop.protocol.arrays import clipped, where
from haploop.protocol.quantity import Quantity


class AdaptiveInertia(Element):
    """f = -alpha v - m_a a: damping takes the missing energy -W up to its limit, inertia the rest.

    W and alpha are those of the passivity controller (Hannaford & Ryu 2002). The rest R = W + alpha T v^2 < 0 asks for
    m_a = -R / (T |a v|), at most ``mass``, behind the gate of unidirectional inertia, v[k] a[k-1] >= 0 (Choi et al.
    2022, eq. 9). The source announces inertia in time-domain passivity as future work; the form here is ours.
    """

    kind = "adaptive-inertia"
    asks = ("way", "output_energy")
    mass: Annotated[float, Quantity("kg", at_least=0, about="largest inertia")]
    damping: Annotated[float, Quantity("N s/m", at_least=0, about="largest damping")] = 0.0

    def force(self, motion: Motion):
        energy, way = motion.output_energy, motion.way
        damper = taken_by_damper(energy, self.damping, motion)
        rest = energy - damper * way
        gated = (way != 0.0) & (rest < 0.0) & (motion.v * motion.a_before >= 0.0)
        wanted = rest / where(gated, abs(way), 1.0)
        inertia = -clipped(wanted, self.mass * abs(motion.a))
        return damper - where(gated, where(motion.a < 0.0, -inertia, inertia), 0.0)
