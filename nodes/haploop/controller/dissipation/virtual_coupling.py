"""Virtual coupling: the wall is touched by a virtual tool, which a spring and damper hold to the device."""

from typing import Annotated, Any, NamedTuple

from haploop.controller.dissipation.element import Element, Motion
from haploop.protocol.arrays import where
from haploop.protocol.quantity import Quantity


class Tool(NamedTuple):
    """State of the tool at the last tick: its place, m; its velocity, m/s; x_m - y, m; 1 once it is there, else 0."""

    y: Any
    u: Any
    stretch: Any
    begun: Any


class VirtualCoupling(Element):
    """Force f_e turned into -Kc w - Bc (w - w1) / T, w = x_m - y, of a coupling to an implicit virtual tool.

    The tool moves by m_v (u - u1) / T = Kc w + Bc (w - w1) / T + F(y), y = y1 + T u (y1, u1, w1: a tick before), F the
    wall's force on the tool, solved for at once (Colgate, Stanley & Brown 1995; Adams & Hannaford 1999). With every
    passive world the loop without delay is stable if the device's b > Kc T / 2 + Bc. It is meant to act always; what
    elements before it give is left out.
    """

    kind = "virtual-coupling"
    asks = ("force", "wall_position", "wall_stiffness")
    limits = True
    memory = Tool(0.0, 0.0, 0.0, 0.0)
    stiffness: Annotated[float, Quantity("N/m", at_least=0, about="Kc")]
    damping: Annotated[float, Quantity("N s/m", at_least=0, about="Bc")] = 0.0
    mass: Annotated[float, Quantity("kg", above=0, about="of the tool")]

    def force(self, motion: Motion, memory: Tool):
        period = motion.period_s
        away = motion.x - where(memory.begun > 0.0, memory.y, motion.x)
        pull = self.mass * memory.u / period + self.stiffness * away
        pull = pull + self.damping * (away - memory.stretch) / period
        resists = self.mass / period + self.stiffness * period + self.damping
        free = pull / resists
        out = motion.wall_position - (motion.x - away)
        inside = (out - period * free) * motion.inward < 0.0
        held = (pull + motion.wall_stiffness * out) / (resists + motion.wall_stiffness * period)
        u = where(inside, held, free)
        w = away - period * u
        coupling = -self.stiffness * w - self.damping * (w - memory.stretch) / period
        return coupling - motion.force, Tool(motion.x - w, u, w, 1.0 + 0.0 * u)
