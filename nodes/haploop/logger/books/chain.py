"""The energy books of a chain of bodies, by exact integrals over each step and each piece of a step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import reduce
from itertools import accumulate
from operator import add
from typing import Any

import numpy as np

from haploop.logger.books.chain_integrals import ChainForms, ChainFormsArray
from haploop.logger.books.one_mass import beyond_limits
from haploop.logger.books.segments import Columns, Moves
from haploop.logger.books.sums import by_tick, sum_rows
from haploop.logger.books.work import Displacement
from haploop.plant.chain.chain import Chain
from haploop.plant.motion.hand_force import hand_force
from haploop.protocol.arrays import first_row
from haploop.protocol.ticks import Timebase


class ChainBooks:
    """What every plant step moves between the hand's muscles, dampers, friction, actuator, masses and springs.

    Over a step, or a piece of it where friction cut it, with x_j, v_j of body j and the stretch s_i of link i:
        work of tau        (tau + tau+)/2 dx + (tau+ - tau) integral (t - t_mid)/t_end v dt, of the last body
        heats              b integral v_j^2 dt of the dampers to ground, b_i integral s_i'^2 dt of the links
        heat of friction   -F dx_0, and m_0 v_0^2 / 2 where it stopped body 0
        kinetic change     sum of m_j dv_j (v_j + dv_j / 2)
        spring change      k_h dx (x - x_rest + dx / 2) of the last body + sum of k_i ds_i (s_i + ds_i / 2)
        actuator           (f_commanded - force) dx_0 + integral p' v_0 dt / (2 pi bandwidth)
    The last is what the actuator's limits keep from the device: it feels p = force - p' / (2 pi bandwidth), while the
    true books of wall and elements are those of the forces they commanded. Integrals are forms of the rates at the
    start (``ChainIntegrals``). Nothing is taken from the balance, so that its residual is a proof.

    Attributes:
        names: the books, in the order of the rows of ``increments``; heats end in ``_heat``.
        forms: the integrals.
        least_friction_J: the least heat of friction in any step so far, 0 or above but for rounding.
    """

    def __init__(self, scene: dict[str, Any], time: Timebase) -> None:
        # A sensor takes no energy.
        self._chain = replace(Chain.of(scene), sensor=None)
        self._n, self._tau = time.steps_per_tick, hand_force(scene, time.plant_rate)
        self.forms: Any = (ChainFormsArray if "loops" in scene else ChainForms)(self._chain, time.step_s)
        self._rubs, self._is_limited = "friction" in scene, "actuator" in scene
        self._heats = [name for name in self.forms.names if name.endswith("_heat")]
        friction, actuator = ["friction_heat"] * self._rubs, ["actuator"] * self._is_limited
        self.names = ["hand_work", *self._heats, *friction, "kinetic", "spring", *actuator]
        self.least_friction_J = 0.0

    def increments(
        self,
        first_step: int,
        columns: Columns,
        moved: Displacement,
        commanded: Iterable[np.ndarray],
        summed: Callable[[Any, int], Any] = by_tick,
    ) -> Iterator[np.ndarray]:
        """What each interval adds to each book, J; see ``PlantBooks.increments``."""
        for book in self.by_step(first_step, columns, moved.by_step, commanded):
            yield summed(book, self._n)

    def by_step(
        self, first_step: int, columns: Columns, dx: np.ndarray, commanded: Iterable[np.ndarray]
    ) -> Iterator[np.ndarray]:
        """What each step adds to each book, J, shape (steps,) each."""
        tau, force = self._tau.at_steps(first_step, first_step + len(dx) + 1), columns["force"][:-1]
        return self.of_moves(Moves.of(self._chain, first_step, columns), tau, force, dx, commanded)

    def of_moves(
        self, moves: Moves, tau: np.ndarray, force: np.ndarray, dx: np.ndarray, commanded: Iterable[np.ndarray]
    ) -> Iterator[np.ndarray]:
        """The same from the moves that the steps consist of, tau at the steps and at the end, and the force held."""
        steps = len(dx)
        rise = np.diff(tau, axis=0)[moves.step]
        start = tau[:-1][moves.step] + rise * moves.elapsed
        found = self.forms.integrals(moves, force[moves.step], start, rise)
        integrals = dict(zip(self.forms.names, found, strict=True))
        risen = np.ldexp(rise, -moves.level)
        way = sum_rows(moves.ways)
        books = {"hand_work": (start + risen / 2.0) * way + risen * integrals["swing"]}
        books |= {name: integrals[name] for name in self._heats}
        if self._rubs:
            books["friction_heat"] = -moves.friction * moves.ways[0] + moves.snap
        books |= {"kinetic": self._kinetic(moves), "spring": self._spring(moves, way)}
        for name, book in books.items():
            by_step = _by_step(book, moves.step, steps)
            if name == "friction_heat":
                self.least_friction_J = min(self.least_friction_J, float(by_step.min(initial=0.0)))
            yield by_step
        if self._is_limited:
            lag = _by_step(integrals.get("lag", np.zeros(way.shape)), moves.step, steps)
            yield lag + beyond_limits(commanded, force) * dx

    def _kinetic(self, moves: Moves) -> np.ndarray:
        n, masses = self._chain.count, self._chain.masses_kg
        v, dv = np.cumsum(moves.states[n : 2 * n], axis=0), np.cumsum(moves.changes, axis=0)
        return sum_rows([masses[body] * dv[body] * (v[body] + dv[body] / 2.0) for body in range(n)])

    def _spring(self, moves: Moves, way: np.ndarray) -> np.ndarray:
        """Change of energy in the hand's spring, whose end moves by ``way``, and in the links."""
        (stiffness, rest), lengths = self._chain.spring, moves.states[: self._chain.count]
        beyond = sum_rows([lengths[0] - rest, *lengths[1:], *moves.lows])
        parts = [stiffness * way * (beyond + way / 2.0)]
        for link, stretch, change in zip(self._chain.links, lengths[1:], moves.ways[1:], strict=True):
            parts.append(link.stiffness * change * (stretch + change / 2.0))
        return sum_rows(parts)

    def stored_J(self, columns: Columns) -> Any:
        """Kinetic and spring energy in the first state of some telemetry."""
        chain, n = self._chain, self._chain.count
        state = [first_row(columns[name]) for name in chain.states]
        (stiffness, rest), velocities = chain.spring, accumulate(state[n : 2 * n])
        energies = [mass * v * v for mass, v in zip(chain.masses_kg, velocities, strict=True)]
        energies += [link.stiffness * s * s for link, s in zip(chain.links, state[1:n], strict=True)]
        beyond = reduce(add, state[:n]) - rest
        return reduce(add, [*energies, stiffness * beyond * beyond]) / 2.0


def _by_step(values: np.ndarray, step: np.ndarray, steps: int) -> np.ndarray:
    """The sum over the moves of each step, in their order."""
    return values if len(values) == steps == step[-1] + 1 else np.bincount(step, values, steps)
