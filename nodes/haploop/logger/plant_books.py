"""The plant's own energy books, by exact integrals over each step."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.logger.sums import sum_rows
from haploop.plant.flow import motion_integrals, natural_rate, real_for
from haploop.plant.hand_force import hand_force
from haploop.plant.mechanics import Mechanics
from haploop.protocol.arrays import each, first_row
from haploop.protocol.ticks import Timebase

if TYPE_CHECKING:
    from haploop.logger.chain_books import ChainBooks


def plant_books(scene: dict[str, Any], time: Timebase) -> PlantBooks | ChainBooks:
    """The books of a scene's plant: one mass under held forces, or a chain of bodies.

    Their integrals are those of the exact motion from each recorded state on. Where ``clock.integrator`` is another,
    what its next state has more or less is in no book: the residual is then the energy error of the method.
    """
    bandwidth = "bandwidth" in scene.get("actuator", {})
    if bandwidth or "grip" in scene.get("hand", {}) or scene.keys() & {"friction", "transmission"}:
        from haploop.logger.chain_books import ChainBooks

        return ChainBooks(scene, time)
    return PlantBooks(scene, time)


class PlantBooks:
    """What every plant step moves between the hand's muscles, the dampers, the mass and the spring.

    Over a step from x, v to x+, v+ with dx = x+ - x, under the held force f and tau linear in time:
        work of tau        integral tau v dt = (tau + tau+)/2 dx + (tau+ - tau) integral (t - h/2)/h v dt
        heat of damper i   b_i integral v^2 dt = b_i w' S w,  w = (v, a/c, tau' h/(m c))
        kinetic change     m (v+ - v) (v+ + v) / 2
        spring change      k dx ((x+ + x)/2 - x_rest)
        actuator           (f_commanded - f) dx, what saturation and steps of force keep from the device
    Nothing is taken from the balance, so that its residual is a proof. Forces times dx (and not times v) keep the
    books of a device at rest under load at rest too.

    Attributes:
        names: the books, in the order of the rows of ``increments``; heats end in ``_heat``.
    """

    def __init__(self, scene: dict[str, Any], time: Timebase) -> None:
        m = self.mechanics = Mechanics.of(scene)
        self._tau, step_s = hand_force(scene, time.plant_rate), time.step_s
        self._real = real_for(np.max(m.damping / m.mass_kg), step_s)
        integrals = each(motion_integrals, m.mass_kg, m.damping, m.stiffness, step_s)
        self._square, self._lag = (integral.astype(self._real) for integral in integrals)
        if "loops" in scene:
            self._square, self._lag = self._square.reshape(3, 3, -1), self._lag.reshape(3, -1)
        self._rate = each(natural_rate, m.mass_kg, m.stiffness, step_s)
        self._is_limited = "actuator" in scene
        self.names = ["hand_work", *(f"{name}_heat" for name in m.dampers), "kinetic", "spring"]
        self.names += ["actuator"] * self._is_limited

    def increments(
        self, first_step: int, columns: dict[str, np.ndarray], dx: np.ndarray, commanded: Iterable[np.ndarray]
    ) -> Iterator[np.ndarray]:
        """What each step adds to each book, J; of many loops at once where the arrays have a last axis for them.

        Args:
            first_step: step of the first state.
            columns: plant telemetry of these steps, the end state included; shape (steps + 1,) each.
            dx: displacement over each step, shape (steps,), with the digits that the difference of two x has lost.
            commanded: the force of the wall and of every element over each step, shape (steps,) each.

        Yields:
            Shape (steps,) each, ordered as ``names``.
        """
        for book in self._increments(first_step, columns, dx, commanded):
            yield book.astype(float, copy=False)

    def _increments(
        self, first_step: int, columns: dict[str, np.ndarray], dx: np.ndarray, commanded: Iterable[np.ndarray]
    ) -> Iterator[np.ndarray]:
        m, x, v, force = self.mechanics, columns["x"], columns["v"], columns["force"][:-1]
        tau = self._tau.at_steps(first_step, first_step + len(x))
        start_x, start_v, dv = x[:-1], v[:-1], v[1:] - v[:-1]
        rise = tau[1:] - tau[:-1]
        wide_v = start_v.astype(self._real, copy=False)
        stretch = start_x - m.rest_m
        net = force + tau[:-1] - m.damping * wide_v - m.stiffness * stretch
        scale = 1.0 / (m.mass_kg * self._rate)
        rates = [wide_v, net * scale, rise * scale]
        yield self._hand_work(tau, rise, dx, rates)
        square = sum_products(self._square, rates if self._rises(rise) else rates[:2])
        for damping in m.dampers.values():
            yield damping * square
        yield m.mass_kg * dv * (start_v + dv * 0.5)
        yield m.stiffness * dx * (stretch + dx * 0.5)
        if self._is_limited:
            yield beyond_limits(commanded, force) * dx

    @staticmethod
    def _rises(rise: np.ndarray) -> bool:
        """Whether the force of the hand changes over any step."""
        return bool(rise.any())

    def _hand_work(self, tau: np.ndarray, rise: np.ndarray, dx: np.ndarray, rates: Sequence[np.ndarray]) -> np.ndarray:
        if not self._rises(rise):
            return tau[:-1] * dx
        lagged = self._lag[0] * rates[0] + self._lag[1] * rates[1] + self._lag[2] * rates[2]
        return (tau[:-1] + rise / 2.0) * dx + rise * lagged

    def stored_J(self, columns: dict[str, np.ndarray]) -> Any:
        """Kinetic and spring energy in the first state of some telemetry."""
        return self.mechanics.kinetic_J(first_row(columns["v"])) + self.mechanics.spring_J(first_row(columns["x"]))


def beyond_limits(commanded: Iterable[np.ndarray], force: np.ndarray) -> np.ndarray:
    """What was commanded in all beyond the force that the actuator holds, N."""
    return sum_rows(commanded) - force


def sum_products(form: np.ndarray, w: Sequence[np.ndarray]) -> np.ndarray:
    """w' Q w at every step, term by term in a fixed order (a matrix product may reorder with its size).

    Entries of w that are left out at its end are 0.
    """
    total = form[0, 0] * w[0] * w[0]
    for i in range(len(w)):
        for j in range(max(i, 1), len(w)):
            total += (form[i, j] if i == j else 2.0 * form[i, j]) * w[i] * w[j]
    return total
