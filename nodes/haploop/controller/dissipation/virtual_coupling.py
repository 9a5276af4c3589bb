"""Virtual coupling: the wall is touched by a virtual tool, which a spring and damper hold to the device."""

from typing import Annotated, Any, NamedTuple

from haploop.controller.dissipation.element import Element, Motion
from haploop.protocol.arrays import where
from haploop.protocol.quantity import Quantity


class Tool(NamedTuple):
    """State of the tool: its place, m; its velocity, m/s; x_m when it last moved, m; ticks until it does next.

    -1 ticks: it is not there yet, and comes where the device is.
    """

    y: Any
    u: Any
    x: Any
    left: Any


class VirtualCoupling(Element):
    """Force f_e turned into -Kc (x_m - y) - Bc (dx_m / T - u), of a coupling to an implicit virtual tool.

    Every N ticks comes a step of the world, S = N T long. In it the tool (y1, u1 before it) moves by
    m_v (u - u1) / S = Kc (x_m - y) + Bc ((x_m - x1) / S - u) + F(y), y = y1 + S u, x1 the x_m of the step before, F the
    wall's force on it, solved for at once; until the next step it rests. N = 1 is the coupling of Colgate, Stanley &
    Brown 1995 and Adams & Hannaford 1999. With every passive world of convex potential the loop without delay is stable
    if the device's b > Kc T / 2 + Bc, whatever N. Derived for N > 1, with v[k] the mean velocity of a period and V that
    of the N periods from a step on, V1 before it:
        - a step, at a given x_m, does not raise the energy of coupling, tool and world by way of Kc and F,
        - the held force of Kc takes no less between steps than the change of Kc (x_m - y)^2 / 2 less
          Kc T / 2 times the sum of v[k]^2 T, as y rests;
        - Bc takes Bc T sum v[k] v[k+1] - Bc S sum (u (V1 + V) - u^2), and u (V1 + V) - u^2 <= ((V1 + V) / 2)^2, so
          that at most Bc sum v[k]^2 T is missing.
    b takes at least b sum v[k]^2 T. The price of N: in free motion the resting tool drags like damping Kc (S - T) / 2.

    It is meant to act always; what elements before it give is left out.
    """

    kind = "virtual-coupling"
    asks = ("force", "way", "wall_position", "wall_stiffness")
    limits = True
    memory = Tool(0.0, 0.0, 0.0, -1.0)
    stiffness: Annotated[float, Quantity("N/m", at_least=0, about="Kc")]
    damping: Annotated[float, Quantity("N s/m", at_least=0, about="Bc")] = 0.0
    mass: Annotated[float, Quantity("kg", above=0, about="of the tool")]
    world_ticks: Annotated[int, Quantity("", at_least=1, at_most=10_000, about="N, ticks in a step of the world")] = 1

    def force(self, motion: Motion, memory: Tool):
        x, ticks, due = motion.x, 1.0 * self.world_ticks, memory.left < 0.5
        step = ticks * motion.period_s
        y, x_before = (where(memory.left > -0.5, known, x) for known in (memory.y, memory.x))
        pull = self.mass * memory.u / step + self.stiffness * (x - y) + self.damping * (x - x_before) / step
        resists = self.mass / step + self.stiffness * step + self.damping
        free, out = pull / resists, motion.wall_position - y
        held = (pull + motion.wall_stiffness * out) / (resists + motion.wall_stiffness * step)
        inside = (out - step * free) * motion.inward < 0.0
        u = where(due, where(inside, held, free), memory.u)
        y = where(due, y + step * u, y)
        coupling = -self.stiffness * (x - y) - self.damping * (motion.way / motion.period_s - u)
        left = where(due, ticks - 1.0, memory.left - 1.0)
        return coupling - motion.force, Tool(y, u, where(due, x, x_before), left)
