"""A package as others would write it: an effect, an estimator, an integrator and a wall by entry points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from haploop.controller.estimators.base import Estimator, Sample
from haploop.launch.plan.effect import Draft, Effect
from haploop.plant.integrators.linear_rates import LinearRates, Rows, moved
from haploop.plant.integrators.registry import Integrator
from haploop.protocol.quantity import Quantity, si
from haploop.protocol.scene.scene import Scene
from haploop.protocol.scene.table import Table
from haploop.protocol.walls.wall import Wall


class Gravity(Table):
    """The device is held with its axis upright."""

    acceleration: Annotated[float, si("m/s^2", "acceleration of free fall", above=0)] = 9.81


def weight_N(scene: Scene) -> float:
    """Returns the weight of the device."""
    return -scene.device.mass * scene.others["gravity"]["acceleration"]


def check_gravity(draft: Draft) -> None:
    """Refuses a grip, beyond which the hand's mass is the last body."""
    if "gravity" in draft.data and "grip" in draft.data.get("hand", {}):
        draft.complain(("gravity",), "It pulls on the device, so hand.grip must be left out.", "pulls on the hand")


GRAVITY = Effect(
    "gravity",
    "plant",
    ("haploop_outside",),
    "motion",
    "gravity pulls the device down",
    table=Gravity,
    check=check_gravity,
)


@dataclass(frozen=True)
class AlphaBeta(Estimator):
    """The alpha-beta filter (Bar-Shalom, Li, Kirubarajan 2001, section 6.5). Memory: x in m and v in m/s predicted."""

    name: ClassVar[str] = "alpha-beta"
    does: ClassVar[str] = "that of an alpha-beta filter"
    tables: ClassVar[tuple[str, ...]] = ("velocity",)
    needs: ClassVar[tuple[str, ...]] = ("alpha", "beta")
    keys: ClassVar[Mapping[str, Quantity]] = {
        "alpha": si("", "gain of the position", above=0, at_most=1),
        "beta": si("", "gain of the velocity", above=0, at_most=2),
    }
    alpha: Any
    beta: Any
    period_s: float

    @classmethod
    def from_scene(cls, scene: Scene, of: str, period_s: float) -> AlphaBeta:
        own = scene.estimate(of).others
        return cls(own["alpha"], own["beta"], period_s)

    def start(self, u: Any, sample: Sample) -> Any:
        return u, 0.0 * u

    def step(self, memory: Any, u: Any, sample: Sample) -> tuple[Any, Any]:
        x, v = memory
        surprise = u - x
        v = v + self.beta / self.period_s * surprise
        return (x + self.alpha * surprise + v * self.period_s, v), v


class Kutta38:
    """The 3/8 rule, order 4 (Kutta 1901)."""

    def __init__(self, rates: LinearRates, step_s: float) -> None:
        self._rates, self._h = rates, step_s

    def step(self, z: Rows, begin: Rows, middle: Rows, end: Rows) -> Rows:
        rates, h = self._rates, self._h
        # The push is linear over a step.
        first, second = ([a + (b - a) * part for a, b in zip(begin, end, strict=True)] for part in (1 / 3, 2 / 3))
        k1 = rates.at(z, begin)
        k2 = rates.at(moved(z, h / 3.0, k1), first)
        k3 = rates.at([a + h * (b - c / 3.0) for a, b, c in zip(z, k2, k1, strict=True)], second)
        k4 = rates.at([a + h * (b - c + d) for a, b, c, d in zip(z, k1, k2, k3, strict=True)], end)
        mean = [(a + 3.0 * (b + c) + d) / 8.0 for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
        return moved(z, h, mean)


KUTTA_3_8 = Integrator("kutta-3-8", "one of Kutta's 3/8 rule, order 4", 4, Kutta38, evaluations=4)


@dataclass(frozen=True, slots=True)
class Bumper(Wall):
    """f = K p (1 + (p / h)^2): a spring that hardens; V = K p^2 / 2 + K p^4 / (4 h^2)."""

    kind: ClassVar[str] = "bumper"
    keys: ClassVar[Mapping[str, Quantity]] = {"hardens_at": si("m", "h, where it is twice as stiff a spring", above=0)}
    hardens_at: Any

    def push(self, depth: Any, speed: Any) -> Any:
        share = depth / self.hardens_at
        return self.stiffness * depth * (1.0 + share * share)

    def stored(self, depth: Any) -> Any:
        share = depth / self.hardens_at
        return 0.5 * self.stiffness * depth * depth * (1.0 + 0.5 * share * share)
