"""The plant's own energy books, by exact integrals over each step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.logger.books.sums import by_tick, sum_rows
from haploop.logger.books.work import Displacement
from haploop.plant.motion.hand_force import hand_force
from haploop.plant.motion.mechanics import Mechanics
from haploop.plant.motion.transition import motion_integrals, natural_rate
from haploop.protocol.arrays import each, first_row
from haploop.protocol.ticks import Timebase

if TYPE_CHECKING:
    from haploop.logger.books.chain import ChainBooks


def plant_books(scene: dict[str, Any], time: Timebase) -> PlantBooks | ChainBooks:
    """The books of a scene's plant: one mass under held forces, or a chain of bodies.

    Their integrals are those of the exact motion from each recorded state on. Where ``clock.integrator`` is another,
    what its next state has more or less is in no book: the residual is then the energy error of the method.
    """
    bandwidth = "bandwidth" in scene.get("actuator", {})
    if bandwidth or "grip" in scene.get("hand", {}) or scene.keys() & {"friction", "transmission"}:
        if "friction" in scene and "loops" in scene:
            from haploop.logger.books.friction_batch import FrictionBooksArray

            return FrictionBooksArray(scene, time)
        from haploop.logger.books.chain import ChainBooks

        return ChainBooks(scene, time)
    return PlantBooks(scene, time)


class PlantBooks:
    """What every interval moves between the hand's muscles, the dampers, the mass and the spring.

    Over a plant step from x, v to x+, v+ with dx = x+ - x, under the held force f and tau linear in time:
        work of tau        integral tau v dt = (tau + tau+)/2 dx + (tau+ - tau) integral (t - h/2)/h v dt
        heat of damper i   b_i integral v^2 dt = b_i w' S w,  w = (v, m a, tau' h)
        actuator           (f_commanded - f) dx, what saturation and steps of force keep from the device
    all summed over the steps of an interval; and over a whole interval, in which x goes by X and v by V:
        kinetic change     m V (v + V / 2)
        spring change      k X (x - x_rest + X / 2)
    Nothing is taken from the balance, so that its residual is a proof. Forces times dx (and not times v) keep the
    books of a device at rest under load at rest too.

    Attributes:
        names: the books, in the order of the rows of ``increments``; heats end in ``_heat``.
    """

    def __init__(self, scene: dict[str, Any], time: Timebase) -> None:
        m = self.mechanics = Mechanics.of(scene)
        self._n, self._tau, step_s = time.steps_per_tick, hand_force(scene, time.plant_rate), time.step_s

        def forms(mass: float, damping: float, stiffness: float) -> tuple[np.ndarray, np.ndarray]:
            square, lag = motion_integrals(mass, damping, stiffness, step_s)
            push = 1.0 / (np.longdouble(mass) * natural_rate(mass, stiffness, step_s))
            scales = np.array([1.0, push, push])
            return as_squares(square * np.outer(scales, scales)).astype(float), (lag * scales).astype(float)

        self._square, self._lag = each(forms, m.mass_kg, m.damping, m.stiffness)
        if "loops" in scene:
            self._square, self._lag = self._square.reshape(6, -1), self._lag.reshape(3, -1)
        self._is_limited = "actuator" in scene
        self.names = ["hand_work", *(f"{name}_heat" for name in m.dampers), "kinetic", "spring"]
        self.names += ["actuator"] * self._is_limited

    def increments(
        self,
        first_step: int,
        columns: dict[str, np.ndarray],
        moved: Displacement,
        commanded: Iterable[np.ndarray],
        summed: Callable[[Any, int], Any] = by_tick,
    ) -> Iterator[np.ndarray]:
        """What each interval adds to each book, J; of many loops at once where the arrays have a last axis for them.

        Args:
            first_step: step of the first state.
            columns: plant telemetry of whole intervals, the end state included; shape (ticks * n + 1,) each.
            moved: displacement over these steps and intervals.
            commanded: the force of the wall and of every element over each step, shape (ticks * n,) each.
            summed: how steps are summed over their tick.

        Yields:
            Shape (ticks,) each, ordered as ``names``.
        """
        n, m, x, v, force = self._n, self.mechanics, columns["x"], columns["v"], columns["force"][:-1]
        tau = self._tau.at_steps(first_step, first_step + len(x))
        rise = tau[1:] - tau[:-1]
        net = force + tau[:-1] - m.damping * v[:-1] - m.stiffness * (x[:-1] - m.rest_m)
        rates = [v[:-1], net, rise] if self._rises(rise) else [v[:-1], net]
        yield summed(self._hand_work(tau, rise, moved.by_step, rates), n)
        square = summed(sum_squares(self._square, rates), n)
        for damping in m.dampers.values():
            yield damping * square
        at_ticks, way = x[::n], moved.by_tick
        yield self._kinetic(v[::n])
        yield m.stiffness * way * (at_ticks[:-1] - m.rest_m + way * 0.5)
        if self._is_limited:
            yield summed(beyond_limits(commanded, force) * moved.by_step, n)

    def _kinetic(self, v: np.ndarray) -> np.ndarray:
        start, change = v[:-1], v[1:] - v[:-1]
        return self.mechanics.mass_kg * change * (start + change * 0.5)

    @staticmethod
    def _rises(rise: np.ndarray) -> bool:
        """Whether the force of the hand changes over any step."""
        return bool(rise.any())

    def _hand_work(self, tau: np.ndarray, rise: np.ndarray, dx: np.ndarray, rates: Sequence[np.ndarray]) -> np.ndarray:
        if len(rates) < 3:
            return tau[:-1] * dx
        of_v, of_net, of_rise = self._lag
        lagged = rise * of_v * rates[0] + rise * of_net * rates[1] + rise * of_rise * rise
        return (tau[:-1] + rise * 0.5) * dx + lagged

    def stored_J(self, columns: dict[str, np.ndarray]) -> Any:
        """Kinetic and spring energy in the first state of some telemetry."""
        return self.mechanics.kinetic_J(first_row(columns["v"])) + self.mechanics.spring_J(first_row(columns["x"]))


def beyond_limits(commanded: Iterable[np.ndarray], force: np.ndarray) -> np.ndarray:
    """What was commanded in all beyond the force that the actuator holds, N."""
    return sum_rows(commanded) - force


def as_squares(form: np.ndarray) -> np.ndarray:
    """What makes w' Q w of three entries a sum of squares a (w0 + b w1 + c w2)^2 + d (w1 + e w2)^2 + f w2^2.

    Q is positive: no term is below 0, and where they are far apart none cancels another.

    Returns:
        (a, b, c, d, e, f).
    """
    a = form[0, 0]
    b, c = form[0, 1:] / a
    d, rest = form[1, 1] - a * b * b, form[1, 2] - a * b * c
    e = rest / d if d else 0.0 * rest
    return np.array([a, b, c, d, e, form[2, 2] - a * c * c - e * rest])


def sum_squares(factors: np.ndarray, w: Sequence[np.ndarray]) -> np.ndarray:
    """The sum of ``as_squares`` at every step; an entry of w that is left out at its end is 0."""
    a, b, c, d, e, f = factors
    first, second = w[0] + b * w[1], w[1]
    if len(w) < 3:
        return a * (first * first) + d * (second * second)
    first, second = first + c * w[2], second + e * w[2]
    return a * (first * first) + d * (second * second) + f * w[2] * w[2]
