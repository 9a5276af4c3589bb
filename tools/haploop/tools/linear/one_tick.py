"""The linear loop as one matrix: what a whole tick does to the plant, the controller's memory and the commands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import eigvals, matrix_balance

from haploop.plant.chain.chain import Chain, sensor_body
from haploop.plant.chain.transition import ChainTransition
from haploop.protocol.scene.effects import Accelerometer
from haploop.protocol.scene.scene import Scene, accelerometer_is_used
from haploop.protocol.ticks import Timebase
from haploop.tools.linear.linearity import Kinds, LinearController, installed_kinds, why_not_linear, with_spring
from haploop.tools.search.bisect import bisect

# No wall is softer than the first, and none stiffer than the second is considered.
_LEAST_N_M, _MOST_N_M = 1e-3, 1e12
# The end of a range is first looked for this near to a computed crossing, as a share of it.
_NEAR = 1e-9
# Roots this near the unit circle are tried as crossings; those that are none do no harm.
_NEAR_THE_CIRCLE = 1e-3


class NotLinear(ValueError):
    """A scene whose loop in contact is not a linear map; the message names what makes it nonlinear."""


class NeverStable(ValueError):
    """A loop whose motion grows however soft its wall is."""


@dataclass(frozen=True)
class OneTickMap:
    """w -> M w for a wall that is never left, around the equilibrium; stable if and only if rho(M) < 1.

    With w = (z, y, c, u[k-1], ..., u[k-L-1]): z the states of the chain of bodies, x = z[0] what is sampled, y the
    accelerations felt at the last plant steps where they are read, c the controller's memory, u its commands:
        u[k], c[k+1] = the program's controller with (x[k], y) and c[k], without the wall, and -K x[k] added to u
        z[k+1] = Phi(n - r) (Phi(r) z[k] + Gamma(r) u[k-L-1]) + Gamma(n - r) u[k-L],    d = L n + r
    Phi(i), Gamma(i) are the plant's own exact flow over i of its n steps in a tick (Franklin, Powell and Workman,
    fractional delay). So M(K) = M(0) - K p q', p what a unit of u[k] adds, q' w = x. Any disturbance of the linear
    loop grows or decays by rho(M) a tick in the end.

    Attributes:
        without_wall: M(0), shape (w, w).
        pushed: p, shape (w,).
    """

    without_wall: np.ndarray
    pushed: np.ndarray

    @classmethod
    def from_scene(cls, scene: Scene, kinds: Kinds | None = None) -> OneTickMap:
        """Returns the map of a resolved scene in contact, with a wall or without; ``left_out`` says what it lacks.

        Raises:
            NotLinear: the loop is not a linear map, for the reasons that ``why_not_linear`` gives.
        """
        kinds = installed_kinds() if kinds is None else kinds
        if curved := why_not_linear(scene, kinds):
            raise NotLinear(
                "The stiffness limit is that of a linear loop: held forces on masses, springs and dampers. "
                f"{scene.title!r} also has {', '.join(curved)}; remove it to get the limit."
            )
        scene = with_spring(scene)
        after = _after_a_tick(scene, LinearController.from_scene(scene, kinds))
        return cls(after[:, :-1], after[:, -1])

    def matrix(self, stiffness: float) -> np.ndarray:
        """M for a wall of this stiffness in N/m, shape (w, w)."""
        matrix = self.without_wall.copy()
        matrix[:, 0] -= stiffness * self.pushed
        return matrix

    def growth(self, stiffness: float) -> float:
        """rho(M): the factor by which the motion grows every tick, in the end."""
        return float(np.abs(np.linalg.eigvals(self.matrix(stiffness))).max())

    def stable_ranges(self) -> list[tuple[float, float]]:
        """All stiffnesses with rho(M) < 1 in N/m, from soft to stiff, as ranges with ends bisected to the last bits.

        The first begins at 0 unless the loop grows however soft its wall is. A virtual inertia or a structural mode
        may leave others above it.
        """
        return list(self._ranges())

    def _ranges(self) -> Iterator[tuple[float, float]]:
        inner = [k for k in _crossings(self.without_wall, self.pushed) if _LEAST_N_M < k < _MOST_N_M]
        edges = [_LEAST_N_M, *inner, _MOST_N_M]
        probes = [(low * high) ** 0.5 for low, high in pairwise(edges)]
        begin, before = 0.0, False
        for at, probe in enumerate(probes):
            stable = self.growth(probe) < 1.0
            if at and stable != before:
                end = self._end_near(edges[at], probes[at - 1], probe, low_is_stable=before)
                if before:
                    yield begin, end
                begin = end
            before = stable
        if before:
            yield begin, np.inf

    def stiffness_limit(self) -> float:
        """The smallest stiffness with rho(M) = 1 in N/m: the end of the first stable range.

        Raises NeverStable where the loop grows even with the softest wall.
        """
        low, limit = next(self._ranges(), (np.inf, np.inf))
        if not low:
            return limit
        above = f" It is stable from {low:.6g} to {limit:.6g} N/m." if low < limit else ""
        raise NeverStable(f"The loop is unstable even with a wall of {_LEAST_N_M:g} N/m; it needs damping.{above}")

    def _end_near(self, edge: float, low: float, high: float, low_is_stable: bool) -> float:
        """The last stable stiffness between two of which one is stable; it should be next to ``edge``."""
        for near in (edge * (1.0 - _NEAR), edge * (1.0 + _NEAR)):
            if low < near < high:
                low, high = (near, high) if (self.growth(near) < 1.0) == low_is_stable else (low, near)
        stable, unstable = (low, high) if low_is_stable else (high, low)
        return bisect(lambda stiffness: self.growth(stiffness) < 1.0, stable, unstable)[0]


def _after_a_tick(scene: Scene, controller: LinearController) -> np.ndarray:
    """w after a tick from w and a force added to u[k], shape (w, w + 1); every quantity is its row over these."""
    time, chain = Timebase.from_scene(scene), Chain.from_scene(scene)
    states, felt = len(chain.states), _felt_steps(scene, time)
    sizes = states, felt, len(controller.moved), time.lookahead_ticks + 1, 1
    z, y, c, in_flight, added = np.split(np.eye(sum(sizes)), np.cumsum(sizes)[:-1])
    seen = np.vstack([c, z[:1], y[:1]])
    commands = np.vstack([controller.force @ seen + added[0], in_flight])  # u[k], u[k-1], ..., u[k-L-1]
    course, held = _course(chain, time, z, commands)
    if felt:
        y = np.vstack([y, _feel(scene, chain) @ np.concatenate([course[1:], held[:, None]], axis=1)])[-felt:]
    return np.vstack([course[-1], y, controller.moved @ seen, commands[:-1]])


def _course(chain: Chain, time: Timebase, z: np.ndarray, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """z at every plant step of a tick and at its end, shape (n + 1, states, w + 1), and the command held over each."""
    n, size = time.steps_per_tick, len(z)
    lookahead, late = divmod(time.delay_steps, n)
    flow = ChainTransition(chain, time.step_s, n, stuck=False)
    course, held = [z], []
    for steps, command in ((late, commands[lookahead + 1]), (n - late, commands[lookahead])):
        begin = np.vstack([course[-1], command])
        course += [begin[:size] + flow.held[: size + 1, i].T @ begin for i in range(steps)]
        held += [command] * steps
    return np.array(course), np.array(held)


def _felt_steps(scene: Scene, time: Timebase) -> int:
    """Counts the plant steps whose accelerations are remembered: as many as a reading is late, and the present one."""
    if not accelerometer_is_used(scene):
        return 0
    return 1 + round((scene.accelerometer or Accelerometer()).delay * time.plant_rate)


def _feel(scene: Scene, chain: Chain) -> np.ndarray:
    """From the states and the command held over the step that ends there to what is felt, shape (states + 1,)."""
    size = len(chain.states)
    if chain.sensor:
        return np.eye(size + 1)[chain.states.index("accelerometer")]
    body = sensor_body(scene)
    return chain.accelerations()[body, : size + 1].astype(float)


def _crossings(without_wall: np.ndarray, pushed: np.ndarray) -> list[float]:
    """Every K > 0 for which M = A - K p q' may have an eigenvalue on the unit circle, rising; q' w = w[0].

    det(z - M) = det(z - A) (1 + K G(z)) with G(z) = q' (z - A)^-1 p, so that on the circle G must be real there:
    G(z) = G(1/z), which is a generalised eigenvalue problem in z, and K = -1 / G(z). Being exact it also finds windows
    of stability however narrow. The list may hold more than crossings: touching points, and what rounding moves.
    """
    a, (scales, _) = matrix_balance(without_wall, permute=False, separate=True)  # numbers of like size, G kept
    b, c = pushed / scales, np.zeros(len(pushed))
    c[0] = scales[0]
    found = []
    for z in [*_real_on_the_circle(a, b, c), -1.0]:
        try:
            gain = c @ np.linalg.solve(z / abs(z) * np.eye(len(a)) - a, b)
        except np.linalg.LinAlgError:
            continue  # a pole of the loop without a wall: K = 0
        if gain.real < 0.0:
            found.append(float(-1.0 / gain.real))
    return sorted(found)


def _real_on_the_circle(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> list[complex]:
    """The z near the unit circle, not below the real axis, with c (z - A)^-1 b = c z (1 - z A)^-1 b."""
    n = len(a)
    size, weight = np.abs(b).max(), np.abs(c).max()
    of_z, constant = np.zeros((2, 2 * n + 1, 2 * n + 1))
    of_z[:n, :n], of_z[n:-1, n:-1], of_z[-1, n:-1] = np.eye(n), -a, -c / weight
    constant[:n, :n], constant[n:-1, n:-1], constant[-1, :n] = a, -np.eye(n), -c / weight
    constant[:-1, -1] = np.tile(b, 2) / size
    roots = eigvals(constant, of_z)
    return [z for z in roots[np.isfinite(roots)] if abs(abs(z) - 1.0) < _NEAR_THE_CIRCLE and z.imag >= 0.0]
