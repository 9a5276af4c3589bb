"""Adaptive damping: a passivity observer, and the damper that takes the energy which it finds missing."""

from typing import Annotated, Any

from haploop.controller.dissipation.element import Element, Motion
from haploop.protocol.arrays import clipped, where
from haploop.protocol.quantity import Quantity


def taken_by_damper(energy: Any, damping: Any, motion: Motion) -> Any:
    """Returns the force -alpha v, with alpha = -W / (T v^2) at most ``damping`` where the energy W < 0, else 0.

    T v is the displacement since the last sample, which is not 0 where the damper acts; so -alpha v = W / (T v).
    """
    moves = motion.way != 0.0
    wanted = where(energy < 0.0, energy, 0.0) / where(moves, motion.way, 1.0)
    return where(moves, clipped(wanted, damping * abs(motion.way) / motion.period_s), 0.0)


class PassivityController(Element):
    """f = -alpha v, alpha = -W / (T v^2), at most its damping, where W < 0 and v != 0; else 0 (Hannaford & Ryu 2002).

    W[k] = W[k-1] - f_out[k-1] (x_m[k] - x_m[k-1]), where f_out is the force of the wall, of all elements before it in
    the list and its own; v = (x_m[k] - x_m[k-1]) / T. The source books f[k] v[k]; the form here is the work of a held
    force. By the next sample the damper takes -W v[k+1] / v[k]: all that is missing if the speed has not fallen, less
    if it has; if the device has turned round, the damper gives energy.
    """

    kind = "passivity-controller"
    asks = ("way", "output_energy")
    damping: Annotated[float, Quantity("N s/m", at_least=0, about="largest damping")]

    def force(self, motion: Motion):
        return taken_by_damper(motion.output_energy, self.damping, motion)


class PassivityControllerReset(Element):
    """A passivity controller that books every contact separately: W = 0 at the last tick before it.

    Thus what earlier contacts took is no credit for this one, and what they still owe is dropped.
    """

    kind = "passivity-controller-reset"
    asks = ("way", "output_energy")
    memory = 0.0
    damping: Annotated[float, Quantity("N s/m", at_least=0, about="largest damping")]

    def force(self, motion: Motion, memory: Any):
        before_contact = where(motion.contact, memory, motion.output_energy)
        return taken_by_damper(motion.output_energy - before_contact, self.damping, motion), before_contact


class PassivityControllerReference(Element):
    """A passivity controller that keeps W above V(p), what the wall's potential holds at the penetration p.

    After Ryu, Preusche, Hannaford & Hirzinger 2005 (reference energy following): it acts as soon as the sampled wall
    takes less energy than an ideal one stores, K p^2 / 2 for a spring, also on the way in.
    """

    kind = "passivity-controller-reference"
    asks = ("way", "output_energy", "wall_stored")
    damping: Annotated[float, Quantity("N s/m", at_least=0, about="largest damping")]

    def force(self, motion: Motion):
        return taken_by_damper(motion.output_energy - motion.wall_stored, self.damping, motion)
