"""The registry of integrators: one line for each."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import entry_points
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from haploop.protocol.scene.scene import Scene

if TYPE_CHECKING:
    from haploop.plant.integrators.linear_rates import OneStep

# Name in ``clock.integrator`` -> module and name of its ``Integrator``, imported when it is asked for.
INTEGRATORS = {
    "exact": "haploop.plant.integrators.registry:EXACT",
    "semi-implicit-euler": "haploop.plant.integrators.one_step:SEMI_IMPLICIT_EULER",
    "euler": "haploop.plant.integrators.one_step:EULER",
    "rk4": "haploop.plant.integrators.one_step:RK4",
    "implicit-midpoint": "haploop.plant.integrators.one_step:IMPLICIT_MIDPOINT",
    "dop853": "haploop.plant.integrators.dop853:DOP853",
}
# Other packages name theirs in this group of entry points, as here.
_GROUP = "haploop.integrators"


@dataclass(frozen=True)
class Integrator:
    """A method that moves the bodies from one plant step to the next.

    Attributes:
        name: in ``clock.integrator``.
        does: what it makes every plant step, in one phrase.
        order: of its error in the plant step; None where that depends on no plant step.
        method: the formula of a one-step method; None for a motion of its own.
        evaluations: of the rates, in every plant step, or in every tick where it chooses its own steps.
        chooses_steps: whether its steps are its own, at a tolerance, whatever ``clock.plant_rate``.
        motions: "module:class" of the motion without friction and of that with it.
    """

    name: str
    does: str
    order: int | None
    method: type[OneStep] | None = None
    evaluations: int = 1
    chooses_steps: bool = False
    motions: tuple[str, str] = (
        "haploop.plant.integrators.stepwise:StepwiseMotion",
        "haploop.plant.integrators.stepwise_friction:StepwiseFrictionMotion",
    )

    @property
    def is_exact(self) -> bool:
        """Tells whether its error is near the last bits, whatever the plant step."""
        return self.order is None

    def make_motion(self, scene: Scene, *args: Any) -> Any:
        """Makes the motion of a resolved scene; nothing else is imported."""
        return resolve_name(self.motions[scene.friction is not None])(scene, *args)


_EXACT_MOTIONS = "haploop.plant.chain.motion:ChainMotion", "haploop.plant.friction.motion:FrictionMotion"
EXACT = Integrator("exact", "exact", order=None, motions=_EXACT_MOTIONS)


def integrator_names() -> tuple[str, ...]:
    """Returns the names of all integrators, those of other packages last."""
    return *INTEGRATORS, *(entry.name for entry in entry_points(group=_GROUP) if entry.name not in INTEGRATORS)


def integrator_module(name: str) -> str:
    """Returns the module an integrator is written in; raises as ``find_integrator`` does."""
    return _place(name).partition(":")[0]


def find_integrator(name: str) -> Integrator:
    """Returns the integrator of a name, KeyError for none; no other is imported."""
    return resolve_name(_place(name))


def _place(name: str) -> str:
    if name not in INTEGRATORS:
        return {entry.name: entry.value for entry in entry_points(group=_GROUP)}[name]
    return INTEGRATORS[name]
