"""Virtual coupling: a virtual tool touches the wall, and a spring and damper couple it to the device."""

from typing import Annotated, Any, NamedTuple

from haploop.controller.dissipation.element import Element, Motion
from haploop.protocol.arrays import where
from haploop.protocol.quantity import Quantity


class Tool(NamedTuple):
    """State of the tool: its position, m; its velocity, m/s; x_m when it last moved, m; ticks until it moves next.

    -1 ticks: it does not exist yet, and will appear where the device is.
    """

    y: Any
    u: Any
    x: Any
    left: Any


class VirtualCoupling(Element):
    """Replaces the force f_e by -Kc (x_m - y) - Bc (dx_m / T - u), a coupling to an implicit virtual tool.

    Every N ticks the world makes a step of length S = N T. In it the tool (y1, u1 before it) moves by
    m_v (u - u1) / S = Kc (x_m - y) + Bc ((x_m - x1) / S - u) + F(y), y = y1 + S u, with x1 the x_m of the step before
    and F the wall's force on the tool, solved simultaneously; until the next step the tool rests. N = 1 is the coupling
    of Colgate, Stanley & Brown 1995 and Adams & Hannaford 1999. With every passive world of convex potential the loop
    without delay is stable if the device's b > Kc T / 2 + Bc, whatever N. Derivation for N > 1, with v[k] the mean
    velocity of a period, V that of the N periods from a step on, and V1 that before it:
        - a step, at a given x_m, does not raise the energy of coupling, tool and world through Kc and F;
        - the held force of Kc takes no less between steps than the change of Kc (x_m - y)^2 / 2 minus
          Kc T / 2 times the sum of v[k]^2 T, since y rests;
        - Bc takes Bc T sum v[k] v[k+1] - Bc S sum (u (V1 + V) - u^2), and u (V1 + V) - u^2 <= ((V1 + V) / 2)^2, so
          that at most Bc sum v[k]^2 T is missing.
    b takes at least b sum v[k]^2 T. The price of N: in free motion the resting tool drags like damping Kc (S - T) / 2.

    It is meant to act always; the forces of elements before it are left out.
    """

    kind = "virtual-coupling"
    asks = ("force", "way", "wall_position", "wall_stiffness")
    limits = True
    memory = Tool(0.0, 0.0, 0.0, -1.0)
    stiffness: Annotated[float, Quantity("N/m", at_least=0, about="Kc")]
    damping: Annotated[float, Quantity("N s/m", at_least=0, about="Bc")] = 0.0
    mass: Annotated[float, Quantity("kg", above=0, about="mass of the tool")]
    world_ticks: Annotated[int, Quantity("", at_least=1, at_most=10_000, about="N, ticks per step of the world")] = 1

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
