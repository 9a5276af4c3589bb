"""The energy books of one mass under held forces, by exact integrals over each plant step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from haploop.logger.books.work import Displacement, SumSteps, by_interval, sum_rows, sum_steps
from haploop.plant.motion.hand_force import constant_forces, make_hand_force
from haploop.plant.motion.one_mass import Mechanics
from haploop.plant.motion.transition import motion_integrals, natural_rate
from haploop.protocol.arrays import each, first_row
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_select

# A stand-in for ``step_energies``.
Energies = Callable[..., tuple[Any, Any]]


class OneMassParams(NamedTuple):
    """The numbers of the books of one mass; in a batch, arrays have the members as their last axis.

    Attributes:
        mechanics: mass, dampers, spring.
        square: factors of ``sum_squares`` that give integral v^2 dt over a step, shape (6,).
        lag: factors of v, m a and tau' h that give integral (t - h/2)/h v dt over a step, shape (3,).
        constant_N: constant forces that act like the hand's but have books of their own.
    """

    mechanics: Mechanics
    square: np.ndarray
    lag: np.ndarray
    constant_N: tuple[Any, ...]


class Steps(NamedTuple):
    """The beginning of every plant step, and what acts in it; shape (ticks, steps), or (ticks, steps, batch).

    Attributes:
        x, v: position in m and velocity in m/s.
        force: held, N.
        tau: force of the hand's muscles, N.
        rise: change of tau over the step, N; None where it is constant over every step.
        dx: displacement over the step, m.
    """

    x: Any
    v: Any
    force: Any
    tau: Any
    rise: Any
    dx: Any


class Ticks(NamedTuple):
    """The device at the ticks: x in m and v in m/s at each and at the end; ``dx``, displacement between them, m."""

    x: Any
    v: Any
    dx: Any


def one_mass_params(scene: Scene, time: Timebase, members: int | None = None) -> OneMassParams:
    """Returns the parameters of a resolved scene, or of a batch of ``members`` in a stacked scene."""
    m, step_s = Mechanics.from_scene(scene), time.step_s

    def forms(mass: float, damping: float, stiffness: float) -> tuple[np.ndarray, np.ndarray]:
        square, lag = motion_integrals(mass, damping, stiffness, step_s)
        push = 1.0 / (np.longdouble(mass) * natural_rate(mass, stiffness, step_s))
        scales = np.array([1.0, push, push])
        return as_squares(square * np.outer(scales, scales)).astype(float), (lag * scales).astype(float)

    square, lag = each(forms, m.mass_kg, m.damping, m.stiffness)
    if members is not None:
        square, lag = square.reshape(6, -1), lag.reshape(3, -1)
    return OneMassParams(m, square, lag, tuple(constant_forces(scene).values()))


def increments(
    params: OneMassParams,
    steps: Steps,
    ticks: Ticks,
    commanded: Iterable[Any] | None,
    summed: SumSteps,
    energies: Energies | None = None,
) -> Iterator[Any]:
    """Yields the energy every interval moves between the hand's muscles, the dampers, the mass and the spring, J.

    Over a plant step from x, v to x+, v+ with dx = x+ - x, under the held force f and tau linear in time:
        work of tau        integral tau v dt = (tau + tau+)/2 dx + (tau+ - tau) integral (t - h/2)/h v dt
        heat of damper i   b_i integral v^2 dt = b_i w' S w,  w = (v, m a, tau' h)
        actuator           (f_commanded - f) dx, what saturation and steps of force keep from the device
        constant force F   F dx, which is no part of the work of tau, though tau includes F
    all summed over the steps of an interval; and over a whole interval, in which x changes by X and v by V:
        kinetic change     m V (v + V / 2)
        spring change      k X (x - x_rest + X / 2)
    No book is derived from the balance, so that its residual is a proof. With forces times dx (and not times v), the
    books of a device at rest under load do not change either.

    Args:
        commanded: the force of the wall and of every element over each step, N; None without an actuator's limits.
        energies: does what ``step_energies`` does.

    Yields:
        Shape (ticks,), or (ticks, batch), each, ordered as ``OneMassBooks.names``.
    """
    m, works = params.mechanics, [force_N * ticks.dx for force_N in params.constant_N]
    work, square = (energies or step_energies)(params, steps, summed)
    yield work - sum(works) if works else work
    for damping in m.dampers.values():
        yield damping * square
    start, change = ticks.v[:-1], ticks.v[1:] - ticks.v[:-1]
    yield m.mass_kg * change * (start + change * 0.5)
    yield m.stiffness * ticks.dx * (ticks.x[:-1] - m.rest_m + ticks.dx * 0.5)
    if commanded is not None:
        yield summed(beyond_limits(commanded, steps.force) * steps.dx)
    yield from works


def step_energies(params: OneMassParams, steps: Steps, summed: SumSteps) -> tuple[Any, Any]:
    """Returns the work of tau in J and the integral of v^2 in m^2/s, summed over the steps of every interval."""
    m, (x, v, force, tau, rise, dx) = params.mechanics, steps
    net = net_force(m.damping, m.stiffness, m.rest_m, x, v, force, tau)
    rates = [v, net] if rise is None else [v, net, rise]
    return summed(hand_work(params.lag, tau, rise, dx, rates)), summed(sum_squares(params.square, rates))


def net_force(damping: Any, stiffness: Any, rest_m: Any, x: Any, v: Any, force: Any, tau: Any) -> Any:
    """Returns mass times acceleration, N."""
    net = force + tau
    net -= damping * v
    beyond = x - rest_m
    beyond *= stiffness
    net -= beyond
    return net


def hand_work(lag: np.ndarray, tau: Any, rise: Any, dx: Any, rates: Sequence[Any]) -> Any:
    """Returns the work of tau over a step, J; see ``increments``."""
    if rise is None:
        return tau * dx
    of_v, of_net, of_rise = lag
    lagged = rise * of_v * rates[0]
    lagged += rise * of_net * rates[1]
    lagged += rise * of_rise * rise
    work = (tau + rise * 0.5) * dx
    work += lagged
    return work


def beyond_limits(commanded: Iterable[Any], force: Any) -> Any:
    """Returns the total commanded force less the force that the actuator holds, N."""
    return sum_rows(commanded) - force


def as_squares(form: np.ndarray) -> np.ndarray:
    """Returns (a, b, c, d, e, f) of w' Q w as a sum of squares a (w0 + b w1 + c w2)^2 + d (w1 + e w2)^2 + f w2^2.

    Q is positive: no term is below 0, and terms of very different size do not cancel each other.
    """
    a = form[0, 0]
    b, c = form[0, 1:] / a
    d, rest = form[1, 1] - a * b * b, form[1, 2] - a * b * c
    e = rest / d if d else 0.0 * rest
    return np.array([a, b, c, d, e, form[2, 2] - a * c * c - e * rest])


def sum_squares(factors: np.ndarray, w: Sequence[Any]) -> Any:
    """Returns the sum of ``as_squares`` at every step; a last entry of w that is left out counts as 0."""
    a, b, c, d, e, f = factors
    first, second = b * w[1], w[1]
    first += w[0]
    if len(w) > 2:
        first += c * w[2]
        second = second + e * w[2]
    first *= first
    first *= a
    total = second * second
    total *= d
    total += first
    if len(w) > 2:
        total += f * w[2] * w[2]
    return total


class OneMassBooks:
    """The books of one mass; ``names`` are in the order in which ``increments`` yields them, heats end in ``_heat``.

    Attributes:
        energies: used in a batch in place of ``step_energies``.
    """

    energies: Energies | None = None

    def __init__(self, scene: Scene, time: Timebase, members: int | None = None) -> None:
        self.params = one_mass_params(scene, time, members)
        self._n, self._tau = time.steps_per_tick, make_hand_force(scene, time.plant_rate, members)
        self._is_limited = scene.actuator is not None
        dampers = self.params.mechanics.dampers
        self.names = ["hand_work", *(f"{name}_heat" for name in dampers), "kinetic", "spring"]
        self.names += ["actuator"] * self._is_limited + [f"{name}_work" for name in constant_forces(scene)]

    def increments(
        self, first_step: int, columns: dict[str, np.ndarray], moved: Displacement, commanded: Iterable[np.ndarray]
    ) -> Iterator[np.ndarray]:
        """Yields the energy each interval adds to each book, J.

        Args:
            columns: plant telemetry of whole intervals, the end state included; shape (ticks * n + 1,), or
                (ticks * n + 1, batch), each.
            commanded: the force of the wall and of every element over each step, shape (ticks * n,), or with a batch.

        Yields:
            Shape (ticks,), or (ticks, batch), each, ordered as ``names``.
        """
        n, x, v = self._n, columns["x"], columns["v"]
        tau = self._tau.at_steps(first_step, first_step + len(x))
        rise = tau[1:] - tau[:-1]
        starts = (by_interval(column[:-1], n) for column in (x, v, columns["force"], tau))
        steps = Steps(*starts, rise=by_interval(rise, n) if rise.any() else None, dx=moved.by_step)
        ticks = Ticks(x[::n], v[::n], moved.by_tick)
        limited = (by_interval(force, n) for force in commanded) if self._is_limited else None
        return increments(self.params, steps, ticks, limited, sum_steps, self.energies)

    def select(self, kept: np.ndarray) -> None:
        """Drops the members of a batch for which ``kept``, shape (members,), is false."""
        self.params = tree_select(self.params, kept)
        self._tau.select(kept)

    def stored_J(self, columns: dict[str, np.ndarray]) -> Any:
        """Returns kinetic and spring energy in the first state of some telemetry, J."""
        m = self.params.mechanics
        return m.kinetic_J(first_row(columns["v"])) + m.spring_J(first_row(columns["x"]))
