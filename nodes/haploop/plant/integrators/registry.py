"""The registry of integrators: one entry for each."""

from __future__ import annotations

from dataclasses import dataclass
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from haploop.protocol.scene.scene import Scene

if TYPE_CHECKING:
    from haploop.plant.integrators.linear_rates import OneStep

# Other packages name their integrators in this group of entry points.
_GROUP = "haploop.integrators"


@dataclass(frozen=True)
class Integrator:
    """A method that moves the bodies from one plant step to the next.

    Attributes:
        name: its value in ``clock.integrator``.
        does: what every plant step is with it, in one phrase.
        order: order of its error in the plant step; None if the error does not depend on the plant step.
        method: the formula of a one-step method, or its "module:class"; None for one with its own motion.
        evaluations: evaluations of the rates per plant step, or per tick if it chooses its own steps.
        chooses_steps: whether it chooses its own steps, at a tolerance, whatever ``clock.plant_rate``.
        motions: "module:class" of the motion without friction and of that with it.
    """

    name: str
    does: str
    order: int | None
    method: str | type[OneStep] | None = None
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

    def one_step(self) -> type[OneStep] | None:
        """Returns the formula of a one-step method; None for an integrator with its own motion."""
        return resolve_name(self.method) if isinstance(self.method, str) else self.method

    def make_motion(self, scene: Scene, *args: Any) -> Any:
        """Makes the motion of a resolved scene; no other is imported."""
        return resolve_name(self.motions[scene.friction is not None])(scene, *args)


_HERE = "haploop.plant.integrators"
# These entries import no motion: checking a scene or listing the integrators needs none.
_BUILT_IN = (
    Integrator(
        "exact",
        "exact",
        order=None,
        motions=("haploop.plant.chain.motion:LoneChainMotion", "haploop.plant.friction.motion:FrictionMotion"),
    ),
    Integrator(
        "semi-implicit-euler",
        "one of the semi-implicit Euler method, order 1",
        order=1,
        method=f"{_HERE}.one_step:SemiImplicitEuler",
    ),
    Integrator("euler", "one of the explicit Euler method, order 1", order=1, method=f"{_HERE}.one_step:Euler"),
    Integrator(
        "rk4",
        "one of the classical Runge-Kutta method, order 4",
        order=4,
        method=f"{_HERE}.one_step:RungeKutta4",
        evaluations=4,
    ),
    Integrator(
        "implicit-midpoint",
        "one of the implicit midpoint rule, order 2",
        order=2,
        method=f"{_HERE}.one_step:ImplicitMidpoint",
    ),
    Integrator(
        "dop853",
        "made of DOP853's own steps, order 8, from event to event",
        order=None,
        evaluations=12,
        chooses_steps=True,
        motions=(f"{_HERE}.dop853:Dop853Motion", f"{_HERE}.dop853_friction:Dop853FrictionMotion"),
    ),
)
INTEGRATORS = {integrator.name: integrator for integrator in _BUILT_IN}


def integrator_names() -> tuple[str, ...]:
    """Returns the names of all integrators, those of other packages last."""
    return *INTEGRATORS, *(name for name in _places() if name not in INTEGRATORS)


def integrator_module(name: str) -> str:
    """Returns the module an integrator is written in; raises as ``find_integrator`` does."""
    if name not in INTEGRATORS:
        return _places()[name].partition(":")[0]
    integrator = INTEGRATORS[name]
    return str(integrator.method or integrator.motions[0]).partition(":")[0]


def find_integrator(name: str) -> Integrator:
    """Returns the integrator with this name, importing no other package's; raises KeyError if there is none."""
    return INTEGRATORS[name] if name in INTEGRATORS else resolve_name(_places()[name])


def _places() -> dict[str, str]:
    """Returns module and name of the integrators of other packages; using none of them needs no search."""
    from haploop.protocol.installed import entry_points_of

    return {entry.name: entry.value for entry in entry_points_of(_GROUP)}
